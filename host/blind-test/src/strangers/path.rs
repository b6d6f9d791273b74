//! Draws a centre line station by station, so finely that a narrowing of some millimetres is not lost
//! between two.

use cathforce_reference_solver::Station;
use nalgebra::{Unit, Vector3};

/// Distance between stations \[m\].
const SPACING_M: f64 = 2e-3;

/// A centre line that is drawn.
#[derive(Clone, Debug)]
pub struct Path {
    stations: Vec<Station>,
    direction: Vector3<f64>,
}

impl Path {
    /// Begins at a point with a direction and a radius \[m\].
    pub fn from(position_m: Vector3<f64>, direction: Vector3<f64>, radius_m: f64) -> Self {
        let direction = direction.normalize();
        Self { stations: vec![Station { position_m, radius_m }], direction }
    }

    /// Goes straight on; the radius changes smoothly.
    pub fn straight(mut self, length_m: f64, radius_m: f64) -> Self {
        let (start, along) = (self.last(), self.direction);
        self.add(length_m, radius_m, |arc_m| start.position_m + along * arc_m);
        self
    }

    /// Goes along an arc of radius `bend_m` through `angle_rad`, towards the part of `towards` that is
    /// across the direction.
    pub fn arc(
        mut self,
        bend_m: f64,
        angle_rad: f64,
        towards: Vector3<f64>,
        radius_m: f64,
    ) -> Self {
        let (start, along) = (self.last(), self.direction);
        let across = (towards - along * along.dot(&towards)).normalize();
        self.add(bend_m * angle_rad, radius_m, |arc_m| {
            let (sin, cos) = (arc_m / bend_m).sin_cos();
            start.position_m + (along * sin + across * (1.0 - cos)) * bend_m
        });
        let (sin, cos) = angle_rad.sin_cos();
        self.direction = along * cos + across * sin;
        self
    }

    /// Widens (or narrows) by a bell of height `by_m` around an arc length, falling to 1/√e in `sd_m`.
    pub fn wider_around(mut self, arc_m: f64, by_m: f64, sd_m: f64) -> Self {
        let arcs = arcs_m(&self.stations);
        for (station, own_m) in self.stations.iter_mut().zip(arcs) {
            let off = (own_m - arc_m) / sd_m;
            station.radius_m += by_m * (-0.5 * off * off).exp();
        }
        self
    }

    /// Where it has come to, and which way it goes there.
    pub fn end(&self) -> (Vector3<f64>, Unit<Vector3<f64>>) {
        (self.last().position_m, Unit::new_normalize(self.direction))
    }

    /// Its stations.
    pub fn stations(self) -> Vec<Station> {
        self.stations
    }

    fn last(&self) -> Station {
        self.stations[self.stations.len() - 1]
    }

    fn add(&mut self, length_m: f64, radius_m: f64, at: impl Fn(f64) -> Vector3<f64>) {
        let from_m = self.last().radius_m;
        let count = (length_m / SPACING_M).ceil().max(1.0);
        for k in 1..=count as usize {
            let share = k as f64 / count;
            let eased = 0.5 - 0.5 * (std::f64::consts::PI * share).cos();
            let radius_m = from_m + (radius_m - from_m) * eased;
            self.stations.push(Station { position_m: at(length_m * share), radius_m });
        }
    }
}

/// Arc length of each station along the chords between them \[m\].
pub fn arcs_m(stations: &[Station]) -> Vec<f64> {
    let mut arc_m = 0.0;
    let mut before = stations.first().map(|station| station.position_m).unwrap_or_default();
    let along = stations.iter().map(|station| {
        arc_m += (station.position_m - before).norm();
        before = station.position_m;
        arc_m
    });
    along.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_beyond_a_right_angle_goes_on_round() {
        let path = Path::from(Vector3::zeros(), Vector3::x(), 4e-3).arc(
            0.02,
            std::f64::consts::PI,
            Vector3::new(0.5, 1.0, 0.0),
            3e-3,
        );
        let (end_m, direction) = path.end();
        assert!((end_m - Vector3::new(0.0, 0.04, 0.0)).norm() < 1e-12);
        assert!((direction.into_inner() + Vector3::x()).norm() < 1e-12);
        let stations = path.stations();
        let length_m = arcs_m(&stations)[stations.len() - 1];
        assert!((length_m / (0.02 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{length_m}");
        assert_eq!(stations[stations.len() - 1].radius_m, 3e-3);
    }

    #[test]
    fn a_bulge_is_widest_where_it_is_said() {
        let path = Path::from(Vector3::zeros(), Vector3::x(), 3e-3).straight(0.1, 3e-3);
        let stations = path.wider_around(0.05, 2e-3, 6e-3).stations();
        let widest = stations.iter().max_by(|a, b| a.radius_m.total_cmp(&b.radius_m)).unwrap();
        assert!((widest.position_m.x - 0.05).abs() < 1e-9);
        assert!((widest.radius_m - 5e-3).abs() < 1e-9);
    }
}
