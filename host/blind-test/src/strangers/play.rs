//! Simulates one trial of a stranger.

use std::cell::OnceCell;

use cathforce_reference_solver::{Problem, Schedule, Simulation, SolveError};
use nalgebra::Vector3;

use super::form::Form;
use super::moving::Moving;
use super::rig::StrangeRig;
use super::sensing::{Met, Sensing};
use super::standing::standing;
use super::train::Train;
use crate::motion::STEP_S;
use crate::play::{Row, Trial};
use crate::train::Load;
use crate::world::Moment;

/// Plays a motion on a rig with forms; `trial`: its number.
pub fn play(
    rig: &StrangeRig,
    forms: &[Form],
    schedule: &Schedule,
    trial: usize,
) -> Result<Trial, SolveError> {
    let rows = (schedule.end_s() / STEP_S).round() as usize;
    let parts = (STEP_S / rig.numerics.step_s).round() as usize;
    let standing = standing(rig, forms);
    let torsion_n_m2 = standing.rod.sections.last().map_or(1.0, |shaft| shaft.torsion_n_m2);
    let (mut moving, mut train) = (Moving::new(forms), Train::new(forms, schedule));
    let mut sensing = Sensing::new(forms, trial);
    // Each is made when its row comes, and stays where the simulation can see it.
    let problems: Vec<OnceCell<Problem>> =
        (0..if moving.is_moving() { rows + 1 } else { 0 }).map(|_| OnceCell::new()).collect();
    let first = match problems.first() {
        Some(place) => {
            let own = moving.at(&standing, &moment(schedule, 0), STEP_S, Vector3::zeros());
            place.get_or_init(|| own)
        }
        None => &standing,
    };
    let mut simulation = Simulation::settled(first, train.drive())?;
    let start = train.drive();
    let mut trial = Vec::with_capacity(rows);
    for row in 1..=rows {
        if let Some(place) = problems.get(row) {
            let force_n = simulation.sample().force_on_vessel_n;
            let own = moving.at(&standing, &moment(schedule, row), STEP_S, force_n);
            simulation = simulation.released(place.get_or_init(|| own));
        }
        let before = train.drive();
        for part in 1..=parts {
            let t_s = STEP_S * (row - 1) as f64 + rig.numerics.step_s * part as f64;
            let felt = simulation.sample();
            let twist_rad_per_m = felt.drive_torque_n_m / torsion_n_m2;
            let load = Load { force_n: felt.drive_force_n, twist_rad_per_m };
            let drive = train.advance(schedule, t_s, load);
            simulation.step(rig.numerics.step_s, drive)?;
        }
        let (sample, drive) = (simulation.sample(), train.drive());
        let met = Met {
            t_s: STEP_S * row as f64,
            dt_s: STEP_S,
            fed_m: drive.insertion_m - start.insertion_m,
            feed_m: drive.insertion_m - before.insertion_m,
        };
        trial.push(Row {
            t_s: met.t_s,
            encoder: schedule.at(met.t_s),
            force_n: sensing.read(&met, sample.force_on_vessel_n),
            drive_force_n: sensing.behind(&met, sample.drive_force_n),
            tip_m: sample.tip_m,
            shape_m: Vec::new(),
        });
    }
    Ok(trial)
}

fn moment(schedule: &Schedule, row: usize) -> Moment {
    let t_s = STEP_S * row as f64;
    let (before, now) = (schedule.at(t_s - STEP_S), schedule.at(t_s));
    Moment {
        t_s,
        drive: now,
        feed_m_per_s: (now.insertion_m - before.insertion_m) / STEP_S,
        spin_rad_per_s: (now.rotation_rad - before.rotation_rad) / STEP_S,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::draw::form;
    use crate::strangers::families::{LIBRARY, OUTSIDE};
    use crate::strangers::instruments::Device;
    use crate::strangers::vessels::Vessel;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rayon::prelude::*;

    #[test]
    fn every_form_can_be_played_and_shows() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let rig = StrangeRig::draw((Vessel::DoubleBend, Device::GuidingCatheter), &mut rng);
        // Fed, turned, held and drawn back, for long enough that every drift has begun.
        let motion = Schedule::starting_at(0.055, 0.4).then(0.5, 0.05, 0.02, 0.0);
        let motion = motion.then(0.4, 0.05, 0.0, 2.0).then(0.2, 0.05, 0.0, 0.0);
        let motion = motion.then(0.4, 0.05, -0.02, -1.0);
        let nominal = play(&rig, &[], &motion, 0).unwrap();
        let families: Vec<&str> =
            LIBRARY.iter().chain(&OUTSIDE).flat_map(|(_, families)| *families).copied().collect();
        let apart = |a: &Row, b: &Row| {
            let force_n = (a.force_n - b.force_n).norm();
            let drive_n = (a.drive_force_n - b.drive_force_n).abs();
            // A tenth of a millimetre is worth a millinewton.
            force_n.max(drive_n).max(10.0 * (a.tip_m - b.tip_m).norm())
        };
        let changed = |family: &&str| {
            let played = play(&rig, &[form(family, 1.0, 3).unwrap()], &motion, 0).unwrap();
            assert_eq!(played.len(), nominal.len());
            let most = played.iter().zip(&nominal).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
            (most < 5e-4).then(|| format!("{family}: {most:.1e}"))
        };
        let unseen: Vec<String> = families.par_iter().filter_map(changed).collect();
        assert!(unseen.is_empty(), "{unseen:?}");
    }
}
