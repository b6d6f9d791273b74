//! One insertion that every model plays: ours, the reference, and each peer.
//!
//! A rod of 150 mm and 0.35 g with 50 nodes is fed at 13 mm/s into a tube of silicone that
//! narrows from 5 to 3 mm in radius and bends by 60°.

mod ours;
mod peers;
mod reference;
mod score;

use std::f64::consts::{FRAC_PI_3, PI};

use cathforce_bundle::SolverDefaults;
use cathforce_bundle::geometry::{Branch, Station};
use cathforce_mechanics::{
    Description, Effects, Entry, Instrument, Real, Section, Solver, Tendon, Wall,
};
use nalgebra::Vector3;
use serde::Serialize;

pub use ours::play;
pub use peers::{Peer, measure as play_in_peers};
pub use reference::reference;
pub use score::{Score, Series};

/// A tube: straight along x, an arc towards y, straight again.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Tube {
    pub straight_m: f64,
    pub bend_radius_m: f64,
    pub bend_angle_rad: f64,
    /// Length along the centre line, over which the radius changes linearly.
    pub length_m: f64,
    pub first_radius_m: f64,
    pub last_radius_m: f64,
}

/// The insertion, as the peers' scripts read it too.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Insertion {
    pub length_m: f64,
    pub nodes: u16,
    pub radius_m: f64,
    pub mass_kg: f64,
    pub youngs_modulus_pa: f64,
    pub poissons_ratio: f64,
    pub gravity_m_per_s2: [f64; 3],
    pub friction_coefficient: f64,
    /// Normal force per indentation and length; the wall yields by micrometres.
    pub wall_stiffness_n_per_m2: f64,
    pub start_m: f64,
    pub end_m: f64,
    pub speed_m_per_s: f64,
    /// Time between two samples of a model's force.
    pub sample_s: f64,
    pub tube: Tube,
}

/// The insertion of the benchmarks (docs/reference/benchmarks.md).
pub const INSERTION: Insertion = Insertion {
    length_m: 0.150,
    nodes: 50,
    radius_m: 0.825e-3,
    mass_kg: 0.35e-3,
    youngs_modulus_pa: 50e6,
    poissons_ratio: 0.4,
    gravity_m_per_s2: [0.0, 0.0, -9.81],
    friction_coefficient: 0.3,
    wall_stiffness_n_per_m2: 8e5,
    start_m: 0.020,
    end_m: 0.150,
    speed_m_per_s: 0.013,
    sample_s: 1e-3,
    tube: Tube {
        straight_m: 0.030,
        bend_radius_m: 0.040,
        bend_angle_rad: FRAC_PI_3,
        length_m: 0.160,
        first_radius_m: 5e-3,
        last_radius_m: 3e-3,
    },
};

impl Tube {
    /// Centre \[m\] at an arc length.
    fn centre_m(&self, s_m: f64) -> Vector3<f64> {
        let bend = self.bend_radius_m;
        let (sin, cos) = self.bend_angle_rad.sin_cos();
        let turned = (s_m - self.straight_m) / bend;
        if turned <= 0.0 {
            Vector3::new(s_m, 0.0, 0.0)
        } else if turned <= self.bend_angle_rad {
            let (sin, cos) = turned.sin_cos();
            Vector3::new(self.straight_m + bend * sin, bend * (1.0 - cos), 0.0)
        } else {
            let past = bend * (turned - self.bend_angle_rad);
            let x = self.straight_m + bend * sin + past * cos;
            Vector3::new(x, bend * (1.0 - cos) + past * sin, 0.0)
        }
    }

    /// Radius of the lumen at an arc length \[m\].
    fn radius_m(&self, s_m: f64) -> f64 {
        let share = s_m / self.length_m;
        self.first_radius_m + (self.last_radius_m - self.first_radius_m) * share
    }

    /// Stations half a millimetre apart.
    pub fn branch(&self) -> Branch {
        const STATION_M: f64 = 0.5e-3;
        let count = (self.length_m / STATION_M).round() as usize;
        let stations = (0..=count).map(|k| {
            let s_m = self.length_m * k as f64 / count as f64;
            Station { s_m, position_m: self.centre_m(s_m), radius_m: self.radius_m(s_m) }
        });
        Branch { name: "tube".into(), stations: stations.collect() }
    }
}

impl Insertion {
    /// Length between nodes \[m\].
    pub fn spacing_m(&self) -> f64 {
        self.length_m / f64::from(self.nodes - 1)
    }

    /// Length of a link of our shaft at which the same number of links has the same reach \[m\].
    pub fn link_length_m(&self) -> f64 {
        SolverDefaults::default().link_length_over(self.length_m, f64::from(self.nodes - 1))
    }

    /// Ticks from the first to the last sample.
    pub fn samples(&self) -> usize {
        ((self.end_m - self.start_m) / self.speed_m_per_s / self.sample_s).round() as usize
    }

    /// Insertion at a sample \[m\]; sample 0 is the start.
    pub fn at_m(&self, sample: usize) -> f64 {
        self.start_m + self.speed_m_per_s * self.sample_s * sample as f64
    }

    /// The same for the model, with links of `link_length_m`.
    pub fn description<T: Real>(&self, link_length_m: f64) -> Description<T> {
        let lit = T::lit;
        let area_m2 = PI * self.radius_m.powi(2);
        let second_moment_m4 = 0.25 * PI * self.radius_m.powi(4);
        let shear_pa = self.youngs_modulus_pa / (2.0 * (1.0 + self.poissons_ratio));
        let section = Section {
            length_m: lit(1.0),
            bending_stiffness_n_m2: lit(self.youngs_modulus_pa * second_moment_m4),
            torsional_stiffness_n_m2: lit(shear_pa * 2.0 * second_moment_m4),
            axial_stiffness_n: lit(self.youngs_modulus_pa * area_m2),
            mass_kg_per_m: lit(self.mass_kg / self.length_m),
        };
        let defaults = SolverDefaults::default();
        Description {
            instrument: Instrument {
                outer_radius_m: lit(self.radius_m),
                sections: [section].into_iter().collect(),
                precurve: [].into_iter().collect(),
            },
            guidewire: None,
            tendon: Tendon::none(),
            tendons: [].into_iter().collect(),
            entry: Entry {
                position_m: [0.0; 3].map(lit),
                direction: [1.0, 0.0, 0.0].map(lit),
                up: [0.0, 1.0, 0.0].map(lit),
            },
            wall: Wall {
                line_stiffness_n_per_m2: lit(self.wall_stiffness_n_per_m2),
                end_stiffness_n_per_m: lit(0.5 * self.wall_stiffness_n_per_m2 * self.spacing_m()),
                tangential_ratio: lit(defaults.tangential_ratio),
                friction_coefficient: lit(self.friction_coefficient),
                onset_m: lit(defaults.onset_m),
                damping_s: lit(defaults.wall_damping_s),
            },
            gravity_m_per_s2: self.gravity_m_per_s2.map(lit),
            solver: Solver {
                link_length_m: lit(link_length_m),
                fine_tip_m: lit(defaults.fine_tip_m(link_length_m)),
                tick_s: lit(self.sample_s),
                substeps: defaults.substeps,
                solves: defaults.solves,
                predictor_gain: lit(defaults.predictor_gain),
                bending_damping_s: lit(defaults.bending_damping_s),
                drag: defaults.drag(),
            },
            effects: Effects::off(),
        }
    }
}
