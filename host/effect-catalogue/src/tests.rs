use std::collections::BTreeSet;

use cathforce_bundle::{Bundle, SolverDefaults, to_description};
use cathforce_mechanics::{EFFECTS, NOMINAL, SOLVER};

use cathforce_mechanics::parameters;

use super::*;

/// The identifiers that reports of a gap may use, as their format states them.
const IDENTIFIERS: &str = "\
    drive.ripple drive.slip drive.backlash drive.encoder_scale drive.latency \
    drive.coulomb drive.viscous drive.stribeck drive.load_friction drive.offset \
    drive.friction_drift \
    entry.drag entry.guide \
    contact.friction contact.stribeck contact.load_friction \
    wall.stiffness wall.hyperelastic wall.viscoelastic wall.motion \
    wall.registration wall.narrowing \
    instrument.stiffness instrument.stored_curvature instrument.tip_precurve \
    instrument.torsional_windup instrument.viscoelastic instrument.softening \
    instrument.weight tendon.friction tendon.slack fluid.drag \
    sensor.bias sensor.drift sensor.gain sensor.misalignment sensor.time_constant \
    transmission.gain transmission.curvature transmission.dead_zone transmission.bouc_wen \
    transmission.prandtl_ishlinskii transmission.sheath transmission.compliance transmission.lag \
    transmission.latency transmission.offset transmission.drift";

fn example() -> Bundle {
    Bundle::open(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none"))
        .expect("the example")
}

#[test]
fn every_identifier_is_there_once() {
    let listed: Vec<_> = all().map(|effect| effect.id).collect();
    let wanted: BTreeSet<_> = IDENTIFIERS.split_whitespace().collect();
    assert_eq!(listed.len(), wanted.len());
    assert_eq!(listed.into_iter().collect::<BTreeSet<_>>(), wanted);
    assert_eq!(Effect::find("wall.motion").map(|effect| effect.id), Some("wall.motion"));
}

#[test]
fn every_parameter_of_the_model_has_its_place_and_no_other_is_named() {
    let named: BTreeSet<_> = all().flat_map(|e| e.parameters).map(|p| p.key).collect();
    let physical = parameters().filter(|info| !SOLVER.contains(info));
    let declared: BTreeSet<_> = physical.map(|info| info.key).collect();
    assert_eq!(named, declared);
    for info in EFFECTS {
        let effect = Effect::find(info.id).expect("in the catalogue");
        for parameter in info.parameters {
            assert!(effect.parameters.iter().any(|p| p.key == parameter.key), "{}", parameter.key);
        }
    }
    assert!(NOMINAL.iter().all(|info| named.contains(info.key)));
}

#[test]
fn off_values_are_those_of_the_nominal_rig() {
    let nominal = to_description::<f64>(&example(), &SolverDefaults::default()).expect("trials");
    for parameter in all().filter(|e| e.plant == Plant::Catheter).flat_map(|e| e.parameters) {
        let off = parameter.off(&nominal).expect("a key of the description");
        assert_eq!(parameter.info().off.unwrap_or(off), off, "{}", parameter.key);
    }
}

#[test]
fn starts_and_priors_lie_within_what_is_accepted() {
    let mut nominal =
        to_description::<f64>(&example(), &SolverDefaults::default()).expect("trials");
    for effect in all().filter(|effect| effect.plant == Plant::Catheter) {
        let free = |p: &&Parameter| matches!(p.role, Role::Value | Role::TimesNominal);
        let fitted = effect.parameters.iter().filter(free).count();
        let scans = || effect.parameters.iter().filter(|p| !p.scan.is_empty());
        let fewest = if scans().count() == 0 { 3 } else { 1 };
        // Kelvin–Voigt and the standard linear solid have starts of their own.
        let forms = if effect.id == "instrument.viscoelastic" { 2 } else { 1 };
        assert!((fewest..=4 * forms).contains(&effect.start_values.len()), "{}", effect.id);
        let tried: usize = scans().map(|p| p.scan.len()).product();
        let starts = effect.starts();
        assert_eq!(starts.len(), effect.start_values.len() * tried, "{}", effect.id);
        for start in &starts {
            assert_eq!(start.len(), fitted, "{}: one value a fitted parameter", effect.id);
            let off = nominal.clone();
            let values = effect.start(&nominal, start);
            Effect::apply(&mut nominal, &values).expect("within the range");
            assert_ne!(nominal, off, "{} is switched on by {start:?}", effect.id);
            assert_eq!(nominal.validate(), Ok(()));
            nominal = off;
        }
        for parameter in effect.parameters {
            let info = parameter.info();
            let range = info.max - info.min;
            assert!(parameter.prior_scale > 0.0 && parameter.prior_scale <= range, "{info:?}");
        }
    }
}

#[test]
fn confusions_name_other_effects() {
    for effect in all() {
        for other in effect.confused_with {
            assert!(Effect::find(other).is_some() && *other != effect.id, "{other}");
        }
        assert!(!effect.channels.is_empty() && !effect.excited_by.is_empty());
        assert!(effect.doc.ends_with('.'));
    }
}
