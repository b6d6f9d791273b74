//! Making the cases of a set of strangers.

use cathforce_reference_solver::SolveError;
use nalgebra::Vector3;

use super::cases::{Stranger, strangers};
use super::draw::SEVERITIES;
use super::form::Form;
use super::rig::StrangeRig;
use super::set::Set;
use crate::blind_test::{BlindTest, BlindTestError, Made, write_json};
use crate::draw::Kind;
use crate::figures::SMALLEST_GAP;
use crate::label::{Label, Strangeness};
use crate::make::{name, salt_text};
use crate::nuisance::Nuisances;
use crate::play::Trial;
use crate::stand::{Stand, Unchanged, WALL_DOUBT_M};

/// Gaps over the floor that an effect should have on its own: less does not count, more needs no diagnosis.
const GAPS: [f64; 2] = [SMALLEST_GAP, 10.0];
/// How often a severity is adjusted to that.
const ADJUSTED: usize = 2;
/// An effect that grows from just seen to strong becomes about so many times as large.
const GROWS: f64 = 2.7;

/// One effect at a severity, and what it does on its own.
struct Played {
    severity: f64,
    form: Form,
    real: Vec<Trial>,
}

impl BlindTest {
    /// Makes `count` strangers of a set, all of one kind or of all kinds, or those of them that are not there yet. Seed,
    /// secret, `made` and what it gives are those of [`BlindTest::make`].
    pub fn make_strangers(
        &self,
        set: Set,
        only: Option<Kind>,
        seed: Option<u64>,
        count: usize,
        secret: u64,
        made: &(dyn Fn() + Sync),
    ) -> Result<Vec<(usize, SolveError)>, BlindTestError> {
        let rigs = vec![set.name().to_owned()];
        let plan = Made { cases: count, rigs, left_out: Vec::new(), is_whole: false };
        let begun = self.begin(seed, secret, &plan)?;
        let drawn = strangers(set, only, begun.seed, count);
        self.make_each(begun.salts, plan, made, |number, salt| {
            self.make_stranger(set, begun.seed, &drawn[number], salt)
        })
    }

    /// Plays and writes one case, or says why it cannot be played.
    fn make_stranger(
        &self,
        set: Set,
        seed: u64,
        case: &Stranger,
        salt: u128,
    ) -> Result<Result<(), SolveError>, BlindTestError> {
        let nuisances = Nuisances::spread(case.spread, !case.noise_seed, case.motions.len());
        let stand = case.stand();
        let play_all = || {
            let unchanged = case.unchanged()?;
            let effects = (0..case.effects.len())
                .filter_map(|effect| case.adjusted(effect, &stand, &unchanged).transpose());
            let effects: Vec<Played> = effects.collect::<Result<_, SolveError>>()?;
            let forms: Vec<Form> = effects.iter().map(|own| own.form.clone()).collect();
            let real = match &effects[..] {
                [] => unchanged.nominal.clone(),
                [alone] => alone.real.clone(),
                _ => case.play(&case.rig, &forms)?,
            };
            let mounted = case.play(&case.rig, &mounted(&nuisances, &forms))?;
            Ok((unchanged, effects, forms, real, nuisances.recorded(&mounted)))
        };
        let (unchanged, effects, forms, real, recorded) = match play_all() {
            Ok(played) => played,
            Err(error) => return Ok(Err(error)),
        };
        // Of two effects, the one that is left is the other one on its own.
        let without: Vec<&Vec<Trial>> = match &effects[..] {
            [one, other] => vec![&other.real, &one.real],
            _ => effects.iter().map(|_| &unchanged.nominal).collect(),
        };
        let name = name(case.number);
        let over_noise = |without: &Vec<_>| stand.gap_over_noise(&real, without);
        let over_floor = |without: &Vec<_>| stand.gap_over_floor(&real, without, &unchanged);
        let friction_coefficient = case.rig.stated.friction_coefficient;
        let label = Label {
            case: name.clone(),
            seed,
            kind: case.kind,
            rig: case.rig.real.name.clone(),
            effects: forms.iter().map(|form| form.truth(friction_coefficient)).collect(),
            severity: effects.first().map_or(case.severity, |own| own.severity),
            gap_over_noise: over_noise(&unchanged.nominal),
            added_over_noise: without.iter().copied().map(over_noise).collect(),
            gap_over_floor: Some(over_floor(&unchanged.nominal)),
            added_over_floor: without.iter().copied().map(over_floor).collect(),
            stranger: Some(Strangeness {
                set,
                severities: effects.iter().map(|own| own.severity).collect(),
                families: forms.iter().map(|form| form.family().to_owned()).collect(),
                forms: forms.iter().map(|form| format!("{form:?}")).collect(),
                rig: case.rig.truth.clone(),
                motion: case.motion,
                trials: case.motions.len(),
                nuisances: case.spread,
                sensors: case.electronics.clone(),
            }),
            salt: salt_text(salt),
        };
        let folder = self.bundle(&name);
        case.write(&folder, &format!("case-{name}"), &recorded)
            .map_err(|error| BlindTestError::File { path: folder, error })?;
        // The label comes last: what has one is whole.
        write_json(&self.label_path(&name), &label)?;
        Ok(Ok(()))
    }
}

/// Forms on a phantom that was mounted so. A registration that is an effect is all of it.
fn mounted(nuisances: &Nuisances, forms: &[Form]) -> Vec<Form> {
    let (offset_m, tilt_rad) = nuisances.mounting();
    let is_registered = |form: &Form| matches!(form, Form::BentPhantom { .. });
    let own = Form::BentPhantom { offset_m, tilt_rad, sag_per_m: Vector3::zeros() };
    let own = (!forms.iter().any(is_registered)).then_some(own);
    own.into_iter().chain(forms.iter().cloned()).collect()
}

impl Stranger {
    /// What measures its gaps.
    fn stand(&self) -> Stand {
        Stand {
            rig: self.rig.real.clone(),
            motions: self.motions.clone(),
            accuracy: self.electronics.accuracy(),
            given: None,
        }
    }

    /// What it does without any effect, with a wall that is nearer, and on the rig as it is stated.
    fn unchanged(&self) -> Result<Unchanged, SolveError> {
        let nominal = self.play(&self.rig, &[])?;
        let mut nearer = self.rig.clone();
        for station in nearer.real.branches.iter_mut().flatten() {
            station.radius_m -= WALL_DOUBT_M;
        }
        let mut doubts = vec![[nominal.clone(), self.play(&nearer, &[])?]];
        let StrangeRig { real, stated, .. } = &self.rig;
        if real.branches != stated.branches || real.blend_m != stated.blend_m {
            let as_stated = StrangeRig { real: stated.clone(), ..self.rig.clone() };
            doubts.push([nominal.clone(), self.play(&as_stated, &[])?]);
        }
        Ok(Unchanged { nominal, doubts })
    }

    /// Plays one of its effects on its own, at a severity at which its gap is in bounds, as far as there is
    /// one.
    fn adjusted(
        &self,
        effect: usize,
        stand: &Stand,
        unchanged: &Unchanged,
    ) -> Result<Option<Played>, SolveError> {
        let play = |severity: f64| {
            let Some(form) = self.form(effect, severity) else { return Ok(None) };
            let real = self.play(&self.rig, std::slice::from_ref(&form))?;
            Ok(Some(Played { severity, form, real }))
        };
        let Some(mut own) = play(self.severity)? else { return Ok(None) };
        for _ in 0..ADJUSTED {
            let gap = stand.gap_over_floor(&own.real, &unchanged.nominal, unchanged);
            if (GAPS[0]..=GAPS[1]).contains(&gap) {
                break;
            }
            // What an effect does beside the floor is about as large as it is itself.
            let size = |gap: f64| (gap * gap - 1.0).max(1e-4).sqrt();
            let more = (size(self.wanted) / size(gap)).ln() / GROWS.ln();
            let severity = (own.severity + more).clamp(SEVERITIES[0], SEVERITIES[1]);
            // Where the solver finds no balance any more, the last one stays.
            match play(severity) {
                Ok(Some(next)) if severity != own.severity => own = next,
                _ => break,
            }
        }
        Ok(Some(own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nuisance::Spread;

    #[test]
    fn a_phantom_that_is_registered_wrongly_is_not_mounted_a_second_time() {
        let nuisances = Nuisances::spread(Spread::Wide, 1, 1);
        let pull = Form::TipPull { force_n: Vector3::x() };
        assert_eq!(mounted(&nuisances, std::slice::from_ref(&pull)).len(), 2);
        let zero = Vector3::zeros();
        let wrong = Form::BentPhantom { offset_m: Vector3::x(), tilt_rad: zero, sag_per_m: zero };
        assert_eq!(mounted(&nuisances, &[pull.clone(), wrong.clone()]), [pull, wrong]);
    }
}
