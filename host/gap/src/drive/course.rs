//! What a command is predicted along: a motion at every n-th grid point, with what no effect changes.

use std::borrow::Cow;

use cathforce_bundle::bundle::Axis as Kind;

use super::motion::Motion;

/// An axis: what moves, and how friction turns over where it turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    pub kind: Kind,
    /// As stated, in kg or kg·m².
    pub inertia: f64,
    pub turnover_m_per_s: f64,
}

/// What is known of the axis along a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Of all that moves, in kg or kg·m²; 0 where a recording is too slow to tell.
    pub inertia: f64,
    /// What it takes to hold the axis, at every point; empty without a load.
    pub load: Vec<f64>,
    /// Force for each m/s by which the voltage that the motor induces brakes.
    pub induced: f64,
}

impl Known {
    /// Of an axis that carries nothing.
    pub fn bare(inertia: f64) -> Self {
        Self { inertia, load: Vec::new(), induced: 0.0 }
    }
}

/// Presliding distances after which a bristle remembers nothing: e⁻⁴⁰ is below the rounding of 1.
const FAR: f64 = 40.0;

/// A motion with what is known along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Between two of its points \[s\], and in grid points of the motion.
    pub dt_s: f64,
    pub every: usize,
    pub position_m: Vec<f64>,
    pub velocity_m_per_s: Vec<f64>,
    pub acceleration_m_per_s2: Vec<f64>,
    /// The direction of motion, from −1 to 1, and the way since the last point \[m\], both at every grid point.
    direction: Vec<f64>,
    way_m: Vec<f64>,
    pub known: Known,
    /// The direction around every point, where friction turns over at once: so it is in most simulations.
    at_once: Vec<f64>,
}

impl Course {
    /// Along every n-th grid point of a motion.
    pub fn of(axis: &Axis, motion: &Motion, known: &Known, every: usize) -> Self {
        let thin = |series: &[f64]| series.iter().copied().step_by(every).collect::<Vec<f64>>();
        let position = &motion.position_m;
        let turned = |v: &f64| (v / axis.turnover_m_per_s).tanh();
        let ways = position.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let mut course = Self {
            dt_s: motion.dt_s * every as f64,
            every,
            position_m: thin(position),
            velocity_m_per_s: thin(&motion.velocity_m_per_s),
            acceleration_m_per_s2: thin(&motion.acceleration_m_per_s2),
            direction: motion.velocity_m_per_s.iter().map(turned).collect(),
            way_m: std::iter::once(0.0).chain(ways).collect(),
            known: Known { load: thin(&known.load), ..known.clone() },
            at_once: Vec::new(),
        };
        course.at_once = course.around(course.direction.iter().copied());
        course
    }

    /// The direction that friction is against, from −1 to 1. After a reversal it turns over within
    /// some presliding distances, as the bristles of Dahl's model do (Dahl 1968).
    ///
    /// Bristles are bent at every grid point, and of those around a point of the course the mean is taken: when a
    /// motion turns round is known to a grid point, however far apart the points of the course are.
    pub fn against(&self, presliding_m: f64) -> Cow<'_, [f64]> {
        if presliding_m <= 0.0 {
            return Cow::Borrowed(&self.at_once);
        }
        let mut bent = 0.0;
        let follow = |(moving, way): (&f64, &f64)| {
            // A bristle that is bent as far as it goes stays so, and one that has gone far is: neither needs an
            // exponential.
            if *way > FAR * presliding_m {
                bent = *moving;
            } else if bent != *moving {
                bent = moving + (bent - moving) * (-way / presliding_m).exp();
            }
            bent
        };
        Cow::Owned(self.around(self.direction.iter().zip(&self.way_m).map(follow)))
    }

    /// Means of a series on the grid around the points of the course. The series is not kept: to get the
    /// memory for that of a long record takes as long as to compute it.
    fn around(&self, series: impl Iterator<Item = f64>) -> Vec<f64> {
        if self.every == 1 {
            return series.collect();
        }
        // Around the first point lie those after it alone.
        let mut whole = self.every / 2 + 1;
        let mut means = Vec::with_capacity(self.position_m.len());
        let (mut sum, mut count) = (0.0, 0);
        for value in series {
            sum += value;
            count += 1;
            if count == whole {
                means.push(sum / count as f64);
                (sum, count, whole) = (0.0, 0, self.every);
            }
        }
        // The last one may lack some after it; what lies after those is around none.
        if means.len() < self.position_m.len() {
            means.push(sum / count as f64);
        }
        means
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_between_two_points_is_where_it_was() {
        let axis = Axis { kind: Kind::Linear, inertia: 1.0, turnover_m_per_s: 1e-6 };
        let velocity: Vec<f64> = (0..101).map(|i| if i < 52 { 1.0 } else { -1.0 }).collect();
        let position: Vec<f64> = (0..101).map(|i: i32| f64::from(52 - (i - 52).abs())).collect();
        let motion = Motion {
            dt_s: 1e-3,
            acceleration_m_per_s2: vec![0.0; 101],
            position_m: position,
            velocity_m_per_s: velocity,
        };
        let known = Known { load: (0..101).map(f64::from).collect(), ..Known::bare(1.0) };
        let course = Course::of(&axis, &motion, &known, 4);
        assert_eq!((course.dt_s, course.known.load[3]), (4e-3, 12.0));
        // Points 51 to 54 are around the point 52: one of them is before the turn.
        assert_eq!(course.against(0.0)[12..15], [1.0, -0.5, -1.0]);
        // From the point 52 on, bristles turn over by a presliding distance a point.
        let turned = |ways: i32| -1.0 + 2.0 * f64::from(-ways).exp();
        let expected = (1.0 + turned(1) + turned(2) + turned(3)) / 4.0;
        assert!((course.against(1.0)[13] - expected).abs() < 1e-9, "{}", course.against(1.0)[13]);
    }
}
