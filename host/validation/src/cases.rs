//! The cases: instrument, vessel and motion.

use cathforce_reference_solver::{
    Curve, Entry, Integrator, Lumen, Numerics, Problem, Rod, Schedule, Section, TipLoad, TubePath,
    WallLaw,
};
use nalgebra::Vector3;
use serde::Serialize;

/// Kinds of cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Fed in at constant speed.
    Feed,
    /// Fed, withdrawn and fed again, with ramps.
    Reversal,
    /// Fed, then a pre-curved tip is rotated to and fro by less than makes it whip round.
    Rotation,
    /// Fed, then a pre-curved tip is rotated in a bend until it whips round.
    Whip,
    /// A pre-curved tip is rotated out of a branch and jumps off the dividing wall.
    Snap,
}

/// One comparison.
#[derive(Clone, Debug)]
pub struct Case {
    pub name: &'static str,
    pub kind: Kind,
    pub problem: Problem,
    pub schedule: Schedule,
    /// Time at which scoring begins; the start is an artefact of settling \[s\].
    pub scored_from_s: f64,
}

/// Feed of all cases \[m/s\].
const FEED_M_PER_S: f64 = 0.013;
/// Line stiffness of the wall \[N/m²\]: a soft phantom, a silicone one, glass.
const SOFT: f64 = 8e4;
const SILICONE: f64 = 8e5;
const NEAR_RIGID: f64 = 8e7;
/// Drag per length \[N·s/m²\], with which a free tip comes to rest in a second.
const DRAG: f64 = 0.02;
/// Viscous time of bending of a viscous instrument: moment per rate of bending over stiffness \[s\].
const VISCOUS_S: f64 = 0.2;

/// All cases, in the order of the table.
pub fn cases() -> Vec<Case> {
    let (straight, curved) = (Vec::new, curved_tip);
    vec![
        case("feed, no friction", Kind::Feed, SILICONE, 0.0, straight()),
        case("feed", Kind::Feed, SILICONE, 0.3, straight()),
        case("feed, friction 0.7", Kind::Feed, SILICONE, 0.7, straight()),
        case("feed, soft wall", Kind::Feed, SOFT, 0.3, straight()),
        case("feed, near-rigid wall", Kind::Feed, NEAR_RIGID, 0.3, straight()),
        case("reversal, no friction", Kind::Reversal, SILICONE, 0.0, straight()),
        case("reversal", Kind::Reversal, SILICONE, 0.3, straight()),
        case("reversal, friction 0.7", Kind::Reversal, SILICONE, 0.7, straight()),
        case("reversal, soft wall", Kind::Reversal, SOFT, 0.3, straight()),
        case("reversal, near-rigid wall", Kind::Reversal, NEAR_RIGID, 0.3, straight()),
        case("reversal, viscous bending", Kind::Reversal, SILICONE, 0.3, straight()).viscous(),
        case("rotation, no friction", Kind::Rotation, SILICONE, 0.0, curved()),
        case("rotation", Kind::Rotation, SILICONE, 0.3, curved()),
        case("rotation, friction 0.7", Kind::Rotation, SILICONE, 0.7, curved()),
        case("rotation, soft wall", Kind::Rotation, SOFT, 0.3, curved()),
        case("rotation, near-rigid wall", Kind::Rotation, NEAR_RIGID, 0.3, curved()),
        case("rotation, viscous bending", Kind::Rotation, SILICONE, 0.3, curved()).viscous(),
        case("whip in a bend, no friction", Kind::Whip, SILICONE, 0.0, curved()),
        case("whip in a bend", Kind::Whip, SILICONE, 0.3, curved()),
        case("whip in a bend, friction 0.7", Kind::Whip, SILICONE, 0.7, curved()),
        case("snap off a dividing wall", Kind::Snap, SILICONE, 0.3, curved()),
    ]
}

impl Case {
    /// With an instrument whose moment follows the rate of bending.
    fn viscous(mut self) -> Self {
        self.problem.beyond.bending_viscosity_s = VISCOUS_S;
        self
    }
}

/// A 5 F catheter of 26 MPa whose last 50 mm are stiffer (50 MPa).
fn case(
    name: &'static str,
    kind: Kind,
    line_stiffness_n_per_m2: f64,
    friction_coefficient: f64,
    curves: Vec<Curve>,
) -> Case {
    let tube = |youngs_pa: f64, length_m: f64| {
        Section::tube(length_m, 1.65e-3, 1.02e-3, youngs_pa, 0.4, 1100.0)
    };
    let problem = Problem {
        rod: Rod { radius_m: 0.825e-3, sections: vec![tube(50e6, 0.05), tube(26e6, 0.6)], curves },
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: Vector3::y() },
        lumen: if kind == Kind::Snap { bifurcation() } else { tapering_bend() },
        beyond: Default::default(),
        wall: WallLaw {
            line_stiffness_n_per_m2,
            // Half a contact point of 5 mm.
            end_stiffness_n_per_m: 0.5 * 5e-3 * line_stiffness_n_per_m2,
            tangential_ratio: 3.0,
            friction_coefficient,
        },
        gravity_m_per_s2: Vector3::z() * -9.81,
        drag_n_s_per_m2: DRAG,
        tip_load: TipLoad::default(),
        numerics: Numerics {
            spacing_m: 0.5e-3,
            step_s: 2e-3,
            integrator: Integrator::Bdf2,
            tolerance_n: 1e-8,
        },
    };
    let begin = Schedule::starting_at(0.03, 0.0).then(0.3, 0.0, 0.0, 0.0);
    let schedule = match kind {
        Kind::Feed => begin.then(7.0, 0.2, FEED_M_PER_S, 0.0).then(0.7, 0.2, 0.0, 0.0),
        Kind::Reversal => begin
            .then(5.0, 0.2, FEED_M_PER_S, 0.0)
            .then(2.0, 0.4, -FEED_M_PER_S, 0.0)
            .then(2.0, 0.4, FEED_M_PER_S, 0.0),
        Kind::Rotation => begin
            .then(4.0, 0.2, FEED_M_PER_S, 0.0)
            .then(0.5, 0.2, 0.0, 0.0)
            .then(1.25, 0.2, 0.0, 2.0)
            .then(2.5, 0.4, 0.0, -2.0)
            .then(1.25, 0.4, 0.0, 2.0),
        Kind::Whip => begin
            .then(4.0, 0.2, FEED_M_PER_S, 0.0)
            .then(0.5, 0.2, 0.0, 0.0)
            .then(3.0, 0.2, 0.0, 2.0),
        Kind::Snap => begin
            .then(2.4, 0.2, FEED_M_PER_S, 0.0)
            .then(0.5, 0.2, 0.0, 0.0)
            .then(6.0, 0.2, 0.0, 2.0),
    };
    // 3 mm of feed.
    let scored_from_s = 0.3 + 0.1 + 3e-3 / FEED_M_PER_S;
    Case { name, kind, problem, schedule, scored_from_s }
}

/// 4 mm nearly straight, then 20 mm bent by 69°.
fn curved_tip() -> Vec<Curve> {
    vec![
        Curve { length_m: 4e-3, up_per_m: 10.0, side_per_m: 0.0 },
        Curve { length_m: 20e-3, up_per_m: 60.0, side_per_m: 0.0 },
    ]
}

/// 10 mm wide, a bend of 60°, tapering to 6 mm.
fn tapering_bend() -> Lumen {
    let path = TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3)
        .straight(0.04, 5e-3)
        .arc(0.04, 60f64.to_radians(), Vector3::y(), 4e-3)
        .straight(0.05, 3e-3)
        .straight(0.02, 3e-3);
    Lumen::tube(path.tube())
}

/// A trunk that divides evenly, towards `up` and away from it.
fn bifurcation() -> Lumen {
    let branch = |towards| {
        TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3)
            .straight(0.03, 5e-3)
            .arc(0.04, 40f64.to_radians(), towards, 3.5e-3)
            .straight(0.03, 3e-3)
            .tube()
    };
    Lumen::union(vec![branch(Vector3::y()), branch(-Vector3::y())], 2e-3)
}
