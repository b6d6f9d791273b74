//! Transmissions that are made: their truth is found, and nothing is that is not there.

mod made;

use cathforce_gap::diagnose;
use cathforce_gap::report::{Diagnosis, Verdict};
use cathforce_gap::transmission::{Compensation, CompensationError};

use made::{Lost, Made, Sensors};

fn answer(made: &Made, sensors: Sensors) -> Diagnosis {
    diagnose(&made.plant(sensors, 7), "made", &cathforce_gap::unwatched)
}

fn named(answer: &Diagnosis) -> Vec<&str> {
    let mut ids: Vec<&str> = answer.effects.iter().map(|own| own.id.as_str()).collect();
    ids.sort_unstable();
    ids
}

/// Named alone or beside what it cannot be told from, within its interval.
#[track_caller]
fn assert_found(made: &Made) {
    for sensors in [Sensors::Fine, Sensors::TwelveBit] {
        let answer = answer(made, sensors);
        let mut truth: Vec<&str> = made.truth().iter().map(|(id, ..)| *id).collect();
        truth.sort_unstable();
        assert_eq!(answer.verdict, Verdict::Named, "{sensors:?}: {}", answer.sentence);
        assert_eq!(named(&answer), truth, "{sensors:?}: {}", answer.sentence);
        for (id, parameter, value) in made.truth() {
            let effect = answer.effects.iter().find(|own| own.id == id).unwrap();
            let own = &effect.parameters[parameter];
            // Nine of ten intervals hold the truth; twice their width, all but one in a thousand.
            let wide = own.high - own.low;
            assert!(
                (own.low - 0.5 * wide..=own.high + 0.5 * wide).contains(&value),
                "{sensors:?} {id}.{parameter}: {value} in {own:?}"
            );
            assert!((own.value / value - 1.0).abs() < 0.15, "{sensors:?} {id}: {value} in {own:?}");
        }
    }
}

#[test]
fn a_wrong_gain_is_found() {
    assert_found(&Made { off: 0.05, ..Made::plain() });
}

#[test]
fn a_dead_zone_is_found() {
    assert_found(&Made { lost: Lost::DeadZone(0.03, 0.0), ..Made::plain() });
}

#[test]
fn a_dead_zone_that_lets_some_through_is_found_beside_a_gain() {
    assert_found(&Made { lost: Lost::DeadZone(0.05, 0.4), off: 0.06, ..Made::plain() });
}

#[test]
fn hysteresis_of_bouc_and_wen_is_found() {
    assert_found(&Made { lost: Lost::BoucWen(0.02, 0.03), ..Made::plain() });
}

#[test]
fn hysteresis_of_prandtl_and_ishlinskii_is_found() {
    assert_found(&Made { lost: Lost::PrandtlIshlinskii(0.03, 0.1), ..Made::plain() });
}

#[test]
fn friction_along_a_sheath_is_found() {
    assert_found(&Made { lost: Lost::Sheath(0.15), ..Made::plain() });
}

#[test]
fn a_compliance_under_a_load_is_found() {
    assert_found(&Made { compliance: 0.03, ..Made::plain() });
}

#[test]
fn a_lag_is_found() {
    assert_found(&Made { lag_s: 0.06, ..Made::plain() });
}

#[test]
fn where_nothing_is_the_matter_nothing_is_named() {
    for sensors in [Sensors::Fine, Sensors::TwelveBit] {
        let answer = answer(&Made::plain(), sensors);
        assert_eq!(answer.verdict, Verdict::NoGap, "{sensors:?}: {}", answer.sentence);
        assert!(answer.effects.is_empty());
    }
}

/// The inverse that is written makes the model's output the desired one, and on the made transmission far better than
/// the stated gain.
#[test]
fn the_inverse_of_what_was_found_gives_the_desired_output() {
    for lost in [
        Lost::DeadZone(0.05, 0.0),
        Lost::DeadZone(0.05, 0.4),
        Lost::BoucWen(0.02, 0.03),
        Lost::PrandtlIshlinskii(0.03, 0.1),
        Lost::Sheath(0.15),
    ] {
        let made = Made { lost, off: 0.05, ..Made::plain() };
        let plant = made.plant(Sensors::Fine, 7);
        let answer = diagnose(&plant, "made", &cathforce_gap::unwatched);
        let own = Compensation::of(&plant, &answer.values(&plant), 201, None).unwrap();
        let range = own.range()[1] - own.range()[0];
        assert!(own.by_memory.largest < 1e-6 * range, "{lost:?}: {:?}", own.by_memory);
        // Right after a reversal a table is not exact: hysteresis turns round over a length of its own.
        let share = if matches!(lost, Lost::DeadZone(..)) { 0.25 } else { 1.0 };
        assert!(
            own.by_table.rms < share * own.by_gain.rms,
            "{lost:?}: {:?} {:?}",
            own.by_table,
            own.by_gain
        );
        for pair in own.rows.windows(2) {
            assert!(
                pair[0].rising <= pair[1].rising && pair[0].falling <= pair[1].falling,
                "{lost:?}"
            );
        }
        // Played on what was made, and not on the model.
        let [low, high] = own.range();
        let at = |k: u32| {
            0.5 * (low + high)
                + 0.4
                    * (high - low)
                    * (1.0 - 0.5 * f64::from(k) / 4000.0)
                    * (0.008 * f64::from(k)).sin()
        };
        let desired: Vec<f64> = (0..4000).map(at).collect();
        let inputs = own.along(&desired).unwrap();
        let off = made
            .play(&inputs)
            .iter()
            .zip(&desired)
            .skip(1000)
            .fold(0.0, |most: f64, (out, wanted)| most.max((out - wanted).abs()));
        assert!(off < 1e-2 * range, "{lost:?}: {off} of {range}");
        let beyond = own.along(&[0.0, 10.0 * range]).unwrap_err();
        assert!(matches!(beyond, CompensationError::OutOfReach { row: 2, .. }), "{beyond}");
    }
}

/// A gain of the other sign, and degrees in the place of radians, are said and nothing is named.
#[test]
fn a_wrong_sign_and_wrong_units_are_said() {
    for (factor, words) in [(-1.0, "runs against the input"), (57.29578, "57.3 times as far")] {
        let made = Made { off: factor - 1.0, ..Made::plain() };
        let answer = answer(&made, Sensors::Fine);
        assert_eq!(answer.verdict, Verdict::Unknown, "{}", answer.sentence);
        assert!(answer.sentence.contains(words), "{}", answer.sentence);
        assert!(answer.effects.is_empty());
    }
}
