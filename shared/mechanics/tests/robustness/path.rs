//! Vessels around a centre line.

use crate::wall::{Seen, Vector, add, dot, norm, tube};

/// A centre line of straight pieces and arcs with common tangents. The first and the last piece are
/// unbounded.
pub struct Path {
    pieces: Vec<Piece>,
    end: Vector,
    tangent: Vector,
}

enum Piece {
    Straight { from: Vector, along: Vector, length_m: f64 },
    Arc { centre: Vector, out: Vector, along: Vector, radius_m: f64, angle_rad: f64 },
}

impl Path {
    pub fn new(from: Vector, direction: Vector) -> Self {
        Self { pieces: Vec::new(), end: from, tangent: direction }
    }

    pub fn straight(mut self, length_m: f64) -> Self {
        self.pieces.push(Piece::Straight { from: self.end, along: self.tangent, length_m });
        self.end = add(self.end, self.tangent, length_m);
        self
    }

    /// `towards`: unit vector, normal to the path so far.
    pub fn bend(mut self, radius_m: f64, angle_rad: f64, towards: Vector) -> Self {
        let (along, centre) = (self.tangent, add(self.end, towards, radius_m));
        let out = towards.map(|x| -x);
        self.pieces.push(Piece::Arc { centre, out, along, radius_m, angle_rad });
        let (sin, cos) = angle_rad.sin_cos();
        self.end = core::array::from_fn(|i| centre[i] + radius_m * (cos * out[i] + sin * along[i]));
        self.tangent = core::array::from_fn(|i| cos * along[i] - sin * out[i]);
        self
    }

    /// The point of the path nearest to `p`.
    pub fn nearest(&self, p: Vector) -> Vector {
        let last = self.pieces.len() - 1;
        let candidates = self.pieces.iter().enumerate().map(|(i, piece)| match *piece {
            Piece::Straight { from, along, length_m } => {
                let s = dot(add(p, from, -1.0), along);
                let low = if i == 0 { f64::MIN } else { 0.0 };
                let high = if i == last { f64::MAX } else { length_m };
                add(from, along, s.clamp(low, high))
            }
            Piece::Arc { centre, out, along, radius_m, angle_rad } => {
                let off = add(p, centre, -1.0);
                let angle = dot(off, along).atan2(dot(off, out));
                // The end that is nearer where the point lies beyond both.
                let opposite = 0.5 * (angle_rad - core::f64::consts::TAU);
                let angle = if angle < opposite { angle_rad } else { angle.clamp(0.0, angle_rad) };
                let (sin, cos) = angle.sin_cos();
                core::array::from_fn(|i| centre[i] + radius_m * (cos * out[i] + sin * along[i]))
            }
        });
        let apart = |q: &Vector| norm(add(p, *q, -1.0));
        candidates.min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap()
    }

    /// The wall of a tube around the path.
    pub fn tube(&self, p: Vector, radius_m: f64) -> Seen {
        tube(p, self.nearest(p), radius_m)
    }
}
