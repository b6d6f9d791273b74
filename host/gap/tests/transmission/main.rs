//! Transmissions that are made: their truth is found, and nothing is that is not there.

mod made;

use cathforce_gap::diagnose;
use cathforce_gap::report::{Diagnosis, Verdict};

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
