//! What is told of an effect: its name, and a clause for each of its parameters that matters.

use std::collections::BTreeMap;

use super::clause::{Clause, DIGITS, Is, Words};
use super::{catheter, drive, transmission};
use crate::deciding::interval::Estimate;
use crate::fitting::progress::EffectSoFar;
use crate::rounding::shortest;

/// What is known of an effect; a drive's may have the name of a catheter's, with other parameters.
fn words(id: &str) -> impl Iterator<Item = &'static Words> {
    let all = catheter::WORDS.iter().chain(drive::WORDS).chain(transmission::WORDS);
    all.filter(move |own| own.id == id)
}

fn clauses(id: &str) -> impl Iterator<Item = &'static Clause> {
    words(id).flat_map(|own| own.clauses)
}

/// An effect as a noun; its identifier where it has no words.
pub fn name(id: &str) -> &str {
    words(id).next().map_or(id, |own| own.name)
}

/// An effect with its values, as one sentence. `what`: its description, in case it has no words.
pub fn values(id: &str, what: &str, parameters: &BTreeMap<String, Estimate>) -> String {
    let with = clauses(id).filter_map(|clause| Some((clause, parameters.get(clause.parameter)?)));
    let with: Vec<(&Clause, &Estimate)> = with.collect();
    let is_there = |own: &Estimate| own.low > own.off || own.high < own.off;
    let any = with.iter().any(|(clause, own)| clause.is == Is::Size && is_there(own));
    let told = with.iter().filter(|(clause, own)| clause.is == Is::Shape || !any || is_there(own));
    let clauses: Vec<String> = told.map(|(clause, own)| clause.told.with_interval(own)).collect();
    if clauses.is_empty() {
        return sentence(&format!("{id} – {}", what.trim_end_matches('.')));
    }
    sentence(&clauses.join("; "))
}

/// An effect with its values and without their intervals, as one sentence.
pub fn so_far(effect: &EffectSoFar) -> String {
    let value = |clause: &Clause| {
        let mut all = effect.values.iter();
        all.find(|(own, value)| own.name == clause.parameter && *value != own.off)
    };
    let sizes = clauses(effect.id).filter(|clause| clause.is == Is::Size);
    let told = sizes.filter_map(|clause| {
        let (own, value) = value(clause)?;
        Some(clause.told.alone(*value, own.unit))
    });
    match told.collect::<Vec<String>>() {
        told if told.is_empty() => {
            sentence(&format!("{} – {}", effect.id, effect.what.trim_end_matches('.')))
        }
        told => sentence(&told.join("; ")),
    }
}

/// A size of an effect, as a clause. `unit`: of the parameter.
pub fn size(id: &str, parameter: &str, value: f64, unit: &str) -> String {
    match clauses(id).find(|own| own.parameter == parameter) {
        Some(clause) => clause.told.alone(value, unit),
        None => format!("{} {} of {} {unit}", name(id), parameter, shortest(value, DIGITS)),
    }
}

fn sentence(text: &str) -> String {
    capitalised(text) + "."
}

/// With a capital letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map_or(String::new(), |own| own.to_uppercase().collect());
    first + letters.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Parameter;

    fn told(id: &str, parameters: &[(&str, [f64; 4], &'static str)]) -> String {
        let own = |(name, [value, low, high, off], unit): &(&str, [f64; 4], &'static str)| {
            let own = Estimate { value: *value, low: *low, high: *high, unit, off: *off };
            ((*name).to_owned(), own)
        };
        values(id, "what it is.", &parameters.iter().map(own).collect())
    }

    #[test]
    fn what_was_found_so_far_is_told_without_intervals() {
        let parameter =
            |name, off| Parameter { name, unit: "1", low: 0.0, high: 9.0, off, scale: 1.0 };
        let found = |id, values| so_far(&EffectSoFar { id, what: "What it is.", values });
        let factors =
            vec![(parameter("shaft_factor", 1.0), 1.42), (parameter("tip_factor", 1.0), 1.0)];
        assert_eq!(
            found("instrument.stiffness", factors),
            "The instrument's shaft is 42 % stiffer than rig.toml says."
        );
        let friction = vec![(parameter("friction_coefficient", 0.3), 0.46)];
        assert_eq!(found("contact.friction", friction), "The wall's friction coefficient is 0.46.");
        assert_eq!(found("unheard.of", Vec::new()), "Unheard.of – What it is.");
    }

    #[test]
    fn an_effect_is_told_as_a_person_would() {
        let friction = [("friction_coefficient", [0.46, 0.42, 0.5, 0.3], "1")];
        assert_eq!(
            told("contact.friction", &friction),
            "The wall's friction coefficient is 0.460 (0.420 to 0.500), not 0.30."
        );
        let scale = |ratio: [f64; 3]| {
            let [value, low, high] = ratio;
            told("drive.encoder_scale", &[("ratio", [value, low, high, 0.0], "1")])
        };
        assert_eq!(
            scale([0.02, 0.01, 0.03]),
            "The encoder counts 2.0 % (1.0 to 3.0) more than was travelled."
        );
        assert_eq!(
            scale([-0.02, -0.03, -0.015]),
            "The encoder counts 2.00 % (1.50 to 3.00) less than was travelled."
        );
        let stiffness = [
            ("shaft_factor", [1.42, 1.34, 1.5, 1.0], "1"),
            ("tip_factor", [6.5, 4.6, 8.4, 1.0], "1"),
        ];
        assert_eq!(
            told("instrument.stiffness", &stiffness),
            "The instrument's shaft is 42.0 % stiffer than rig.toml says (34.0 to 50.0 %); its tip is \
             6.5 times as stiff as rig.toml says (4.6 to 8.4)."
        );
        // What may as well be off is left out, unless nothing would be left.
        let backlash = [
            ("insertion_m", [8.2e-4, 7.5e-4, 8.9e-4, 0.0], "m"),
            ("rotation_rad", [0.0, 0.0, 0.01, 0.0], "rad"),
        ];
        assert_eq!(
            told("drive.backlash", &backlash),
            "The feed has a backlash of 0.820 mm (0.750 to 0.890)."
        );
        let nothing = [("insertion_m", [0.0, 0.0, 2e-4, 0.0], "m")];
        assert!(told("drive.backlash", &nothing).contains("backlash of 0.0"));
        assert_eq!(told("not.known", &[]), "Not.known – what it is.");
    }

    #[test]
    fn a_size_stands_without_an_interval() {
        assert_eq!(
            size("instrument.stiffness", "shaft_factor", 0.88, "1"),
            "the instrument's shaft is 12 % softer than rig.toml says"
        );
        assert_eq!(
            size("contact.friction", "friction_coefficient", 0.36, "1"),
            "the wall's friction coefficient is 0.36"
        );
        assert_eq!(size("not.known", "x", 2.0, "m"), "not.known x of 2 m");
    }

    #[test]
    fn every_effect_and_every_parameter_that_is_told_exists() {
        for effect in cathforce_effect_catalogue::all() {
            assert!(clauses(effect.id).count() > 0, "{} has no words", effect.id);
        }
        for own in catheter::WORDS {
            let known = cathforce_effect_catalogue::Effect::find(own.id).expect(own.id);
            for clause in own.clauses {
                let names = known.parameters.iter().any(|p| p.name == clause.parameter);
                assert!(names, "{}: {}", own.id, clause.parameter);
            }
        }
        for own in crate::drive::listed().into_iter().chain(crate::transmission::listed()) {
            let is_told = |p: &&Parameter| clauses(own.id).any(|c| c.parameter == p.name);
            assert!(own.parameters.iter().any(|p| is_told(&p)), "{}: nothing is told", own.id);
        }
    }
}
