//! A recording with damage in it, and one that another program has packed.

#[path = "support/record.rs"]
mod record;

use std::path::Path;

use cathforce_recording::{Damage, DropoutCause, Recording, ReplayError, replay};
use record::{attachments, frames, info, record, result, rows};

const CHUNK: u8 = 0x06;
const ATTACHMENT: u8 = 0x09;
const METADATA: u8 = 0x0C;
const DATA_END: u8 = 0x0F;
const HEAD: usize = 9;

fn made() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::read(record(folder.path())).unwrap()
}

fn open(bytes: &[u8]) -> Result<Recording, String> {
    Recording::of_bytes(Path::new("run.mcap"), bytes).map_err(|error| error.to_string())
}

/// Opcode, beginning and body of each record.
fn records(bytes: &[u8]) -> Vec<(u8, usize, &[u8])> {
    let mut at = mcap::MAGIC.len();
    let mut found = Vec::new();
    while at + mcap::MAGIC.len() < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + HEAD].try_into().unwrap()) as usize;
        found.push((bytes[at], at, &bytes[at + HEAD..at + HEAD + length]));
        at += HEAD + length;
    }
    found
}

fn first(bytes: &[u8], opcode: u8) -> usize {
    records(bytes).iter().find(|record| record.0 == opcode).unwrap().1
}

fn position(bytes: &[u8], what: &[u8]) -> usize {
    bytes.windows(what.len()).position(|window| window == what).unwrap()
}

/// Every flipped bit is noticed, and what is still taken is what was recorded.
#[test]
fn no_flipped_bit_passes() {
    let bytes = made();
    assert_eq!(open(&bytes).unwrap().damage, []);
    let (all, rows) = (frames(), rows());
    let (mut refused, mut used) = (0, 0);
    // A step that is prime to the length of every number and text.
    for bit in (0..8 * bytes.len()).step_by(59) {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        match open(&damaged) {
            Err(_) => refused += 1,
            Ok(found) => {
                assert!(!found.damage.is_empty() || found.cut.is_some(), "bit {bit} passes");
                let mut left = all.iter();
                assert!(found.frames.iter().all(|frame| left.any(|own| own == frame)), "bit {bit}");
                assert!(rows.starts_with(&found.trial.rows), "bit {bit}");
                assert_eq!(found.info, info(), "bit {bit}");
                assert!(found.result.is_none_or(|found| found == result()), "bit {bit}");
                used += 1;
            }
        }
    }
    assert!(refused > 20 && used > 200, "{refused} {used}");
}

#[test]
fn the_record_that_is_damaged_is_named() {
    let bytes = made();
    let flipped = |at: usize| {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        open(&damaged)
    };
    let metadata = first(&bytes, METADATA);
    let error = flipped(position(&bytes, b"force_noise_sd_n") + 20).unwrap_err();
    assert!(error.contains(&format!("byte {metadata}: ")), "{error}");
    assert!(error.contains("metadata `cathforce` does not match its checksum"), "{error}");
    let rig = flipped(position(&bytes, b"format = 1")).unwrap_err();
    assert!(
        rig.contains("attachment `rig.toml` does not match")
            && rig.contains("no attached rig.toml"),
        "{rig}"
    );
    let vessel = flipped(position(&bytes, b"branch,s_m")).unwrap();
    assert!(vessel.damage[0].what.contains("attachment `centreline.csv`"), "{:?}", vessel.damage);
    assert!(vessel.vessel.is_empty() && vessel.frames == frames());
    let missed = flipped(position(&bytes, b"missed_ticks") + 16).unwrap();
    assert!(missed.damage[0].what.contains("`cathforce.result`") && missed.result.is_none());
    assert!(missed.completeness().contains("`cathforce.result`"), "{}", missed.completeness());
}

#[test]
fn a_damaged_chunk_is_left_out_and_the_rest_is_used() {
    let bytes = made();
    let chunk = first(&bytes, CHUNK);
    // The chunk with the frames, not the first one with the entry.
    let chunks = records(&bytes).into_iter().filter(|record| record.0 == CHUNK).collect::<Vec<_>>();
    let (_, at, body) = *chunks.iter().max_by_key(|chunk| chunk.2.len()).unwrap();
    assert!(at > chunk, "the entry is in a chunk of its own");
    let mut damaged = bytes.clone();
    damaged[at + HEAD + body.len() / 2] ^= 1;
    let found = open(&damaged).unwrap();
    let [Damage { byte, what }, rows_lost] = &found.damage[..] else {
        panic!("{:?}", found.damage)
    };
    assert_eq!(*byte, at);
    assert!(what.contains("0.000 to 0.0") && what.contains("checksum"), "{what}");
    assert!(rows_lost.what.contains("10 of 10 measured rows"), "{rows_lost:?}");
    let [lost] = found.dropouts[..] else { panic!("{:?}", found.dropouts) };
    assert_eq!((lost.cause, lost.frames as usize), (DropoutCause::DamagedFile, frames().len()));
    assert_eq!(found.result, Some(result()));
    assert!(matches!(replay(&found), Err(ReplayError::Damaged { byte }) if byte == at));
}

/// The file with each chunk's records as `pack` gives them, and without the checksum over all data.
fn repacked(
    bytes: &[u8],
    with_index: bool,
    pack: impl Fn(&[u8]) -> Option<(&'static str, Vec<u8>)>,
) -> Vec<u8> {
    // Start and end time, length and checksum, before the name of the compression and a length.
    const FIXED: usize = 8 + 8 + 8 + 4;
    let mut out = mcap::MAGIC.to_vec();
    let mut put = |opcode: u8, body: &[u8]| {
        out.push(opcode);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    };
    for (opcode, _, body) in records(bytes) {
        match opcode {
            CHUNK => {
                let data = &body[FIXED + 4 + 8..];
                match pack(data) {
                    Some((name, packed)) => {
                        let mut chunk = body[..FIXED].to_vec();
                        chunk.extend((name.len() as u32).to_le_bytes());
                        chunk.extend(name.as_bytes());
                        chunk.extend((packed.len() as u64).to_le_bytes());
                        chunk.extend(packed);
                        put(CHUNK, &chunk);
                    }
                    None => {
                        let mut inner = mcap::MAGIC.to_vec();
                        inner.extend(data);
                        inner.extend(mcap::MAGIC);
                        records(&inner).iter().for_each(|record| put(record.0, record.2));
                    }
                }
            }
            DATA_END => {
                put(DATA_END, &[0; 4]);
                if !with_index {
                    break;
                }
            }
            _ => put(opcode, body),
        }
    }
    if !with_index {
        // A footer without an index.
        put(0x02, &[0; 20]);
    }
    out.extend(mcap::MAGIC);
    out
}

#[test]
fn a_recording_that_another_program_has_packed_is_read_like_ours() {
    use std::io::Write as _;
    let bytes = made();
    let zstd = |data: &[u8]| {
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        Some(("zstd", ruzstd::encoding::compress_to_vec(data, level)))
    };
    let lz4 = |data: &[u8]| {
        let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
        encoder.write_all(data).unwrap();
        Some(("lz4", encoder.finish().unwrap()))
    };
    let none = |_: &[u8]| None;
    // The footer of ours points at an index whose place has changed.
    for packed in
        [repacked(&bytes, false, zstd), repacked(&bytes, false, lz4), repacked(&bytes, false, none)]
    {
        let found = open(&packed).unwrap();
        assert_eq!((found.damage.as_slice(), found.cut), (&[][..], None));
        assert_eq!((found.frames, found.trial.rows), (frames(), rows()));
        assert_eq!((found.info, found.result), (info(), Some(result())));
        assert_eq!(found.image, attachments().image);
    }
    let unknown = repacked(&bytes, false, |data| Some(("brotli", data.to_vec())));
    let damage = open(&unknown).unwrap().damage;
    assert!(damage[0].what.contains("compressed with brotli"), "{damage:?}");
    assert_eq!(records(&bytes).iter().filter(|record| record.0 == ATTACHMENT).count(), 5);
}

/// What another program sorts by topic is put in the order of the bus again.
#[test]
fn frames_in_another_order_are_put_in_that_of_the_bus() {
    let bytes = made();
    let unchunked = repacked(&bytes, false, |_| None);
    let mut reversed = mcap::MAGIC.to_vec();
    let all = records(&unchunked);
    let (messages, others): (Vec<_>, Vec<_>) = all.into_iter().partition(|record| record.0 == 0x05);
    let end = others.iter().position(|record| record.0 == DATA_END).unwrap();
    let order = others[..end].iter().chain(messages.iter().rev()).chain(&others[end..]);
    for (opcode, _, body) in order {
        reversed.push(*opcode);
        reversed.extend((body.len() as u64).to_le_bytes());
        reversed.extend(*body);
    }
    reversed.extend(mcap::MAGIC);
    assert_eq!(open(&reversed).unwrap().frames, frames());
}
