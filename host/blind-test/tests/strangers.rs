//! Strangers are written as bundles that a reader takes, and scored by what is strange about them.

use std::fs;
use std::path::Path;

use cathforce_blind_test::{
    BlindTest, Counted, Label, MotionKind, Published, Rigs, Set, score, strangers,
};
use cathforce_bundle::Bundle;
use serde_json::json;

/// A seed whose only case is soon played.
fn soon_played() -> u64 {
    let is_short = |seed: &u64| {
        let case = &strangers(Set::Tuning, None, *seed, 1)[0];
        case.motion == MotionKind::Short && case.trials() == 3
    };
    (0..1000).find(is_short).unwrap()
}

fn made(folder: &Path, seed: u64, secret: u64) -> Label {
    let left_out =
        BlindTest::at(folder).make_strangers(Set::Tuning, None, Some(seed), 1, secret, &|| {});
    assert!(left_out.unwrap().is_empty());
    serde_json::from_slice(&fs::read(folder.join("labels/000.json")).unwrap()).unwrap()
}

#[test]
fn a_stranger_is_a_bundle_with_the_channels_of_its_label_and_the_same_for_one_seed() {
    let folder = tempfile::tempdir().unwrap();
    let (one, other) = (folder.path().join("one"), folder.path().join("other"));
    let seed = soon_played();
    let label = made(&one, seed, 5);
    let stranger = label.stranger.clone().unwrap();
    let bundle = Bundle::open(one.join("cases/000")).unwrap();
    assert_eq!(bundle.rig.name, "case-000");
    assert_eq!(bundle.trials.len(), 3);
    let sensors = &stranger.sensors;
    assert_eq!(bundle.rig.sensor.force_noise_sd_n, sensors.stated.force_n);
    assert_eq!(bundle.rig.sensor.tip_noise_sd_m, sensors.stated.tip_m);
    assert_eq!(bundle.rig.sensor.drive_noise_sd_n, sensors.stated.drive_n);
    for trial in &bundle.trials {
        let data = trial.catheter().unwrap();
        assert_eq!(data.tip_m.is_some(), sensors.tip_noise_m.is_some());
        assert_eq!(data.drive_force_n.is_some(), sensors.drive_noise_n.is_some());
        let gaps = data.force_n.as_ref().unwrap().iter().filter(|force| force.is_none()).count();
        assert!(gaps == 0 || sensors.drop_outs.is_some());
    }
    assert_eq!(label.effects.len(), stranger.families.len());
    assert!(label.gap_over_floor.unwrap() >= 1.0);
    // The bundle tells nothing of what is strange about it.
    let rig = fs::read_to_string(one.join("cases/000/rig.toml")).unwrap();
    assert!(!rig.contains(&stranger.rig.instrument) && !rig.contains(&stranger.rig.vessel));

    let again = made(&other, seed, 6);
    assert_ne!(label.salt, again.salt);
    assert_eq!(Label { salt: label.salt.clone(), ..again }, label);
    let trial = |folder: &Path| fs::read(folder.join("cases/000/trials/002.csv")).unwrap();
    assert!(trial(&one) == trial(&other));
}

#[test]
fn a_score_of_strangers_is_split_by_what_is_strange() {
    let folder = tempfile::tempdir().unwrap();
    let mut label = made(folder.path(), soon_played(), 5);
    label.gap_over_noise = 5.0;
    let right = json!({
        "verdict": "named",
        "effects": [{ "id": label.effects[0].id, "confidence": 0.9, "parameters": {} }],
        "confusable": [],
    });
    let unknown = json!({ "verdict": "unknown" });
    let scored = score(
        Published::default(),
        String::new(),
        &[(label.clone(), right), (label.clone(), unknown)],
    );
    assert_eq!(scored.rigs, Rigs::Strangers);
    let kinds = label.stranger.as_ref().unwrap().kinds();
    assert_eq!(scored.parts.len(), kinds.len());
    for part in &scored.parts {
        assert!(kinds.iter().any(|(by, kind)| *by == part.by && *kind == part.kind), "{part:?}");
        assert_eq!(part.cases, 2);
        let named = part.figures.iter().find(|figure| figure.figure == Counted::NamedFirst);
        assert_eq!(named.unwrap().reached, Some(50.0));
    }
    let text = scored.markdown();
    assert!(text.contains("| motion: short trials | 2 | 50 % of 2 |"), "{text}");
    let back: cathforce_blind_test::Score =
        serde_json::from_str(&serde_json::to_string(&scored).unwrap()).unwrap();
    assert_eq!(back.parts, scored.parts);
}

#[test]
fn cases_of_one_set_do_not_get_into_a_folder_of_the_other() {
    let folder = tempfile::tempdir().unwrap();
    made(folder.path(), soon_played(), 5);
    let blind_test = BlindTest::at(folder.path());
    assert!(blind_test.make_strangers(Set::Sealed, None, None, 1, 5, &|| {}).is_err());
}
