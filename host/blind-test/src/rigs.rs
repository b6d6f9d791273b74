//! Two vessels, two instruments: four rigs.

use cathforce_reference_solver::{
    Curve, Entry, Integrator, Lumen, Numerics, Problem, Rod, Section, Station, TipLoad, Tube,
    TubePath, WallLaw,
};
use nalgebra::Vector3;

/// What a rig's file says of an instrument: one material, stiffer or softer towards the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Instrument {
    pub name: &'static str,
    pub outer_diameter_m: f64,
    pub inner_diameter_m: f64,
    pub density_kg_per_m3: f64,
    pub poissons_ratio: f64,
    /// Base, then tip: length \[m\] and Young's modulus \[Pa\].
    pub sections: [(f64, f64); 2],
    /// From the tip backwards: length \[m\] and curvature \[1/m\].
    pub precurve: Vec<(f64, f64)>,
    /// Wall of the phantom it is tried in, for a piece of [`CONTACT_SPACING_M`] \[N/m\].
    pub wall_stiffness_n_per_m: f64,
}

/// A nominal rig.
#[derive(Clone, Debug)]
pub struct Rig {
    pub name: String,
    pub instrument: Instrument,
    /// Centre line and radius of each branch of the vessel, the trunk first.
    pub branches: Vec<Vec<Station>>,
    /// Edges where branches meet are rounded over this \[m\].
    pub blend_m: f64,
    /// Of the instrument's pre-curve, seen along the direction of insertion.
    pub up: Vector3<f64>,
    pub friction_coefficient: f64,
    /// Length inside where every trial begins \[m\].
    pub start_m: f64,
}

/// Piece of instrument that the wall's stiffness is stated for.
pub const CONTACT_SPACING_M: f64 = 5e-3;
/// Tangential stiffness before slip, over the normal one.
pub const TANGENTIAL_RATIO: f64 = 3.0;
pub const GRAVITY_M_PER_S2: [f64; 3] = [0.0, 0.0, -9.81];
/// Drag of the surroundings, so that a free tip comes to rest within a second \[N·s/m²\].
const DRAG: f64 = 0.02;

/// All rigs.
pub fn rigs() -> Vec<Rig> {
    let vessels = [("bend", bend()), ("double-bend", double_bend())];
    let mut rigs = Vec::new();
    for (name, stations) in vessels {
        for instrument in [catheter(), wire()] {
            rigs.push(Rig {
                name: format!("{name}-{}", instrument.name),
                instrument,
                branches: vec![stations.clone()],
                blend_m: 0.0,
                up: Vector3::y(),
                friction_coefficient: 0.3,
                start_m: 0.03,
            });
        }
    }
    rigs
}

/// A braided 5 F catheter with a bent tip.
fn catheter() -> Instrument {
    Instrument {
        name: "catheter",
        outer_diameter_m: 1.65e-3,
        inner_diameter_m: 1.02e-3,
        density_kg_per_m3: 1100.0,
        poissons_ratio: 0.4,
        sections: [(0.60, 120e6), (0.05, 160e6)],
        precurve: vec![(4e-3, 10.0), (16e-3, 50.0)],
        wall_stiffness_n_per_m: 800.0,
    }
}

/// A 0.035 inch plastic wire with a soft, slightly bent end.
fn wire() -> Instrument {
    Instrument {
        name: "wire",
        outer_diameter_m: 0.89e-3,
        inner_diameter_m: 0.2e-3,
        density_kg_per_m3: 2200.0,
        poissons_ratio: 0.35,
        sections: [(0.62, 2.4e9), (0.03, 1.2e9)],
        precurve: vec![(3e-3, 5.0), (10e-3, 35.0)],
        wall_stiffness_n_per_m: 120.0,
    }
}

/// Tapers from 10 to 6 mm round a bend of 70°.
fn bend() -> Vec<Station> {
    let path = TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3)
        .straight(0.035, 5e-3)
        .arc(0.030, 70f64.to_radians(), Vector3::y(), 3.5e-3)
        .straight(0.06, 3e-3);
    path.tube().stations().to_vec()
}

/// Two bends in planes that are turned against each other, with a wide piece between them.
fn double_bend() -> Vec<Station> {
    let path = TubePath::from(Vector3::zeros(), Vector3::x(), 4.5e-3)
        .straight(0.025, 4.5e-3)
        .arc(0.028, 55f64.to_radians(), -Vector3::y(), 4.5e-3)
        .arc(0.035, 50f64.to_radians(), Vector3::new(0.3, 1.0, 0.6), 3.2e-3)
        .straight(0.06, 3e-3);
    path.tube().stations().to_vec()
}

impl Rig {
    /// The nominal rig as the solver takes it.
    pub fn problem(&self) -> Problem {
        let i = &self.instrument;
        let section = |(length_m, youngs_pa): (f64, f64)| {
            Section::tube(
                length_m,
                i.outer_diameter_m,
                i.inner_diameter_m,
                youngs_pa,
                i.poissons_ratio,
                i.density_kg_per_m3,
            )
        };
        let curve =
            |(length_m, up_per_m): (f64, f64)| Curve { length_m, up_per_m, side_per_m: 0.0 };
        let line_stiffness = i.wall_stiffness_n_per_m / CONTACT_SPACING_M;
        Problem {
            rod: Rod {
                radius_m: 0.5 * i.outer_diameter_m,
                sections: vec![section(i.sections[1]), section(i.sections[0])],
                curves: i.precurve.iter().copied().map(curve).collect(),
            },
            entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: self.up },
            lumen: lumen(&self.branches, self.blend_m),
            beyond: Default::default(),
            wall: WallLaw {
                line_stiffness_n_per_m2: line_stiffness,
                end_stiffness_n_per_m: 0.5 * i.wall_stiffness_n_per_m,
                tangential_ratio: TANGENTIAL_RATIO,
                friction_coefficient: self.friction_coefficient,
            },
            gravity_m_per_s2: Vector3::from(GRAVITY_M_PER_S2),
            drag_n_s_per_m2: DRAG,
            tip_load: TipLoad::default(),
            numerics: Numerics {
                spacing_m: 1e-3,
                step_s: crate::motion::STEP_S,
                integrator: Integrator::Bdf2,
                tolerance_n: 1e-7,
            },
        }
    }
}

/// The inside of a vessel; without branches, no wall.
pub fn lumen(branches: &[Vec<Station>], blend_m: f64) -> Lumen {
    let tube = |(k, stations): (usize, &Vec<Station>)| {
        let (is_trunk, is_alone) = (k == 0, branches.len() == 1);
        Some(Tube::through(stations)?.with_open_ends([is_trunk, !is_trunk || is_alone]))
    };
    let tubes = branches.iter().enumerate().filter_map(tube).collect();
    Lumen::union(tubes, blend_m)
}
