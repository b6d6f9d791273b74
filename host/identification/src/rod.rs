//! Density, modulus, air drag, damping and tip mass of a catheter from releases of weights.

use cathforce_calibration::Parameter;
use cathforce_reference_solver::{Beyond, Drive, Problem, Section, Simulation, SolveError};
use rayon::prelude::*;

use crate::noise::feature_sd;
use crate::search::{Experiment, Measured};
use crate::weight_release::{Release, ReleaseError, ReleaseFeatures, Suspended, release_features};

/// The parameters of a catheter that a release excites.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodValues {
    pub density_kg_per_m3: f64,
    pub youngs_pa: f64,
    /// Force per length over the square of the speed \[kg/m²\].
    pub air_drag_kg_per_m2: f64,
    /// Kelvin–Voigt: bending moment per rate of curvature \[N·m²·s\].
    pub damping_n_m2_s: f64,
    pub tip_mass_kg: f64,
}

impl RodValues {
    /// Names in the order of [`RodValues::to_array`], with their units.
    pub const NAMES: [&'static str; 5] =
        ["density_kg_per_m3", "youngs_pa", "air_drag_kg_per_m2", "damping_n_m2_s", "tip_mass_kg"];

    /// In the order of their declaration.
    pub fn to_array(self) -> [f64; 5] {
        let Self { density_kg_per_m3, youngs_pa, air_drag_kg_per_m2, damping_n_m2_s, tip_mass_kg } =
            self;
        [density_kg_per_m3, youngs_pa, air_drag_kg_per_m2, damping_n_m2_s, tip_mass_kg]
    }

    /// From the same order.
    pub fn of_array(values: [f64; 5]) -> Self {
        let [density_kg_per_m3, youngs_pa, air_drag_kg_per_m2, damping_n_m2_s, tip_mass_kg] =
            values;
        Self { density_kg_per_m3, youngs_pa, air_drag_kg_per_m2, damping_n_m2_s, tip_mass_kg }
    }

    /// Parameters to search for between two sets of values, from their middle.
    pub fn parameters(low: Self, high: Self) -> Vec<Parameter> {
        let bounds = low.to_array().into_iter().zip(high.to_array());
        let named = Self::NAMES.into_iter().zip(bounds);
        named.map(|(name, (low, high))| Parameter::new(name, low, high)).collect()
    }

    /// The solid round rod of this diameter with these values, otherwise as in `problem`.
    pub fn problem(&self, diameter_m: f64, poisson: f64, problem: &Problem) -> Problem {
        let mut own = problem.clone();
        let section =
            Section::tube(1.0, diameter_m, 0.0, self.youngs_pa, poisson, self.density_kg_per_m3);
        own.beyond = Beyond {
            bending_viscosity_s: self.damping_n_m2_s / section.bending_n_m2,
            tip_mass_kg: self.tip_mass_kg,
            air_drag_kg_per_m2: self.air_drag_kg_per_m2,
            ..own.beyond
        };
        own.rod.sections = vec![section];
        own
    }
}

/// How one catheter is measured: the weights that are released from its tip.
#[derive(Clone, Debug)]
pub struct ReleaseSetup {
    /// Diameter of the round solid rod that bends like the catheter \[m\].
    pub diameter_m: f64,
    /// Poisson's ratio \[1\].
    pub poisson: f64,
    /// Free length \[m\].
    pub length_m: f64,
    pub weights_kg: Vec<f64>,
    /// From the release on \[s\].
    pub duration_s: f64,
    /// Between samples of the sensor \[s\].
    pub sample_s: f64,
}

impl ReleaseSetup {
    /// Records of one catheter, one for each weight, as a sensor without noise takes them.
    ///
    /// `problem` holds the surroundings and the numerics. Its step fits a whole number of times into
    /// `sample_s`. `rest`: of any catheter on that mesh.
    pub fn releases(
        &self,
        values: &RodValues,
        problem: &Problem,
        rest: &Simulation<'_>,
    ) -> Result<Vec<Release>, SolveError> {
        let own = values.problem(self.diameter_m, self.poisson, problem);
        let every = (self.sample_s / own.numerics.step_s).round() as usize;
        let record = |&weight_kg: &f64| {
            let suspended = Suspended { problem: &own, length_m: self.length_m, weight_kg };
            Ok(suspended.release_from(rest, self.duration_s)?.every(every))
        };
        self.weights_kg.par_iter().map(record).collect()
    }

    /// A catheter at rest without a weight, from which the others are computed.
    pub fn rest<'a>(&self, problem: &'a Problem) -> Result<Simulation<'a>, SolveError> {
        Simulation::settled(problem, Drive { insertion_m: self.length_m, rotation_rad: 0.0 })
    }
}

/// Releases, simulated on a coarse and on a fine mesh.
pub struct Releases<'a> {
    pub setup: &'a ReleaseSetup,
    /// Problem and rest on the coarse and on the fine mesh.
    pub coarse: (&'a Problem, &'a Simulation<'a>),
    pub fine: (&'a Problem, &'a Simulation<'a>),
}

impl Experiment for Releases<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        let values = RodValues::of_array(values.try_into().ok()?);
        let (problem, rest) = if fine { self.fine } else { self.coarse };
        let records = self.setup.releases(&values, problem, rest).ok()?;
        let features = records.iter().map(|own| release_features(&own.position_m, own.step_s));
        let features: Result<Vec<ReleaseFeatures>, _> = features.collect();
        Some(features.ok()?.into_iter().flat_map(ReleaseFeatures::to_array).collect())
    }
}

/// Features of measured releases, and what white noise of standard deviation `noise_m` makes of them.
///
/// Errors: the record that has no features, by its place among `records`.
pub fn measured_releases(
    records: &[Release],
    noise_m: f64,
    seed: u64,
) -> Result<Measured, (usize, ReleaseError)> {
    let mut measured = Measured::default();
    for (k, own) in records.iter().enumerate() {
        let features = |position_m: &[f64]| release_features(position_m, own.step_s);
        let found = features(&own.position_m).map_err(|error| (k, error))?;
        let noisy = |record: &[f64]| features(record).ok().map(ReleaseFeatures::to_array);
        let sd = feature_sd(&own.position_m, noise_m, seed, noisy);
        let sd = sd.ok_or((k, ReleaseError::NoSwing))?;
        measured.features.extend(found.to_array());
        measured.sd.extend(sd);
    }
    Ok(measured)
}
