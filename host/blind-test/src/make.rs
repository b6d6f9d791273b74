//! Making the cases of a blind test, and going on where that was broken off.

use std::collections::BTreeMap;

use cathforce_reference_solver::SolveError;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::blind_test::{BlindTest, BlindTestError, Made, create, read_json, write_json};
use crate::draw::{Case, cases};
use crate::label::Label;
use crate::nuisance::Nuisances;
use crate::stand::{Stand, Unchanged};

/// A blind test whose cases are to be made.
pub(crate) struct Begun {
    /// Seed of the cases.
    pub seed: u64,
    /// One a case.
    pub salts: Vec<u128>,
}

impl BlindTest {
    /// Makes `count` cases on these rigs, or those of them that are not there yet. Without a `seed` one
    /// is drawn, and stands in the labels alone: the labels follow from it. `secret`, of which seed and
    /// salts are drawn, must not be known to whoever diagnoses. `made` is told after every case.
    ///
    /// Gives the cases that are left out because the solver finds no balance, and why.
    pub fn make(
        &self,
        seed: Option<u64>,
        count: usize,
        secret: u64,
        stands: &[Stand],
        made: &(dyn Fn() + Sync),
    ) -> Result<Vec<(usize, SolveError)>, BlindTestError> {
        let rigs: Vec<String> = stands.iter().map(|stand| stand.rig.name.clone()).collect();
        if let Some(twice) = rigs.iter().enumerate().find(|(i, name)| rigs[..*i].contains(name)) {
            return Err(BlindTestError::OneName(twice.1.clone()));
        }
        let plan = Made { cases: count, rigs, left_out: Vec::new(), is_whole: false };
        let begun = self.begin(seed, secret, &plan)?;
        let drawn = cases(begun.seed, count, stands);
        let unchanged: BTreeMap<&str, Result<Unchanged, SolveError>> =
            stands.iter().map(|stand| (&*stand.rig.name, stand.unchanged())).collect();
        self.make_each(begun.salts, plan, made, |number, salt| {
            let case = &drawn[number];
            match &unchanged[&*case.stand.rig.name] {
                Ok(unchanged) => self.make_case(begun.seed, case, salt, unchanged),
                Err(error) => Ok(Err(*error)),
            }
        })
    }

    /// Begins a blind test, or goes on with one of the same plan: the folders and `made.json` are there
    /// afterwards.
    pub(crate) fn begin(
        &self,
        seed: Option<u64>,
        secret: u64,
        plan: &Made,
    ) -> Result<Begun, BlindTestError> {
        let mut rng = ChaCha8Rng::seed_from_u64(secret);
        let drawn_seed: u64 = rng.random();
        let there = self.seed_that_is_there(plan)?;
        let seed = match (seed, there) {
            (Some(asked), Some(there)) if asked != there => {
                return Err(BlindTestError::AlreadyMade(self.folder.clone()));
            }
            (asked, there) => there.or(asked).unwrap_or(drawn_seed),
        };
        create(&self.folder.join("labels"))?;
        create(&self.folder.join("cases"))?;
        write_json(&self.folder.join("made.json"), plan)?;
        Ok(Begun { seed, salts: (0..plan.cases).map(|_| rng.random()).collect() })
    }

    /// Makes every case that has no label yet by `make`, which is given its number and its salt, and says
    /// in `made.json` which are left out.
    pub(crate) fn make_each(
        &self,
        salts: Vec<u128>,
        plan: Made,
        made: &(dyn Fn() + Sync),
        make: impl Fn(usize, u128) -> Result<Result<(), SolveError>, BlindTestError> + Sync,
    ) -> Result<Vec<(usize, SolveError)>, BlindTestError> {
        let each = |(number, salt): (usize, &u128)| -> Result<_, BlindTestError> {
            let is_there = self.label_path(&name(number)).exists();
            let played = if is_there { Ok(()) } else { make(number, *salt)? };
            made();
            Ok(played.err().map(|error| (number, error)))
        };
        let left_out: Vec<_> = salts.par_iter().enumerate().map(each).collect::<Result<_, _>>()?;
        let left_out: Vec<_> = left_out.into_iter().flatten().collect();
        let numbers = left_out.iter().map(|(case, _)| *case).collect();
        let whole = Made { left_out: numbers, is_whole: true, ..plan };
        write_json(&self.folder.join("made.json"), &whole)?;
        Ok(left_out)
    }

    /// The seed of the cases that are there, which must be some of those that are planned.
    fn seed_that_is_there(&self, plan: &Made) -> Result<Option<u64>, BlindTestError> {
        let other = || BlindTestError::AlreadyMade(self.folder.clone());
        if self.folder.join("seals.json").exists() {
            return Err(other());
        }
        match self.made()? {
            Some(made) if made.cases != plan.cases || made.rigs != plan.rigs => return Err(other()),
            Some(_) => {}
            None if self.folder.join("cases").exists() || self.folder.join("labels").exists() => {
                return Err(other());
            }
            None => return Ok(None),
        }
        let labels = self.cases()?.into_iter().map(|case| self.label_path(&case));
        let first =
            labels.filter(|path| path.exists()).map(|path| read_json::<Label>(&path)).next();
        Ok(first.transpose()?.map(|label| label.seed))
    }

    /// Plays and writes one case, or says why it cannot be played.
    fn make_case(
        &self,
        seed: u64,
        case: &Case,
        salt: u128,
        unchanged: &Unchanged,
    ) -> Result<Result<(), SolveError>, BlindTestError> {
        let name = name(case.number);
        let stand = &case.stand;
        let nuisances = Nuisances::of_seed(!case.noise_seed, stand.motions.len());
        let play_all = || {
            let unchanged = unchanged.divided_as(stand)?;
            let real = stand.play(&case.changes)?;
            let mounted = stand.play(&nuisances.mounted(&case.changes))?;
            let without = |k: usize| {
                let others: Vec<_> = [&case.changes[..k], &case.changes[k + 1..]].concat();
                if others.is_empty() { Ok(unchanged.nominal.clone()) } else { stand.play(&others) }
            };
            let without = (0..case.changes.len()).map(without);
            let without = without.collect::<Result<Vec<_>, SolveError>>()?;
            Ok((real, nuisances.recorded(&mounted), without, unchanged))
        };
        let (real, recorded, without, unchanged) = match play_all() {
            Ok(played) => played,
            Err(error) => return Ok(Err(error)),
        };
        let over_noise = |without: &Vec<_>| stand.gap_over_noise(&real, without);
        let over_floor = |without: &Vec<_>| stand.gap_over_floor(&real, without, &unchanged);
        let label = Label {
            case: name.clone(),
            seed,
            kind: case.kind,
            rig: stand.rig.name.clone(),
            effects: case.changes.iter().map(|c| c.truth(stand.rig.friction_coefficient)).collect(),
            severity: case.severity,
            gap_over_noise: over_noise(&unchanged.nominal),
            added_over_noise: without.iter().map(over_noise).collect(),
            gap_over_floor: Some(over_floor(&unchanged.nominal)),
            added_over_floor: without.iter().map(over_floor).collect(),
            stranger: None,
            salt: salt_text(salt),
        };
        let folder = self.folder.join("cases").join(&name);
        stand
            .write(&folder, &format!("case-{name}"), &recorded, case.noise_seed)
            .map_err(|error| BlindTestError::File { path: folder, error })?;
        // The label comes last: what has one is whole.
        write_json(&self.label_path(&name), &label)?;
        Ok(Ok(()))
    }
}

/// The name of a case.
pub(crate) fn name(case: usize) -> String {
    format!("{case:03}")
}

/// A salt as labels state it.
pub(crate) fn salt_text(salt: u128) -> String {
    format!("{salt:032x}")
}
