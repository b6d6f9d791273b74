//! The trials that are fitted.

use std::path::PathBuf;

use cathforce_bundle::bundle::Plant as RigPlant;
use cathforce_gap::calibrating::{Calibration, Case};
use cathforce_gap::catheter::{Catheter, Known, Wanted};
use cathforce_gap::plant::Plant as _;

use super::fit::Fit;
use crate::args::CalibrateArguments;
use crate::commands::gap::hash;
use crate::commands::gap::source::Source;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// Bundles and recordings, read once.
pub struct Data {
    sources: Vec<Source>,
    plants: std::cell::RefCell<Vec<Catheter>>,
    pub paths: Vec<PathBuf>,
}

impl Data {
    /// Opens everything and refuses what cannot be fitted together.
    pub fn open(ui: &Ui, arguments: &CalibrateArguments) -> Result<Self, Failure> {
        let (mut sources, mut plants) = (Vec::new(), Vec::new());
        for path in &arguments.sources {
            let source = Source::open(ui, path)?;
            if !matches!(source.bundle.rig.plant, RigPlant::Catheter(_)) {
                let message = format!(
                    "{}: it is no catheter, and its effects no device takes\n  fix: fit them with \
                     `cathforce gap diagnose {} --effect ID`",
                    path.display(),
                    path.display()
                );
                return Err(Failure::input(message));
            }
            plants.push(source.catheter()?);
            sources.push(source);
        }
        for (path, plant) in arguments.sources.iter().zip(&plants) {
            for remark in plant.remarks() {
                ui.say(format_args!("{}: {remark}", path.display()));
            }
        }
        let paths = arguments.sources.clone();
        let data = Self { sources, plants: plants.into(), paths };
        data.check_held_back(&arguments.hold_back)?;
        Ok(data)
    }

    fn check_held_back(&self, hold_back: &[u32]) -> Result<(), Failure> {
        let plants = self.plants.borrow();
        let numbers = || plants.iter().flat_map(|plant| plant.trials()).map(|trial| trial.number);
        let there = || numbers().map(|n| format!("{n:03}")).collect::<Vec<_>>().join(", ");
        if let Some(absent) = hold_back.iter().find(|own| numbers().all(|number| number != **own)) {
            let message = format!(
                "there is no trial {absent:03} that could be held back\n  fix: there are {}",
                there()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        if numbers().all(|number| hold_back.contains(&number)) {
            let message = "every trial is held back, so that nothing is left to fit\n  fix: hold fewer \
                           trials back";
            return Err(Failure::new(Code::Usage, message));
        }
        Ok(())
    }

    /// What the first rig says of a setting. All rigs must say the same, or a result would be another
    /// change for each.
    pub fn known(&self, key: &str) -> Result<Option<Known>, Failure> {
        let plants = self.plants.borrow();
        let Some(first) = plants.first().and_then(|plant| plant.known(key)) else {
            return Ok(None);
        };
        for (path, plant) in self.paths.iter().zip(plants.iter()) {
            let other = plant.known(key).map_or(f64::NAN, |known| known.nominal);
            if other != first.nominal {
                let message = format!(
                    "{key} is {} in {} and {other} in {}, so that one value cannot be fitted to both\n  \
                     fix: calibrate them apart, or state the same in both files rig.toml",
                    first.nominal,
                    self.paths[0].display(),
                    path.display()
                );
                return Err(Failure::input(message));
            }
        }
        Ok(Some(first))
    }

    /// Ready to be fitted; the plants go into it.
    pub fn calibration(
        &self,
        wanted: &[Fit],
        hold_back: &[u32],
    ) -> Result<Calibration<Catheter>, Failure> {
        let settings: Vec<Wanted> = wanted.iter().map(|own| own.wanted).collect();
        let mut cases = Vec::new();
        for (path, plant) in self.paths.iter().zip(self.plants.take()) {
            let case = Case::new(plant.fitting(&settings)).ok_or_else(|| {
                Failure::input(format!(
                    "{}: the nominal model breaks down on its trials\n  fix: {}",
                    path.display(),
                    cathforce_gap::plant::BROKEN_DOWN
                ))
            })?;
            cases.push(case);
        }
        let starts: Vec<f64> = wanted.iter().map(|own| own.start).collect();
        let numbers: Vec<Vec<u32>> = cases
            .iter()
            .map(|case| case.plant().trials().iter().map(|trial| trial.number).collect())
            .collect();
        Ok(Calibration::new(cases, &starts, |case, trial| {
            hold_back.contains(&numbers[case][trial])
        }))
    }

    /// What the residuals depend on besides the parameters.
    pub fn fingerprint(&self, hold_back: &[u32]) -> Result<String, Failure> {
        let hashes = self.sources.iter().map(Source::hash).collect::<Result<Vec<_>, _>>()?;
        Ok(format!("{} {} {hold_back:?}", hash::own_sha256()?, hashes.join(" ")))
    }

    /// The first source, whose rig settings are for.
    pub fn first(&self) -> &Source {
        &self.sources[0]
    }

    /// Names of all rigs.
    pub fn rigs(&self) -> Vec<&str> {
        self.sources.iter().map(|source| source.bundle.rig.name.as_str()).collect()
    }
}
