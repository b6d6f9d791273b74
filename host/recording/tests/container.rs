//! A recording on disk: whole, broken off, damaged, foreign.

#[path = "support/record.rs"]
mod record;

use std::fs;
use std::path::Path;

use cathforce_bus::{Frame, Id};
use cathforce_recording::{
    Dropout, DropoutCause, ReadError, Recorder, Recording, is_being_recorded,
};
use record::{SHAPE_M, TICKS, attachments, frames, info, record, result, rows};

/// Two recorders may both have found the name free a moment ago.
#[test]
fn a_recorder_never_takes_the_place_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = record(folder.path());
    let before = std::fs::read(&path).unwrap();
    let error = Recorder::create(&path, &info(), attachments()).err().unwrap().to_string();
    assert!(error.contains("run.mcap: File exists"), "{error}");
    assert!(std::fs::read(&path).unwrap() == before);
}

#[cfg(unix)]
#[test]
fn a_file_that_is_being_recorded_is_known_for_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let recorder = Recorder::create(&path, &info(), attachments()).unwrap();
    assert!(is_being_recorded(&path));
    recorder.finish(None).unwrap();
    assert!(!is_being_recorded(&path) && !is_being_recorded(folder.path()));
}

#[test]
fn what_was_recorded_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let recording = Recording::open(&record(folder.path())).unwrap();
    assert_eq!(recording.info, info());
    assert_eq!(recording.image, attachments().image);
    assert_eq!(recording.rig_toml, attachments().rig_toml);
    assert_eq!(recording.dbc, attachments().dbc);
    let [(name, bytes)] = &recording.vessel[..] else { panic!("one file") };
    assert_eq!((name.as_str(), bytes.as_slice()), attachments().vessel[0]);
    assert_eq!(recording.frames, frames());
    let logged = frames().iter().map(|f| f.at_ns + 9).collect::<Vec<_>>();
    assert_eq!(recording.logged_ns, logged);
    assert_eq!(recording.dropouts, []);
    assert_eq!(recording.trial.shapes_m[0], SHAPE_M);
    assert_eq!(recording.trial.shapes_m[1..], vec![Vec::<[f64; 3]>::new(); 9]);
    assert_eq!(recording.trial.rows, rows());
    assert_eq!(recording.trial.noise, info().noise);
    assert_eq!(recording.trial_start_ns, Some(3_000_000));
    assert_eq!(recording.result, Some(result()));
    assert_eq!(recording.cut, None);
}

#[test]
fn the_library_and_its_index_read_it_too() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(record(folder.path())).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().expect("a finished file has a summary");
    assert_eq!(summary.attachment_indexes.len(), 5);
    let topics = |topic: &str| {
        mcap::MessageStream::new(&bytes)
            .unwrap()
            .filter(|m| m.as_ref().unwrap().channel.topic == topic)
            .count()
    };
    let ticks = TICKS as usize;
    assert_eq!(topics("/cathforce/to_can_bus"), ticks);
    assert_eq!(topics("/cathforce/from_can_bus"), 2 * ticks);
    assert_eq!(topics("/catheter/measured_js"), ticks);
    assert_eq!(topics("/catheter/estimated/spatial/measured_cf"), ticks);
    assert_eq!(topics("/catheter/operating_state"), 1, "one change");
    assert_eq!(topics("/cathforce/measured"), rows().len());
}

/// P24: frames that could not be used or never came are in the recording, with their cause.
#[test]
fn p24_lost_and_broken_frames_are_listed_with_their_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gaps.mcap");
    let mut recorder = Recorder::create(&path, &info(), attachments()).unwrap();
    let mut sent = frames();
    // Of every tick: ENCODER, HAPTIC, CONTACT.
    let corrupt = &mut sent[3 * 10 + 1];
    let mut data = corrupt.frame.data().to_vec();
    data[0] ^= 1;
    corrupt.frame = Frame::new(corrupt.frame.id(), &data).unwrap();
    let at = |tick: u64| tick * 1_000_000;
    sent.retain(|f| !(f.at_ns >= at(20) && f.at_ns < at(23)));
    for frame in &sent {
        recorder.frame(frame, frame.at_ns).unwrap();
    }
    let overload = Dropout {
        from_ns: at(30),
        to_ns: at(31),
        cause: DropoutCause::HostOverload,
        id: None,
        frames: 6,
    };
    recorder.dropout(&overload).unwrap();
    recorder.finish(None).unwrap();
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.frames, sent, "broken ones too");
    let seen = |cause, tick, id: Id, frames| {
        let at_ns = at(tick);
        Dropout { from_ns: at_ns, to_ns: at_ns, cause, id: Some(id.raw()), frames }
    };
    let lost = |id, frames| seen(DropoutCause::Lost, 23, id, frames);
    let expected = [
        seen(DropoutCause::Corrupt, 10, Id::Haptic, 1),
        // The next intact frame shows that one was missing.
        seen(DropoutCause::Lost, 11, Id::Haptic, 1),
        lost(Id::Encoder, 3),
        lost(Id::Haptic, 3),
        lost(Id::Contact, 3),
        overload,
    ];
    assert_eq!(recording.dropouts, expected);
}

/// P23: the file of a killed recorder is read up to its last flush.
#[test]
fn p23_a_killed_recorder_leaves_a_readable_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.mcap");
    let mut recorder = Recorder::create(&path, &info(), attachments()).unwrap();
    let frames = frames();
    let (flushed, lost) = frames.split_at(60);
    for frame in flushed {
        recorder.frame(frame, frame.at_ns).unwrap();
    }
    recorder.flush().unwrap();
    for frame in lost {
        recorder.frame(frame, frame.at_ns).unwrap();
    }
    // A killed process runs no destructor.
    std::mem::forget(recorder);
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.frames, flushed);
    assert_eq!(recording.cut.unwrap().byte as u64, fs::metadata(&path).unwrap().len());
}

/// A file that is cut anywhere is refused or read up to the cut; frames are never wrong.
#[test]
fn a_file_cut_at_any_byte_is_refused_or_read_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(record(folder.path())).unwrap();
    let path = folder.path().join("cut.mcap");
    let mut read = 0;
    for length in (0..bytes.len()).step_by(61) {
        fs::write(&path, &bytes[..length]).unwrap();
        if let Ok(recording) = Recording::open(&path) {
            assert!(recording.cut.is_some_and(|cut| cut.byte <= length), "{length}");
            assert!(frames().starts_with(&recording.frames), "{length}");
            read += 1;
        }
    }
    assert!(read > 0, "some prefix holds everything but the frames");
}

#[test]
fn errors_name_the_file_the_byte_and_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(record(folder.path())).unwrap();
    let path = folder.path().join("broken.mcap");
    let error = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        Recording::open(&path).unwrap_err()
    };

    let text = error(b"solid vessel").to_string();
    assert!(text.contains("broken.mcap: byte 0: not an MCAP file"), "{text}");
    assert!(text.contains("73 6f 6c 69 64"), "{text}");

    let mut foreign = Vec::new();
    mcap::Writer::new(std::io::Cursor::new(&mut foreign)).unwrap().finish().unwrap();
    let text = error(&foreign).to_string();
    assert!(text.contains("no `cathforce` metadata"), "{text}");

    let text = error(&bytes[..mcap::MAGIC.len()]).to_string();
    assert!(text.contains("breaks off at byte 8, before the `cathforce` metadata"), "{text}");

    let missing = Recording::open(&folder.path().join("absent.mcap")).unwrap_err();
    assert!(matches!(missing, ReadError::Io { .. }), "{missing}");
}

/// The type of a field of a ROS 2 type, by the text of its schema: the type's own fields, then those
/// of the types in it, each after a line `MSG: package/Type`.
fn field_type<'s>(schema: &'s str, of: Option<&str>, field: &str) -> Option<&'s str> {
    let mut parts = schema.split("MSG: ");
    let part = match of {
        None => parts.next(),
        Some(of) => parts.skip(1).find(|part| part.lines().next() == Some(of)),
    };
    let mut words = part?.lines().map(|line| line.split_whitespace());
    words.find_map(|mut words| {
        let (kind, name) = (words.next()?, words.next()?);
        (name == field).then(|| kind.split('[').next().unwrap_or(kind))
    })
}

/// Whether messages of this schema have a nested field with this path.
fn has_fields(schema: &str, fields: &[&str]) -> bool {
    // A joint's values are shown by its name; the schema has them as sequences.
    let fields = match fields {
        ["insertion" | "rotation", rest @ ..] => rest,
        fields => fields,
    };
    let mut of = None;
    fields.iter().all(|field| {
        let field = field.split('[').next().unwrap_or(field);
        let kind = field_type(schema, of, field);
        of = kind;
        kind.is_some()
    })
}

/// The shipped layouts use only topics of a recording and fields of their messages.
#[test]
fn every_topic_and_field_of_the_layouts_is_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(record(folder.path())).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let topics = summary.channels.values().map(|channel| {
        let schema = channel.schema.as_ref().unwrap();
        (channel.topic.as_str(), std::str::from_utf8(&schema.data).unwrap())
    });
    let topics = topics.collect::<Vec<_>>();
    let layouts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/layouts");
    for (name, after_topic) in [("foxglove.json", ['.', '"']), ("plotjuggler.xml", ['/', '"'])] {
        let text = fs::read_to_string(layouts.join(name)).unwrap();
        let paths = text.match_indices("\"/").map(|(at, _)| &text[at + 1..]);
        // Closing elements have no path.
        let paths = paths.filter(|path| !path.starts_with("/>"));
        let mut found = 0;
        for path in paths {
            let path = path.split('"').next().unwrap();
            let known = topics.iter().any(|(topic, schema)| {
                let fields = path.strip_prefix(topic).map(|rest| {
                    rest.split(after_topic).filter(|field| !field.is_empty()).collect::<Vec<_>>()
                });
                fields.is_some_and(|fields| has_fields(schema, &fields))
            });
            assert!(known, "{name}: {path}");
            found += 1;
        }
        assert!(found >= 10, "{name}: {found}");
    }
}

#[test]
fn a_field_that_is_none_is_told_from_one() {
    let schema = "std_msgs/Header header\nWrench wrench\nfloat64[] effort\n===\nMSG: Wrench\n\
                  Vector3 force\n===\nMSG: Vector3\nfloat64 x\n";
    assert!(has_fields(schema, &["wrench", "force", "x"]));
    assert!(has_fields(schema, &["insertion", "effort[0]"]));
    for wrong in [&["wrench", "force", "w"][..], &["wrench", "torque"], &["x"], &["wrench", "x"]] {
        assert!(!has_fields(schema, wrong), "{wrong:?}");
    }
}
