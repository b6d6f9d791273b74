//! The measured axis of `../shared` when it is there, with effects taken out of the model and put into the
//! data.

use std::path::{Path, PathBuf};

use cathforce_bundle::Bundle;
use cathforce_gap::drive::{Drive, DriveError, Spiking};
use cathforce_gap::report::Verdict;
use cathforce_gap::spike::Spike;
use cathforce_gap::{Altered, diagnose};

use crate::made::{ask, columns, names, read_in_steps, value};

/// Keeps every so many rows.
fn thin(bundle: &mut Bundle, every: usize) {
    for trial in &mut bundle.trials {
        let kept = |column: &[f64]| column.iter().step_by(every).copied().collect();
        trial.t_s = kept(&trial.t_s);
        let data = columns(trial);
        data.position = kept(&data.position);
        data.command = kept(&data.command);
        data.setpoint =
            data.setpoint.as_ref().map(|own| own.iter().step_by(every).copied().collect());
    }
}

/// The measured axis, when it is there.
fn measured() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/emps-drive");
    path.exists().then_some(path)
}

/// What the authors of the data documented, `PROVENANCE.md` beside it.
const COULOMB_N: f64 = 20.3935;
const VISCOUS_N_S_PER_M: f64 = 203.5034;
const OFFSET_N: f64 = -3.1648;
const DOCUMENTED: [(&str, &str, f64); 3] = [
    ("drive.coulomb", "force_n", COULOMB_N),
    ("drive.viscous", "n_s_per_m", VISCOUS_N_S_PER_M),
    ("drive.offset", "force_n", OFFSET_N),
];

#[test]
fn documented_friction_is_recovered_from_real_measurements() {
    let Some(path) = measured() else { return };
    let answer = ask(&path);
    assert_eq!(answer.verdict, Verdict::Named);
    for (id, name, documented) in DOCUMENTED {
        let effect = answer.effects.iter().find(|e| e.id == id);
        let found = value(effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())), name);
        assert!((found / documented - 1.0).abs() < 0.05, "{id}: {found} for {documented}");
    }
    // Frozen on the other record.
    for held_out in &answer.details.held_out {
        assert!(held_out.before_n > 37.0 && held_out.after_n < 3.4, "{held_out:?}");
    }
    assert!(answer.confusable.iter().any(|set| set.contains(&"sensor.bias".to_owned())));
}

#[test]
fn rows_that_are_far_apart_are_refused_or_say_the_same() {
    let Some(path) = measured() else { return };
    let whole = Bundle::open(path).unwrap();
    for every in [21, 25, 40] {
        let mut bundle = whole.clone();
        thin(&mut bundle, every);
        let refused = Drive::new(&bundle).err();
        assert!(matches!(refused, Some(DriveError::TooSeldom { .. })), "{every}: {refused:?}");
    }
    // Of every twentieth row, at 50 Hz, the smallest of the three is hidden by the floor.
    for (stated, every, found) in [(None, 10, 3), (Some(1e-6), 10, 3), (None, 20, 2)] {
        let mut bundle = whole.clone();
        bundle.rig.sensor.position_noise_sd_m = stated;
        thin(&mut bundle, every);
        let answer = diagnose(&Drive::new(&bundle).unwrap(), "thin", &cathforce_gap::unwatched);
        println!("every {every}: {}", answer.sentence());
        assert_eq!(answer.verdict, Verdict::Named, "{stated:?}: {}", answer.sentence());
        for (id, name, documented) in &DOCUMENTED[..found] {
            let effect = answer.effects.iter().find(|effect| effect.id == *id);
            let effect = effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence()));
            let found = value(effect, name);
            assert!((found / documented - 1.0).abs() < 0.05, "{id}: {found} for {documented}");
        }
    }
}

#[test]
fn an_effect_taken_out_of_the_model_is_found_in_real_data() {
    let Some(path) = measured() else { return };
    let bundle = Bundle::open(path).unwrap();
    let drive = Drive::new(&bundle).unwrap();
    let offset: (&str, &[f64]) = ("drive.offset", &[OFFSET_N]);
    let dry: (&str, &[f64]) = ("drive.coulomb", &[COULOMB_N]);
    let viscous: (&str, &[f64]) = ("drive.viscous", &[VISCOUS_N_S_PER_M]);
    for (kept, removed) in [([offset, viscous], "drive.coulomb"), ([offset, dry], "drive.viscous")]
    {
        let answer =
            diagnose(&Altered::assuming(&drive, &kept), "ablation", &cathforce_gap::unwatched);
        assert_eq!(answer.verdict, Verdict::Named, "{removed}: {}", answer.sentence());
        assert_eq!(names(&answer)[0], removed, "{}", answer.sentence());
    }
    // The smallest of them is beside 2 N that nothing explains, and only a part of what is there
    // then; that a bias of the measurement explains as much speaks not against it.
    let answer = diagnose(
        &Altered::assuming(&drive, &[dry, viscous]),
        "ablation",
        &cathforce_gap::unwatched,
    );
    assert_eq!(answer.verdict, Verdict::Partial, "{}", answer.sentence());
    assert_eq!(names(&answer), ["drive.offset"], "{}", answer.sentence());
    assert!(answer.confusable[0].contains(&"sensor.bias".to_owned()), "{:?}", answer.confusable);
}

#[test]
fn effects_are_put_in_beside_what_is_there() {
    let Some(path) = measured() else { return };
    let bundle = Bundle::open(path).unwrap();
    let spiking = Spiking::new(&bundle).unwrap();
    for (id, name, there) in
        [("drive.coulomb", "force_n", 32.0), ("drive.viscous", "n_s_per_m", 360.0)]
    {
        let spike = Spike { id: id.to_owned(), parameters: vec![(name.to_owned(), there)] };
        let spiked = spiking.put_in(&[spike]).unwrap();
        let changed = spiked.changes.force_n.unwrap();
        assert!((5.0..20.0).contains(&changed), "{id}: {changed}");
        let answer = spiking.diagnose(&spiked.bundle).unwrap();
        let why = || format!("{} {:?}", answer.sentence(), answer.remarks);
        assert_eq!(names(&answer), [id], "{}", why());
        let found = value(&answer.effects[0], name);
        assert!((found / there - 1.0).abs() < 0.05, "{id}: {found} for {there}");
    }
}

#[test]
fn an_effect_put_into_real_data_is_found() {
    let Some(path) = measured() else { return };
    let mut bundle = Bundle::open(path).unwrap();
    // More viscous friction, by differences of the recorded position.
    const ADDED_N_S_PER_M: f64 = 150.0;
    for trial in &mut bundle.trials {
        let t_s = trial.t_s.clone();
        let data = columns(trial);
        let reach = 10;
        for i in reach..t_s.len() - reach {
            let speed = (data.position[i + reach] - data.position[i - reach])
                / (t_s[i + reach] - t_s[i - reach]);
            data.command[i] += ADDED_N_S_PER_M * speed;
        }
    }
    let drive = Drive::new(&bundle).unwrap();
    let validated: [(&str, &[f64]); 3] = [
        ("drive.coulomb", &[COULOMB_N]),
        ("drive.viscous", &[VISCOUS_N_S_PER_M]),
        ("drive.offset", &[OFFSET_N]),
    ];
    let answer =
        diagnose(&Altered::assuming(&drive, &validated), "spike", &cathforce_gap::unwatched);
    assert_eq!(names(&answer)[0], "drive.viscous", "{}", answer.sentence());
    let found = value(&answer.effects[0], "n_s_per_m") - VISCOUS_N_S_PER_M;
    assert!((found / ADDED_N_S_PER_M - 1.0).abs() < 0.1, "{found}");
}

#[test]
fn a_poor_encoder_still_tells_the_documented_frictions() {
    const STEP_M: f64 = 1e-4;
    let Some(path) = measured() else { return };
    let mut bundle = Bundle::open(path).unwrap();
    read_in_steps(&mut bundle, STEP_M);
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "poor", &cathforce_gap::unwatched);
    for (id, name, documented) in
        [("drive.coulomb", "force_n", COULOMB_N), ("drive.viscous", "n_s_per_m", VISCOUS_N_S_PER_M)]
    {
        let own = answer.effects.iter().find(|effect| effect.id == id);
        let own = &own.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())).parameters[name];
        assert!((own.low..=own.high).contains(&documented), "{id}: {own:?}");
    }
}
