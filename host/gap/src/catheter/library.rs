//! The catalogue of effects as candidates for one rig.

use std::f64::consts::{FRAC_PI_2, TAU};

use cathforce_effect_catalogue::{Effect as Entry, Plant, Role, all};
use cathforce_mechanics::Description;

use crate::plant::{Along, Effect, Impostor, Nuisance, Parameter, Point, Swing};
use crate::signal::wrapped;

/// Places at which an effect with a place starts are so far from each other \[m\]: from farther off
/// than half of this, a narrowing does not find where it is …
const APART_M: f64 = 5e-3;
/// … or farther, if there would be more of them than this.
const MOST_PLACES: usize = 40;
/// Steps along what is inside when a trial begins \[m\].
const INSIDE_STEP_M: f64 = 1e-3;
/// Of its starting values, those that are tried at every place.
const STARTS_AT_PLACES: usize = 1;

/// Slow breath to the overtones of a fast pulse \[Hz\].
const BREATHING_AND_PULSE_HZ: [f64; 2] = [0.15, 4.0];
/// A wall that moves more slowly than any breath stands elsewhere: that is its registration \[Hz\].
const SLOWEST_BREATH_HZ: f64 = 0.1;
/// Warm blood makes an instrument no stiffer \[1\], and softens none sooner \[s\]: one that is
/// stiffer or softer from the beginning has another stiffness.
const LEAST_SOFTENING: f64 = 0.0;
const SOONEST_SOFTENING_S: f64 = 1.0;
/// What a fit takes for the least of a setting, where a device takes less.
const LEAST: [(&str, f64); 3] = [
    ("effects.wall.motion.frequency_hz", SLOWEST_BREATH_HZ),
    ("effects.instrument.softening.share", LEAST_SOFTENING),
    ("effects.instrument.softening.time_s", SOONEST_SOFTENING_S),
];
/// Turns of large rollers to teeth of small ones, 30 to 2.5 mm apart \[1/m\].
const ROLLERS_PER_M: [f64; 2] = [33.0, 400.0];

/// Candidates and the settings that their parameters are.
pub struct Library {
    pub effects: Vec<Effect>,
    /// Keys of settings, by effect and parameter.
    pub keys: Vec<Vec<&'static str>>,
}

impl Library {
    /// Every effect of the catalogue that this rig can have. `tips_m`: where tips go,
    /// from the beginning of a trial on.
    pub fn of(nominal: &Description<f64>, tips_m: &[[f64; 3]]) -> Self {
        let places_m = places(nominal.entry.position_m, tips_m);
        let has_tendon = nominal.tendon.stiffness_n_per_m > 0.0 || !nominal.tendons.is_empty();
        let possible = |entry: &&Entry| {
            entry.plant == Plant::Catheter && (has_tendon || !entry.id.starts_with("tendon."))
        };
        let mut library = Self { effects: Vec::new(), keys: Vec::new() };
        for entry in all().filter(possible) {
            library.effects.push(effect(entry, nominal, &places_m));
            library.keys.push(fitted(entry).map(|p| p.key).collect());
        }
        library
    }

    /// The description with the effects of a point; `None` when a value is refused.
    pub fn describe(&self, nominal: &Description<f64>, point: &Point) -> Option<Description<f64>> {
        let mut description = nominal.clone();
        for ((effect, keys), values) in self.effects.iter().zip(&self.keys).zip(&point.effects) {
            let parameters = effect.parameters.iter().zip(keys);
            // What is off stays as the rig states it, to the last bit.
            let off = effect.parameters.iter().zip(values).all(|(p, value)| p.off == *value);
            if off {
                continue;
            }
            for ((_, key), value) in parameters.zip(values) {
                description.set_parameter(key, *value).ok()?;
            }
        }
        Some(description)
    }

    /// How an effect swings: a breathing wall is a registration that does, a rippling feed an
    /// insertion offset.
    pub fn swing(&self, effect: usize, nuisances: &[Nuisance]) -> Option<Swing> {
        let at = |name: &str| nuisances.iter().position(|nuisance| nuisance.name == name);
        match self.effects.get(effect)?.id {
            "wall.motion" => Some(Swing {
                nuisances: ["x", "y", "z"]
                    .iter()
                    .map(|axis| at(&format!("registration {axis}")))
                    .collect::<Option<_>>()?,
                along: Along::Time,
                cycles: BREATHING_AND_PULSE_HZ,
                own_phase: Some(4),
                parameters: |amplitudes, cycles, phase| {
                    amplitudes.iter().copied().chain([cycles, phase]).collect()
                },
            }),
            // docs/explanation/model.md (34): δ = ∫ a sin(2πns + φ) ds = −(a/2πn) cos(2πns + φ).
            "drive.ripple" => Some(Swing {
                nuisances: vec![at("insertion offset")?],
                along: Along::Feed,
                cycles: ROLLERS_PER_M,
                own_phase: None,
                parameters: |amplitudes, cycles, phase| {
                    let ratio = amplitudes[0] * TAU * cycles;
                    let sign = ratio.signum();
                    vec![ratio.abs(), cycles, wrapped(phase + sign * FRAC_PI_2)]
                },
            }),
            _ => None,
        }
    }

    /// What an effect may be mistaken for: a zero that drifts goes with the time, a cable with the
    /// feed.
    pub fn impostor(&self, effect: usize, nuisances: &[Nuisance]) -> Option<Impostor> {
        let at = |axis| {
            let name = format!("force bias {axis}");
            nuisances.iter().position(|nuisance| nuisance.name == name)
        };
        (self.effects.get(effect)?.id == "sensor.drift").then_some(())?;
        Some(Impostor {
            nuisances: ["x", "y", "z"].into_iter().map(at).collect::<Option<_>>()?,
            along: Along::Feed,
            what: "a force at the sensor that grows with the length fed, as that of a cable which \
                   is drawn along",
        })
    }
}

fn fitted(
    entry: &'static Entry,
) -> impl Iterator<Item = &'static cathforce_effect_catalogue::Parameter> {
    entry.parameters.iter().filter(|parameter| parameter.is_fitted())
}

fn effect(entry: &'static Entry, nominal: &Description<f64>, places_m: &[[f64; 3]]) -> Effect {
    let middle = places_m.get(places_m.len() / 2).copied().unwrap_or_default();
    let mut place = middle.into_iter();
    let parameter = |p: &'static cathforce_effect_catalogue::Parameter| {
        let info = p.info();
        let off = p.off(nominal).unwrap_or_default();
        // A place that nothing is at may be anywhere: the middle of the instrument's way.
        let off = if p.role == Role::Place { place.next().unwrap_or(off) } else { off };
        let least = LEAST.iter().find(|(key, _)| *key == p.key).map(|(_, least)| *least);
        Parameter {
            name: p.name,
            unit: info.unit,
            low: least.unwrap_or(info.min),
            high: info.max,
            off,
            scale: p.prior_scale,
        }
    };
    let parameters: Vec<Parameter> = fitted(entry).map(parameter).collect();
    let has_place = fitted(entry).any(|p| p.role == Role::Place);
    let values = |start: &[f64], at: [f64; 3]| -> Vec<f64> {
        let (mut start, mut at) = (start.iter(), at.into_iter());
        let value =
            |(p, own): (&'static cathforce_effect_catalogue::Parameter, &Parameter)| match p.role {
                Role::Place => at.next().unwrap_or(own.off),
                Role::TimesNominal => own.off * start.next().copied().unwrap_or(1.0),
                Role::Value => start.next().copied().unwrap_or(own.off),
                Role::Held => own.off,
            };
        fitted(entry).zip(&parameters).map(value).collect()
    };
    let starts = entry.starts();
    let starts = if has_place {
        let places = places_m.iter().copied();
        places
            .flat_map(|at| starts.iter().take(STARTS_AT_PLACES).map(move |s| (s, at)))
            .map(|(start, at)| values(start, at))
            .collect()
    } else {
        starts.iter().map(|start| values(start, middle)).collect()
    };
    Effect { id: entry.id, what: entry.doc, parameters, starts, confused_with: entry.confused_with }
}

/// Where the instrument comes by: from the entry to where the first trial begins, and wherever tips
/// go.
fn places(entry_m: [f64; 3], tips_m: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let square =
        |a: &[f64; 3], b: &[f64; 3]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
    let Some(first) = tips_m.first() else { return Vec::new() };
    let steps = (square(&entry_m, first).sqrt() / INSIDE_STEP_M).ceil().max(1.0);
    let inside = (0..steps as usize).map(|k| {
        let share = k as f64 / steps;
        std::array::from_fn(|i| entry_m[i] + share * (first[i] - entry_m[i]))
    });
    let way: Vec<[f64; 3]> = inside.chain(tips_m.iter().copied()).collect();
    let mut apart_m = APART_M;
    loop {
        let mut places: Vec<[f64; 3]> = Vec::new();
        for at in &way {
            if places.iter().all(|place| square(place, at) >= apart_m * apart_m) {
                places.push(*at);
            }
        }
        if places.len() <= MOST_PLACES {
            return places;
        }
        apart_m *= 1.2;
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::catheter::plant::nominal;

    #[test]
    fn places_lie_along_the_whole_way_however_long_a_tip_stays() {
        let tip = |k: usize| [0.03 + 1e-4 * k.min(300) as f64, 0.0, 0.0];
        // It stays for ten times as long as it goes.
        let tips: Vec<[f64; 3]> = (0..3000).map(tip).collect();
        let found = places([0.0; 3], &tips);
        let along: Vec<f64> = found.iter().map(|place| place[0]).collect();
        assert!(along[0] == 0.0 && *along.last().unwrap() > 0.05, "{along:?}");
        assert!(
            along.windows(2).all(|pair| (pair[1] - pair[0] - APART_M).abs() < 1.1e-3),
            "{along:?}"
        );
        let far: Vec<[f64; 3]> = (0..3000).map(|k| [1e-3 * k as f64, 0.0, 0.0]).collect();
        let few = places([0.0; 3], &far);
        assert!((MOST_PLACES / 2..=MOST_PLACES).contains(&few.len()), "{}", few.len());
        assert!(places([0.0; 3], &[]).is_empty());
    }

    #[test]
    fn what_is_another_effect_by_another_name_is_no_candidate() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let bundle = cathforce_bundle::Bundle::open(&example).unwrap();
        let library = Library::of(&nominal(&bundle).unwrap(), &[]);
        for (key, least) in LEAST {
            let (id, name) = key.strip_prefix("effects.").unwrap().rsplit_once('.').unwrap();
            let effect = library.effects.iter().find(|effect| effect.id == id).unwrap();
            let index = effect.parameters.iter().position(|p| p.name == name).unwrap();
            assert_eq!(effect.parameters[index].low, least, "{key}");
            assert!(effect.starts.iter().all(|start| start[index] >= least), "{key}");
        }
    }

    #[test]
    fn a_rig_with_a_tendon_may_have_its_effects() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let mut own = nominal(&cathforce_bundle::Bundle::open(&example).unwrap()).unwrap();
        let of_tendon = |own: &Description<f64>| {
            let ids = Library::of(own, &[]).effects.into_iter().map(|effect| effect.id);
            ids.filter(|id| id.starts_with("tendon.")).collect::<Vec<_>>()
        };
        assert!(of_tendon(&own).is_empty());
        own.tendon.stiffness_n_per_m = 2000.0;
        assert_eq!(of_tendon(&own), ["tendon.friction", "tendon.slack"]);
    }
}
