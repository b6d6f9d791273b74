//! Realities behave as their names say, and sealing holds.

mod support;

use std::sync::atomic::{AtomicUsize, Ordering};

use cathforce_blind_test::{BlindTest, BlindTestError, Change, play, rigs};
use serde_json::json;

fn rms(a: &[f64]) -> f64 {
    (a.iter().map(|x| x * x).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn a_sensor_effect_changes_the_reading_alone() {
    let rig = &rigs()[0];
    let nominal = play(rig, &[], 1).unwrap();
    let gained = play(rig, &[Change::Gain { factor: 1.2 }], 1).unwrap();
    let norms = |trial: &[cathforce_blind_test::Row]| -> Vec<f64> {
        trial.iter().map(|row| row.force_n.norm()).collect()
    };
    let ratio = rms(&norms(&gained)) / rms(&norms(&nominal));
    assert!((ratio - 1.2).abs() < 0.01, "{ratio}");
    assert!(nominal.iter().zip(&gained).all(|(a, b)| a.tip_m == b.tip_m));
    assert!(rms(&norms(&nominal)) > 5e-3, "the instrument touches the wall");
}

#[test]
fn friction_is_pushed_against_and_late_motion_is_late() {
    let rig = &rigs()[0];
    let pushed = |changes: &[Change]| {
        let trial = play(rig, changes, 1).unwrap();
        // The end of the first feed.
        trial.iter().filter(|r| r.t_s > 2.0 && r.t_s < 2.7).map(|r| r.drive_force_n).sum::<f64>()
    };
    assert!(pushed(&[Change::Friction { factor: 2.0 }]) > 1.1 * pushed(&[]));
    let nominal = play(rig, &[], 1).unwrap();
    let late = play(rig, &[Change::Latency { time_s: 0.04 }], 1).unwrap();
    let worst = nominal.iter().zip(&late[10..]).map(|(a, b)| (a.tip_m - b.tip_m).norm());
    assert!(worst.fold(0.0, f64::max) < 2e-4, "40 ms are ten rows");
}

#[test]
fn a_blind_test_is_made_to_its_end_by_a_second_call_that_leaves_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let blind_test = BlindTest::at(folder.path());
    let (stands, told) = ([support::short()], AtomicUsize::new(0));
    let tell = || {
        told.fetch_add(1, Ordering::Relaxed);
    };
    assert!(blind_test.make(Some(3), 2, 5, &stands, &tell).unwrap().is_empty());
    let label = |case: &str| std::fs::read(folder.path().join(format!("labels/{case}.json")));
    let first = label("000").unwrap();
    let trial = folder.path().join("cases/001/trials/000.csv");
    let played = std::fs::read(&trial).unwrap();
    std::fs::remove_file(folder.path().join("labels/001.json")).unwrap();
    std::fs::write(&trial, "half").unwrap();
    assert!(blind_test.make(Some(3), 2, 6, &stands, &tell).unwrap().is_empty());
    assert_eq!(label("000").unwrap(), first, "its salt was drawn before");
    assert_eq!(std::fs::read(&trial).unwrap(), played);
    assert!(label("001").is_ok());
    assert_eq!(told.load(Ordering::Relaxed), 4);
    let made = std::fs::read_to_string(folder.path().join("made.json")).unwrap();
    assert!(made.contains("\"is_whole\": true"), "{made}");
    // Without a seed it goes on with the one that is there; another number is another draw.
    assert!(blind_test.make(None, 2, 7, &stands, &tell).unwrap().is_empty());
    assert_eq!(label("000").unwrap(), first);
    let other_count = blind_test.make(Some(3), 3, 6, &stands, &|| {});
    assert!(matches!(other_count, Err(BlindTestError::AlreadyMade(_))));
    let twice = [stands[0].clone(), stands[0].clone()];
    let one_name = BlindTest::at(&folder.path().join("new")).make(None, 2, 6, &twice, &|| {});
    assert!(matches!(one_name, Err(BlindTestError::OneName(_))));
    let other_seed = blind_test.make(Some(4), 2, 6, &stands, &|| {});
    assert!(matches!(other_seed, Err(BlindTestError::AlreadyMade(_))));
    blind_test.seal().unwrap();
    let sealed = blind_test.make(Some(3), 2, 6, &stands, &|| {});
    assert!(matches!(sealed, Err(BlindTestError::AlreadyMade(_))));
}

/// A blind test of one case that is soon played.
fn of_one_case(folder: &std::path::Path) -> BlindTest {
    let blind_test = BlindTest::at(folder);
    blind_test.make(Some(3), 1, 5, &[support::short()], &|| {}).unwrap();
    blind_test
}

#[test]
fn a_seal_that_would_be_worth_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let blind_test = of_one_case(folder.path());
    assert!(matches!(blind_test.reveal(), Err(BlindTestError::NotSealed(_))));
    let (answers, made) = (folder.path().join("answers"), folder.path().join("made.json"));
    std::fs::create_dir(&answers).unwrap();
    assert!(matches!(blind_test.seal(), Err(BlindTestError::AlreadyAnswered(_))));
    std::fs::remove_dir(&answers).unwrap();
    let whole = std::fs::read_to_string(&made).unwrap();
    std::fs::write(&made, whole.replace("true", "false")).unwrap();
    assert!(matches!(blind_test.seal(), Err(BlindTestError::NotFinished(_))));
    std::fs::write(&made, whole).unwrap();
    blind_test.seal().unwrap();
    assert!(matches!(blind_test.seal(), Err(BlindTestError::AlreadySealed(_))));
}

#[test]
fn what_was_changed_after_the_seal_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let blind_test = of_one_case(folder.path());
    let seals = blind_test.seal().unwrap();
    blind_test.check_case(&seals, "000").unwrap();
    assert!(matches!(blind_test.reveal(), Err(BlindTestError::NotAnswered(_))));
    blind_test.keep_answer("000", &json!({ "verdict": "unknown" })).unwrap();
    let trial = folder.path().join("cases/000/trials/000.csv");
    let rows = std::fs::read_to_string(&trial).unwrap();
    std::fs::write(&trial, rows.replacen('1', "2", 1)).unwrap();
    let changed = blind_test.check_case(&seals, "000");
    assert!(matches!(changed, Err(BlindTestError::Changed(_))), "{changed:?}");
    assert!(matches!(blind_test.reveal(), Err(BlindTestError::Changed(_))));
    std::fs::write(&trial, rows).unwrap();
    assert_eq!(blind_test.reveal().unwrap().len(), 1);
    // Who has seen the labels answers no more.
    let revealed = blind_test.check_case(&seals, "000");
    assert!(matches!(revealed, Err(BlindTestError::AlreadyRevealed(_))), "{revealed:?}");
    let label = folder.path().join("labels/000.json");
    let text = std::fs::read_to_string(&label).unwrap();
    std::fs::write(&label, text.replace("severity", "Severity")).unwrap();
    assert!(matches!(blind_test.reveal(), Err(BlindTestError::Broken(_))));
}
