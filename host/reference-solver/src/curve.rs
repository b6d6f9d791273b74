//! A smooth centre line with a radius: cubic pieces through stations.

use nalgebra::Vector3;

/// One station of a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Vessel frame \[m\].
    pub position_m: Vector3<f64>,
    /// Radius of the lumen \[m\].
    pub radius_m: f64,
}

/// A cubic piece over u from 0 to 1: value at both ends and slope by u.
#[derive(Clone, Copy, Debug)]
struct Piece {
    position: [Vector3<f64>; 4],
    radius: [f64; 4],
}

/// Value, first and second derivative by u.
#[derive(Clone, Copy, Debug)]
struct Jet {
    c: Vector3<f64>,
    c1: Vector3<f64>,
    c2: Vector3<f64>,
    r: f64,
    r1: f64,
    r2: f64,
}

impl Piece {
    /// Hermite's cubic from values and slopes, as coefficients of powers of u.
    fn hermite(
        a: (Vector3<f64>, f64),
        slope_a: (Vector3<f64>, f64),
        b: (Vector3<f64>, f64),
        slope_b: (Vector3<f64>, f64),
    ) -> Self {
        let position = [
            a.0,
            slope_a.0,
            (b.0 - a.0) * 3.0 - slope_a.0 * 2.0 - slope_b.0,
            (a.0 - b.0) * 2.0 + slope_a.0 + slope_b.0,
        ];
        let radius = [
            a.1,
            slope_a.1,
            (b.1 - a.1) * 3.0 - slope_a.1 * 2.0 - slope_b.1,
            (a.1 - b.1) * 2.0 + slope_a.1 + slope_b.1,
        ];
        Self { position, radius }
    }

    fn jet(&self, u: f64) -> Jet {
        let (p, r) = (&self.position, &self.radius);
        Jet {
            c: p[0] + (p[1] + (p[2] + p[3] * u) * u) * u,
            c1: p[1] + (p[2] * 2.0 + p[3] * (3.0 * u)) * u,
            c2: p[2] * 2.0 + p[3] * (6.0 * u),
            r: r[0] + (r[1] + (r[2] + r[3] * u) * u) * u,
            r1: r[1] + (2.0 * r[2] + 3.0 * r[3] * u) * u,
            r2: 2.0 * r[2] + 6.0 * r[3] * u,
        }
    }
}

/// A tube: the union of all balls around its centre line, which continues straight past both ends.
#[derive(Clone, Debug)]
pub struct Tube {
    pieces: Vec<Piece>,
    stations: Vec<Station>,
    is_open: [bool; 2],
}

/// The wall of a tube as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Depth {
    /// Distance to the wall, positive inside \[m\].
    pub distance: f64,
    /// From the centre line's nearest ball to the point.
    pub outwards: Vector3<f64>,
    /// Distance from the ball's centre \[m\].
    pub off_axis: f64,
    /// How fast `outwards` turns as the ball moves along the centre line, and how sharp the
    /// maximum over the balls is: what the curvature of the wall needs.
    pub drift: Vector3<f64>,
    pub sharpness: f64,
    /// How far past the nearer end the ball lies \[m\].
    pub beyond: f64,
}

/// Length by which the ends continue straight \[m\].
const EXTENSION_M: f64 = 0.5;

impl Tube {
    /// A Catmull–Rom curve through stations, for the radius too. `None` with fewer than two stations, or
    /// with two at one place.
    pub fn through(stations: &[Station]) -> Option<Self> {
        let mut s = vec![0.0];
        for pair in stations.windows(2) {
            let length = (pair[1].position_m - pair[0].position_m).norm();
            if length < 1e-9 {
                return None;
            }
            s.push(s[s.len() - 1] + length);
        }
        if stations.len() < 2 {
            return None;
        }
        let slope = |at: usize| {
            let (low, high) = (at.saturating_sub(1), (at + 1).min(stations.len() - 1));
            let (a, b, ds) = (&stations[low], &stations[high], s[high] - s[low]);
            ((b.position_m - a.position_m) / ds, (b.radius_m - a.radius_m) / ds)
        };
        let pieces = (1..stations.len()).map(|at| {
            let ds = s[at] - s[at - 1];
            let scaled = |(p, r): (Vector3<f64>, f64)| (p * ds, r * ds);
            let value = |at: usize| (stations[at].position_m, stations[at].radius_m);
            let (from, to) = (scaled(slope(at - 1)), scaled(slope(at)));
            Piece::hermite(value(at - 1), from, value(at), to)
        });
        Some(Self::closed(pieces.collect(), stations.to_vec()))
    }

    /// Adds the straight pieces past both ends.
    fn closed(mut pieces: Vec<Piece>, stations: Vec<Station>) -> Self {
        let (first, last) = (pieces[0].jet(0.0), pieces[pieces.len() - 1].jet(1.0));
        let straight = |from: Vector3<f64>, along: Vector3<f64>, radius: f64| Piece {
            position: [from, along * EXTENSION_M, Vector3::zeros(), Vector3::zeros()],
            radius: [radius, 0.0, 0.0, 0.0],
        };
        pieces.insert(0, straight(first.c, -first.c1.normalize(), first.r));
        pieces.push(straight(last.c, last.c1.normalize(), last.r));
        Self { pieces, stations, is_open: [true; 2] }
    }

    /// Says which of the two ends are open; a closed end is a half sphere. Both are open by default.
    pub fn with_open_ends(mut self, is_open: [bool; 2]) -> Self {
        self.is_open = is_open;
        self
    }

    /// The stations between which the pieces run.
    pub fn stations(&self) -> &[Station] {
        &self.stations
    }

    /// max over the centre line of radius − distance from it.
    pub(crate) fn depth(&self, p: &Vector3<f64>) -> Depth {
        let depth_at = |station: &Station| station.radius_m - (p - station.position_m).norm();
        let nearest = (0..self.stations.len())
            .max_by(|&a, &b| depth_at(&self.stations[a]).total_cmp(&depth_at(&self.stations[b])))
            .unwrap_or(0);
        // Station k lies between pieces k and k + 1.
        let before = self.on_piece(nearest, p);
        let after = self.on_piece(nearest + 1, p);
        if before.distance > after.distance { before } else { after }
    }

    /// The same maximum over one piece, by Newton's method kept inside a bracket.
    fn on_piece(&self, index: usize, p: &Vector3<f64>) -> Depth {
        let piece = &self.pieces[index];
        // Slope and curvature of r(u) − |p − c(u)|.
        let slopes = |u: f64| {
            let jet = piece.jet(u);
            let off = p - jet.c;
            let off_axis = off.norm().max(1e-12);
            let out = off / off_axis;
            let along = out.dot(&jet.c1);
            let slope = jet.r1 + along;
            let bend =
                jet.r2 - (jet.c1.norm_squared() - along * along) / off_axis + out.dot(&jet.c2);
            (slope, bend, jet, out, off_axis)
        };
        let (mut low, mut high) = (0.0, 1.0);
        let is_end = [index == 0, index + 1 == self.pieces.len()];
        let is_closed = (0..2).any(|end| is_end[end] && !self.is_open[end]);
        let mut u: f64 = if is_closed || slopes(0.0).0 <= 0.0 {
            high = 0.0;
            0.0
        } else if slopes(1.0).0 >= 0.0 {
            low = 1.0;
            1.0
        } else {
            0.5
        };
        for _ in 0..60 {
            if high - low < 1e-14 {
                break;
            }
            let (slope, bend, ..) = slopes(u);
            if slope > 0.0 {
                low = u
            } else {
                high = u
            }
            let newton = u - slope / bend;
            let next = if bend < 0.0 && newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            let still = (next - u).abs() < 1e-13;
            u = next;
            if still {
                break;
            }
        }
        let (_, bend, jet, outwards, off_axis) = slopes(u);
        let at_end = u == 0.0 || u == 1.0;
        Depth {
            distance: jet.r - off_axis,
            outwards,
            off_axis,
            drift: (jet.c1 - outwards * outwards.dot(&jet.c1)) / off_axis,
            sharpness: if at_end { f64::NEG_INFINITY } else { bend },
            beyond: if is_end.contains(&true) { u * EXTENSION_M } else { 0.0 },
        }
    }
}

/// Draws a tube piece by piece: straight pieces and arcs, the radius linear along each.
///
/// ```
/// use cathforce_reference_solver::TubePath;
/// use nalgebra::Vector3;
/// let bent = TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3)
///     .straight(0.06, 5e-3)
///     .arc(0.04, 60f64.to_radians(), Vector3::y(), 3e-3)
///     .tube();
/// assert_eq!(bent.stations()[0].radius_m, 5e-3);
/// ```
#[derive(Clone, Debug)]
pub struct TubePath {
    stations: Vec<Station>,
    pieces: Vec<Piece>,
    direction: Vector3<f64>,
}

/// Longest piece \[m\] and widest arc \[rad\] of one cubic, which deviates from the arc by less than 10⁻⁹
/// of its radius.
const LONGEST_PIECE_M: f64 = 5e-3;
const WIDEST_PIECE_RAD: f64 = 0.15;

impl TubePath {
    /// Begins at a point with a unit direction and a radius.
    pub fn from(position_m: Vector3<f64>, direction: Vector3<f64>, radius_m: f64) -> Self {
        let start = Station { position_m, radius_m };
        Self { stations: vec![start], pieces: Vec::new(), direction: direction.normalize() }
    }

    /// Adds a straight piece; the radius changes linearly to `radius_m`.
    pub fn straight(mut self, length_m: f64, radius_m: f64) -> Self {
        let start = self.stations[self.stations.len() - 1];
        let count = (length_m / LONGEST_PIECE_M).ceil().max(1.0) as usize;
        for k in 1..=count {
            let share = k as f64 / count as f64;
            let step = self.direction * (length_m / count as f64);
            let position_m = start.position_m + self.direction * (length_m * share);
            self.push(position_m, start.radius_m + (radius_m - start.radius_m) * share, step, step);
        }
        self
    }

    /// Adds an arc of radius `bend_m` through `angle_rad`, bending towards the part of `towards` that is
    /// normal to the direction; the tube's radius changes linearly to `radius_m`.
    pub fn arc(
        mut self,
        bend_m: f64,
        angle_rad: f64,
        towards: Vector3<f64>,
        radius_m: f64,
    ) -> Self {
        let start = self.stations[self.stations.len() - 1];
        let t = self.direction;
        let normal = (towards - t * t.dot(&towards)).normalize();
        let count = (angle_rad / WIDEST_PIECE_RAD)
            .max(bend_m * angle_rad / LONGEST_PIECE_M)
            .ceil()
            .max(1.0) as usize;
        let part = angle_rad / count as f64;
        // With this slope the cubic's middle lies on the arc.
        let slope = 4.0 * (0.25 * part).tan() * bend_m;
        for k in 1..=count {
            let angle = part * k as f64;
            let next = t * angle.cos() + normal * angle.sin();
            let position_m =
                start.position_m + (t * angle.sin() + normal * (1.0 - angle.cos())) * bend_m;
            let share = k as f64 / count as f64;
            let radius_m = start.radius_m + (radius_m - start.radius_m) * share;
            self.push(position_m, radius_m, self.direction * slope, next * slope);
            self.direction = next;
        }
        self
    }

    fn push(
        &mut self,
        position_m: Vector3<f64>,
        radius_m: f64,
        from: Vector3<f64>,
        to: Vector3<f64>,
    ) {
        let last = self.stations[self.stations.len() - 1];
        let change = radius_m - last.radius_m;
        self.pieces.push(Piece::hermite(
            (last.position_m, last.radius_m),
            (from, change),
            (position_m, radius_m),
            (to, change),
        ));
        self.stations.push(Station { position_m, radius_m });
    }

    /// The tube drawn so far; a path without a piece is straight.
    pub fn tube(self) -> Tube {
        let path = if self.pieces.is_empty() {
            let radius_m = self.stations[0].radius_m;
            self.straight(LONGEST_PIECE_M, radius_m)
        } else {
            self
        };
        Tube::closed(path.pieces, path.stations)
    }
}
