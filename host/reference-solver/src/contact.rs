//! Signorini's and Coulomb's laws at one node, with the derivatives of the forces.
//!
//! The forces are those of the current iterate, including the friction limit. Each iteration decides anew
//! whether a point is open, sticks or slides (the active set of a semi-smooth Newton method), so the
//! laws hold exactly at convergence. A point that slid in the last iteration and would now slide the
//! other way is held instead: sticking lies between the two, in a range of displacements of maybe
//! nanometres that no iteration would hit.

use nalgebra::{Matrix3, Vector3};

use crate::beyond::BRANCHES;
use crate::lumen::WallPoint;

/// The active set that a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    Open,
    Stick,
    Slide,
}

/// Stiffness and friction of one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Normal force per indentation \[N/m\].
    pub normal: f64,
    /// Tangential force per elastic displacement \[N/m\].
    pub tangential: f64,
    pub friction: f64,
    /// Outer radius of the instrument \[m\].
    pub radius: f64,
    /// 1/e-folds of the normal stiffness per indentation \[1/m\].
    pub stiffening_per_m: f64,
    /// Share by which the coefficient grows as the normal force goes to zero, and the force over which it
    /// does \[N\].
    pub light: (f64, f64),
    /// If above 0, that share falls by this power of the force and not exponentially.
    pub light_power: f64,
    /// Normal stiffness of the relaxing branches \[N/m\], and the indentation to which each has relaxed
    /// \[m\].
    pub relaxing: [(f64, f64); BRANCHES],
}

impl Point {
    /// Normal force at an indentation, and its derivative.
    fn pressed(&self, indentation: f64) -> (f64, f64) {
        let grown = (self.stiffening_per_m * indentation).exp();
        let force = match self.stiffening_per_m {
            0.0 => self.normal * indentation,
            per_m => self.normal * (grown - 1.0) / per_m,
        };
        let relaxing = self.relaxing.iter().map(|(k, relaxed)| k * (indentation - relaxed));
        let slope = self.normal * grown + self.relaxing.iter().map(|(k, _)| k).sum::<f64>();
        let force = force + relaxing.sum::<f64>();
        // A wall cannot pull.
        if force > 0.0 { (force, slope) } else { (0.0, 0.0) }
    }

    /// Coulomb's limit at a normal force, and its derivative.
    fn limit(&self, normal_force: f64) -> (f64, f64) {
        let (share, force) = self.light;
        if share == 0.0 {
            return (self.friction * normal_force, self.friction);
        }
        if self.light_power > 0.0 {
            let grown = 1.0 + normal_force / force;
            let light = share * grown.powf(-self.light_power);
            let slope = 1.0 + light * (1.0 - self.light_power * normal_force / (force * grown));
            return (self.friction * normal_force * (1.0 + light), self.friction * slope);
        }
        let light = share * (-normal_force / force).exp();
        let slope = 1.0 + light * (1.0 - normal_force / force);
        (self.friction * normal_force * (1.0 + light), self.friction * slope)
    }
}

/// The force of the wall on the instrument's surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reaction {
    pub touch: Touch,
    pub normal_force: f64,
    /// Indentation \[m\].
    pub indentation: f64,
    pub force: Vector3<f64>,
    /// Vector from the centre line to the touching surface \[m\].
    pub arm: Vector3<f64>,
    /// Elastic tangential displacement at the end of the step.
    pub slip: Vector3<f64>,
    /// −∂force/∂(motion of the centre line), through distance and normal.
    pub by_position: Matrix3<f64>,
    /// −∂force/∂(motion of the surface).
    pub by_surface: Matrix3<f64>,
    /// Held against a change of direction: the force may exceed Coulomb's limit, and the
    /// iterate is no solution.
    pub held: bool,
    /// Direction of the friction it slides against; zero when it does not.
    pub sliding: Vector3<f64>,
    /// How far it has slid in the step \[m\].
    pub slid_m: f64,
}

impl Reaction {
    /// No contact.
    pub fn none() -> Self {
        Self {
            touch: Touch::Open,
            normal_force: 0.0,
            indentation: 0.0,
            force: Vector3::zeros(),
            arm: Vector3::zeros(),
            slip: Vector3::zeros(),
            by_position: Matrix3::zeros(),
            by_surface: Matrix3::zeros(),
            held: false,
            sliding: Vector3::zeros(),
            slid_m: 0.0,
        }
    }
}

impl Point {
    /// `displacement` and `turn`: motion of the centre line and rotation of the cross-section
    /// since the step began; `slip`: elastic displacement at that time; `slid`: direction in
    /// which it slid in the last iteration, or zero.
    ///
    /// N = k max(0, r − d),   |q| ≤ μ N with q = k_t s and s = P (slip + displacement of the
    /// surface), where what exceeds the limit has slid.
    pub fn reaction(
        &self,
        wall: &WallPoint,
        displacement: &Vector3<f64>,
        turn: &Vector3<f64>,
        slip: &Vector3<f64>,
        slid: &Vector3<f64>,
    ) -> Reaction {
        let indentation = self.radius - wall.distance_m;
        if indentation <= 0.0 {
            return Reaction::none();
        }
        let steepness = wall.gradient.norm();
        let n = wall.gradient / steepness;
        let across = Matrix3::identity() - n * n.transpose();
        let (normal_force, stiffness) = self.pressed(indentation);
        let (limit, limit_slope) = self.limit(normal_force);
        let arm = -n * self.radius;
        let mut by_position = n * wall.gradient.transpose() * stiffness
            - across * wall.hessian * (normal_force / steepness);
        let moved = across * (slip + displacement + turn.cross(&arm));
        let stuck = moved * self.tangential;
        let size = stuck.norm();
        let held = size > limit && stuck.dot(slid) < 0.0;
        if size <= limit || held {
            return Reaction {
                touch: Touch::Stick,
                normal_force,
                indentation,
                force: n * normal_force - stuck,
                arm,
                slip: moved,
                by_position,
                by_surface: across * self.tangential,
                held,
                sliding: Vector3::zeros(),
                slid_m: 0.0,
            };
        }
        let along = stuck / size;
        // The limit grows with the indentation.
        by_position -= along * wall.gradient.transpose() * (limit_slope * stiffness);
        Reaction {
            touch: Touch::Slide,
            normal_force,
            indentation,
            force: n * normal_force - along * limit,
            arm,
            slip: moved * (limit / size),
            by_position,
            by_surface: (across - along * along.transpose()) * (limit * self.tangential / size),
            held: false,
            sliding: along,
            slid_m: moved.norm() * (1.0 - limit / size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::TubePath;
    use crate::lumen::Lumen;

    const POINT: Point = Point {
        normal: 700.0,
        tangential: 2000.0,
        friction: 0.4,
        radius: 0.8e-3,
        stiffening_per_m: 4e3,
        light: (0.6, 0.05),
        light_power: 0.0,
        relaxing: [(300.0, 0.5e-5), (200.0, 0.0), (0.0, 0.0)],
    };

    #[test]
    fn a_stiffening_wall_begins_as_stiff_as_stated_and_gains_e_fold() {
        let stiffening = Point { relaxing: [(0.0, 0.0); BRANCHES], ..POINT };
        let (force_n, slope) = stiffening.pressed(1e-9);
        assert!((force_n / 700e-9 - 1.0).abs() < 1e-4 && (slope / 700.0 - 1.0).abs() < 1e-4);
        let (_, slope) = stiffening.pressed(1.0 / 4e3);
        assert!((slope / 700.0 - std::f64::consts::E).abs() < 1e-9, "{slope}");
    }

    #[test]
    fn a_wall_does_not_pull_while_it_has_not_relaxed_back() {
        let left = Point { relaxing: [(900.0, 1e-4); BRANCHES], ..POINT };
        assert_eq!(left.pressed(1e-6), (0.0, 0.0));
    }

    #[test]
    fn friction_is_higher_at_small_loads_alone() {
        let coefficient = |normal_n: f64| POINT.limit(normal_n).0 / normal_n;
        assert!((coefficient(1e-6) / (0.4 * 1.6) - 1.0).abs() < 1e-3);
        assert!((coefficient(1.0) / 0.4 - 1.0).abs() < 1e-6);
        let h = 1e-6;
        let by_difference = (POINT.limit(0.03 + h).0 - POINT.limit(0.03 - h).0) / (2.0 * h);
        assert!((POINT.limit(0.03).1 / by_difference - 1.0).abs() < 1e-6);
        let slow = Point { light_power: 0.3, ..POINT };
        assert!((slow.limit(0.05).0 / 0.02 - (1.0 + 0.6 * 0.5f64.powf(0.3))).abs() < 1e-12);
        let by_difference = (slow.limit(0.03 + h).0 - slow.limit(0.03 - h).0) / (2.0 * h);
        assert!((slow.limit(0.03).1 / by_difference - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_derivatives_are_those_of_the_force() {
        let tube = TubePath::from(Vector3::zeros(), Vector3::x(), 4e-3)
            .arc(0.03, 1.0, Vector3::y(), 3e-3)
            .tube();
        let lumen = Lumen::tube(tube);
        let point = POINT;
        let start = Vector3::new(5e-3, 0.3e-3, 3.2e-3);
        for (slip, touch) in [(0.2e-6, Touch::Stick), (60e-6, Touch::Slide)] {
            let slip = Vector3::new(slip, -2.0 * slip, 0.0);
            // Rotation of the friction with the normal is small and left out.
            let force = |x: &Vector3<f64>, moved: &Vector3<f64>| {
                let none = Vector3::zeros();
                point.reaction(&lumen.sample(x), moved, &none, &slip, &none)
            };
            let here = force(&start, &Vector3::zeros());
            assert_eq!(here.touch, touch);
            let h = 1e-8;
            for axis in 0..3 {
                let step = Vector3::ith(axis, h);
                let by_position = (force(&(start - step), &Vector3::zeros()).force
                    - force(&(start + step), &Vector3::zeros()).force)
                    / (2.0 * h);
                let by_surface =
                    (force(&start, &-step).force - force(&start, &step).force) / (2.0 * h);
                let error = (by_position - here.by_position.column(axis)).norm();
                let (_, stiffness) = point.pressed(here.indentation);
                assert!(error < 0.03 * stiffness, "{touch:?} {axis}: {error}");
                let error = (by_surface - here.by_surface.column(axis)).norm();
                assert!(error < 1e-4 * point.tangential, "{touch:?} {axis}: {error}");
            }
        }
    }
}
