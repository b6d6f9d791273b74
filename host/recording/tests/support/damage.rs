//! Damaged texts, as from a full disk, an editor or another program.

use rand::{Rng, rngs::StdRng};

/// Texts that are cut, flipped, doubled or swapped, or have other separators or wrong numbers.
pub fn damage(text: &[u8], random: &mut StdRng) -> Vec<u8> {
    let mut bytes = text.to_vec();
    for _ in 0..random.random_range(1..4) {
        if bytes.is_empty() {
            break;
        }
        let at = random.random_range(0..bytes.len());
        let line = |n: usize| bytes.split(|b| *b == b'\n').nth(n).map(<[u8]>::to_vec);
        match random.random_range(0..9) {
            0 => bytes.truncate(at),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => bytes[at] = random.random(),
            3 => drop(bytes.remove(at)),
            4 => bytes.insert(at, *b",;\t()#\n\"".get(random.random_range(0..8)).unwrap()),
            5 => {
                let doubled = line(random.random_range(0..40)).unwrap_or_default();
                bytes.extend_from_slice(&doubled);
            }
            6 => {
                let word: &[u8] =
                    [&b"NaN"[..], b"inf", b"1e999", b"-", b"", b"99999999999999999999"]
                        [random.random_range(0..6)];
                bytes.splice(at..at, word.iter().copied());
            }
            7 => bytes.splice(at..at, [0xFF, 0x00]).for_each(drop),
            _ => {
                let end = (at + random.random_range(1..60)).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
    bytes
}
