//! The catheter of the experiments: clamped at one end, and in air, in a chamber, or with a tendon.
//!
//! Every experiment takes its problem from here, be it of somebody's records or of published ones.

use cathforce_mechanics::{
    Description, Drag, DrivenTendon, Effects, Instrument, Section as MechanicsSection, Solver,
    Tendon, Wall,
};
use cathforce_reference_solver::{
    Beyond, Entry, Integrator, Lumen, Numerics, Problem, Rod, Section, TipLoad, TubePath, WallLaw,
};
use nalgebra::Vector3;

use crate::rod::RodValues;

/// Acceleration of gravity \[m/s²\].
const GRAVITY_M_PER_S2: f64 = 9.81;
/// Largest displacement of the tip by a force that is out of balance \[m\]: a thousandth of what sensors
/// of a tip tell.
const BALANCE_M: f64 = 1e-7;
/// Slack of a tendon in the catheter's rest, from which loops begin \[m\]: more than the catheter's sag
/// takes up, so that no tendon pulls there.
const SLACK_AT_REST_M: f64 = 1e-3;

/// How finely a catheter is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Edges of the rod, or links of the device's model.
    pub edges: usize,
    /// Time step, or tick \[s\].
    pub step_s: f64,
}

/// A catheter that is clamped at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClampedCatheter {
    /// Free length \[m\].
    pub length_m: f64,
    /// Of the surface that a wall touches \[m\].
    pub outer_radius_m: f64,
    /// Diameter of the solid round rod that bends like the catheter \[m\].
    pub bending_diameter_m: f64,
    /// Poisson's ratio \[1\].
    pub poisson: f64,
}

/// A straight round chamber along the catheter, through which fluid flows across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chamber {
    /// \[m\]
    pub radius_m: f64,
    /// How far upstream of the chamber's axis the catheter enters \[m\].
    pub off_axis_m: f64,
    pub fluid_density_kg_per_m3: f64,
}

/// Where a tendon bends the catheter to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bends {
    /// Against gravity.
    Up,
    /// Along it.
    Down,
    /// Across it.
    Sideways,
}

/// A tendon that runs to the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipTendon {
    /// From the centre line \[m\].
    pub offset_m: f64,
    /// Of its whole length \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Angle by which the shaft is bent between the drive and the clamp \[rad\].
    pub bend_behind_rad: f64,
    pub bends: Bends,
}

impl ClampedCatheter {
    fn section(&self, values: &RodValues) -> Section {
        Section::tube(
            1.0,
            self.bending_diameter_m,
            0.0,
            values.youngs_pa,
            self.poisson,
            values.density_kg_per_m3,
        )
    }

    /// In air, clamped along the horizontal x axis; z points up.
    pub fn in_air(&self, values: &RodValues, mesh: Mesh) -> Problem {
        let section = self.section(values);
        // A force F moves the tip by F L³/(3 E I).
        let stiffness_n_per_m = 3.0 * section.bending_n_m2 / self.length_m.powi(3);
        let air = Problem {
            rod: Rod { radius_m: self.outer_radius_m, sections: vec![section], curves: Vec::new() },
            entry: Entry {
                position_m: Vector3::zeros(),
                direction: Vector3::x(),
                up: Vector3::z(),
            },
            lumen: Lumen::open(),
            beyond: Beyond::default(),
            // Nothing is touched in air.
            wall: WallLaw {
                line_stiffness_n_per_m2: 8e5,
                end_stiffness_n_per_m: 2e3,
                tangential_ratio: 3.0,
                friction_coefficient: 0.0,
            },
            gravity_m_per_s2: Vector3::z() * -GRAVITY_M_PER_S2,
            drag_n_s_per_m2: 0.0,
            tip_load: TipLoad::default(),
            numerics: Numerics {
                spacing_m: self.length_m / mesh.edges as f64,
                step_s: mesh.step_s,
                // Between −0.5, which keeps energy, and 0, which damps what a step does not resolve.
                integrator: Integrator::BdfAlpha { alpha: -0.3 },
                tolerance_n: BALANCE_M * stiffness_n_per_m,
            },
        };
        values.problem(self.bending_diameter_m, self.poisson, &air)
    }

    /// In a chamber that is filled with fluid, hanging along the vertical x axis; y points along the flow,
    /// which carries the catheter from beside the axis towards the wall, where it is slower.
    pub fn in_chamber(&self, values: &RodValues, chamber: &Chamber, mesh: Mesh) -> Problem {
        let Chamber { radius_m, off_axis_m, fluid_density_kg_per_m3 } = *chamber;
        let mut own = self.in_air(values, mesh);
        // Longer at both ends than the catheter.
        let from = Vector3::new(-0.05, -off_axis_m, 0.0);
        let path = TubePath::from(from, Vector3::x(), radius_m)
            .straight(0.1 + 1.5 * self.length_m, radius_m);
        own.lumen = Lumen::tube(path.tube());
        let buoyant = 1.0 - fluid_density_kg_per_m3 / values.density_kg_per_m3;
        own.gravity_m_per_s2 = Vector3::x() * (GRAVITY_M_PER_S2 * buoyant);
        own
    }

    /// As the device's model has it, with one tendon. The tip's displacement is positive towards where the
    /// tendon bends it. The mass of the tip is left out.
    pub fn pulled(&self, values: &RodValues, tendon: &TipTendon, mesh: Mesh) -> Description<f64> {
        let own = self.section(values);
        let section = MechanicsSection {
            // Longer than any free length; the rest stays in the guide.
            length_m: 1.0,
            bending_stiffness_n_m2: own.bending_n_m2,
            torsional_stiffness_n_m2: own.torsion_n_m2,
            axial_stiffness_n: own.axial_n,
            mass_kg_per_m: own.mass_kg_per_m,
        };
        let driven = DrivenTendon {
            angle_rad: 0.0,
            offset_m: tendon.offset_m,
            anchor_m: 0.0,
            stiffness_n_per_m: tendon.stiffness_n_per_m,
            slack_m: SLACK_AT_REST_M,
            static_friction: 0.0,
            sliding_friction: 0.0,
            bend_behind_rad: tendon.bend_behind_rad,
        };
        Description {
            instrument: Instrument {
                outer_radius_m: self.outer_radius_m,
                sections: [section].into_iter().collect(),
                precurve: [].into_iter().collect(),
            },
            guidewire: None,
            tendon: Tendon::none(),
            tendons: [driven].into_iter().collect(),
            entry: cathforce_mechanics::Entry {
                position_m: [0.0; 3],
                direction: [1.0, 0.0, 0.0],
                up: [0.0, 0.0, 1.0],
            },
            // Nothing is touched.
            wall: Wall {
                line_stiffness_n_per_m2: 8e5,
                end_stiffness_n_per_m: 2e3,
                tangential_ratio: 3.0,
                friction_coefficient: 0.0,
                onset_m: 1e-5,
                damping_s: 0.0,
            },
            effects: Effects::off(),
            // The tendon bends towards z.
            gravity_m_per_s2: match tendon.bends {
                Bends::Up => [0.0, 0.0, -GRAVITY_M_PER_S2],
                Bends::Down => [0.0, 0.0, GRAVITY_M_PER_S2],
                Bends::Sideways => [0.0, GRAVITY_M_PER_S2, 0.0],
            },
            solver: Solver {
                link_length_m: self.length_m / mesh.edges as f64,
                fine_tip_m: 0.0,
                tick_s: mesh.step_s,
                substeps: 1,
                solves: 1,
                predictor_gain: 0.0,
                bending_damping_s: values.damping_n_m2_s / own.bending_n_m2,
                drag: Drag::constant(0.0),
            },
        }
    }
}
