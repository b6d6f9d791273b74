//! Signorini's and Coulomb's laws at one node, with the derivatives of the forces.
//!
//! The forces are those of the current iterate, the friction's limit included: whether a point
//! is open, sticks or slides is found anew in each iteration (the active set of a semi-smooth
//! Newton method), and at convergence the laws hold exactly. A point that slid in the last
//! iteration and now slides the other way is held instead: between the two lies sticking, in
//! a range of displacements that may be nanometres wide and that no iteration would hit.

use nalgebra::{Matrix3, Vector3};

use crate::lumen::WallPoint;

/// Which set a point belongs to.
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
    /// Of the instrument \[m\].
    pub radius: f64,
}

/// The force of the wall on the instrument's surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reaction {
    pub touch: Touch,
    pub normal_force: f64,
    pub force: Vector3<f64>,
    /// From the centre line to the surface that touches.
    pub arm: Vector3<f64>,
    /// Elastic tangential displacement at the end of the step.
    pub slip: Vector3<f64>,
    /// −∂force by the motion of the centre line, through distance and normal.
    pub by_position: Matrix3<f64>,
    /// −∂force by the motion of the surface.
    pub by_surface: Matrix3<f64>,
    /// Held against a change of direction: the force may exceed Coulomb's limit, and the
    /// iterate is no solution.
    pub held: bool,
    /// Direction of the friction it slides against; zero when it does not.
    pub sliding: Vector3<f64>,
}

impl Reaction {
    pub fn none() -> Self {
        Self {
            touch: Touch::Open,
            normal_force: 0.0,
            force: Vector3::zeros(),
            arm: Vector3::zeros(),
            slip: Vector3::zeros(),
            by_position: Matrix3::zeros(),
            by_surface: Matrix3::zeros(),
            held: false,
            sliding: Vector3::zeros(),
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
        let normal_force = self.normal * indentation;
        let arm = -n * self.radius;
        let mut by_position = n * wall.gradient.transpose() * self.normal
            - across * wall.hessian * (normal_force / steepness);
        let moved = across * (slip + displacement + turn.cross(&arm));
        let stuck = moved * self.tangential;
        let (size, limit) = (stuck.norm(), self.friction * normal_force);
        let held = size > limit && stuck.dot(slid) < 0.0;
        if size <= limit || held {
            return Reaction {
                touch: Touch::Stick,
                normal_force,
                force: n * normal_force - stuck,
                arm,
                slip: moved,
                by_position,
                by_surface: across * self.tangential,
                held,
                sliding: Vector3::zeros(),
            };
        }
        let along = stuck / size;
        // The limit grows with the indentation.
        by_position -= along * wall.gradient.transpose() * (self.friction * self.normal);
        Reaction {
            touch: Touch::Slide,
            normal_force,
            force: n * normal_force - along * limit,
            arm,
            slip: moved * (limit / size),
            by_position,
            by_surface: (across - along * along.transpose()) * (limit * self.tangential / size),
            held: false,
            sliding: along,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::TubePath;
    use crate::lumen::Lumen;

    #[test]
    fn the_derivatives_are_those_of_the_force() {
        let tube = TubePath::from(Vector3::zeros(), Vector3::x(), 4e-3)
            .arc(0.03, 1.0, Vector3::y(), 3e-3)
            .tube();
        let lumen = Lumen::tube(tube);
        let point = Point { normal: 700.0, tangential: 2000.0, friction: 0.4, radius: 0.8e-3 };
        let start = Vector3::new(5e-3, 0.3e-3, 3.2e-3);
        for (slip, touch) in [(0.2e-6, Touch::Stick), (60e-6, Touch::Slide)] {
            let slip = Vector3::new(slip, -2.0 * slip, 0.0);
            // The normal turns the friction as well: that part is left out, and small.
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
                assert!(error < 0.03 * point.normal, "{touch:?} {axis}: {error}");
                let error = (by_surface - here.by_surface.column(axis)).norm();
                assert!(error < 1e-4 * point.tangential, "{touch:?} {axis}: {error}");
            }
        }
    }
}
