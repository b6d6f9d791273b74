//! The wall: a smooth union of tubes, with its distance, gradient and curvature in closed form.

use nalgebra::{Matrix3, Vector3};

use crate::curve::Tube;

/// The wall as seen from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallPoint {
    /// Signed distance \[m\], positive inside the lumen.
    pub distance_m: f64,
    /// Gradient of the distance, into the lumen; of unit length except where tubes blend.
    pub gradient: Vector3<f64>,
    /// Second derivatives of the distance \[1/m\].
    pub hessian: Matrix3<f64>,
    /// How far past an open end the point lies \[m\]; 0 beside the wall.
    pub beyond_m: f64,
}

/// The inside of a vessel.
#[derive(Clone, Debug)]
pub struct Lumen {
    tubes: Vec<Tube>,
    blend_m: f64,
    offset_m: Vector3<f64>,
}

impl Lumen {
    /// One tube.
    pub fn tube(tube: Tube) -> Self {
        Self::union(vec![tube], 0.0)
    }

    /// The union of tubes, whose edges are rounded where two distances differ by less than
    /// `blend_m`.
    pub fn union(tubes: Vec<Tube>, blend_m: f64) -> Self {
        Self { tubes, blend_m, offset_m: Vector3::zeros() }
    }

    /// No wall at all.
    pub fn open() -> Self {
        Self::union(Vec::new(), 0.0)
    }

    /// The same wall, displaced from its tubes by this vector \[m\].
    pub fn at(mut self, offset_m: Vector3<f64>) -> Self {
        self.offset_m = offset_m;
        self
    }

    /// Displacement of the wall from its tubes \[m\].
    pub fn offset_m(&self) -> Vector3<f64> {
        self.offset_m
    }

    /// The tubes of the union.
    pub fn tubes(&self) -> &[Tube] {
        &self.tubes
    }

    /// The wall as seen from `p` \[m\].
    pub fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        let p = p - self.offset_m;
        let mut walls = self.tubes.iter().map(|tube| wall_of(tube, &p));
        let free = WallPoint {
            distance_m: f64::INFINITY,
            gradient: Vector3::zeros(),
            hessian: Matrix3::zeros(),
            beyond_m: 0.0,
        };
        let Some(first) = walls.next() else { return free };
        walls.fold(first, |a, b| blended(&a, &b, self.blend_m))
    }

    /// Lowest and highest corner of a box around the tubes, their open ends included \[m\].
    pub fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        let far = Vector3::repeat(f64::INFINITY);
        let stations = self.tubes.iter().flat_map(Tube::stations);
        stations.fold((far, -far), |(low, high), station| {
            let (centre, reach) =
                (station.position_m + self.offset_m, Vector3::repeat(station.radius_m));
            (low.inf(&(centre - reach)), high.sup(&(centre + reach)))
        })
    }
}

/// With d = max_u g(u, p), g = r(u) − |p − c(u)|: ∇d = g_p and ∇²d = g_pp − g_pu g_puᵀ/g_uu.
fn wall_of(tube: &Tube, p: &Vector3<f64>) -> WallPoint {
    let depth = tube.depth(p);
    let across = Matrix3::identity() - depth.outwards * depth.outwards.transpose();
    let mut hessian = -across / depth.off_axis;
    if depth.sharpness.is_finite() && depth.sharpness < 0.0 {
        hessian -= depth.drift * depth.drift.transpose() / depth.sharpness;
    }
    WallPoint {
        distance_m: depth.distance,
        gradient: -depth.outwards,
        hessian,
        beyond_m: depth.beyond,
    }
}

/// Smooth maximum: quadratic where the two differ by less than `blend`.
fn blended(a: &WallPoint, b: &WallPoint, blend: f64) -> WallPoint {
    let difference = a.distance_m - b.distance_m;
    let deeper = if difference >= 0.0 { a } else { b };
    if difference.abs() >= blend {
        return *deeper;
    }
    let share = 0.5 * (1.0 + difference / blend);
    let apart = a.gradient - b.gradient;
    let gap = blend - difference.abs();
    WallPoint {
        distance_m: deeper.distance_m + 0.25 * gap * gap / blend,
        gradient: a.gradient * share + b.gradient * (1.0 - share),
        hessian: a.hessian * share
            + b.hessian * (1.0 - share)
            + apart * apart.transpose() * (0.5 / blend),
        beyond_m: deeper.beyond_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Station, TubePath};

    fn branched() -> Lumen {
        let trunk = TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3)
            .straight(0.04, 5e-3)
            .arc(0.04, 1.0, Vector3::y(), 3e-3)
            .tube();
        let branch = TubePath::from(Vector3::new(0.03, 0.0, 0.0), Vector3::x(), 4e-3)
            .arc(0.03, 0.8, -Vector3::y(), 2e-3)
            .straight(0.02, 2e-3)
            .tube();
        Lumen::union(vec![trunk, branch], 1e-3)
    }

    #[test]
    fn gradient_and_curvature_are_those_of_the_distance() {
        let lumen = branched();
        for p in [
            [0.021, 3.1e-3, 2.2e-3],
            [0.055, 8.0e-3, 2.0e-3],
            [0.045, 0.4e-3, 2.3e-3],
            [0.060, -10e-3, -1.1e-3],
            [-0.01, 2e-3, -3e-3],
        ] {
            let p = Vector3::from(p);
            let here = lumen.sample(&p);
            let h = 1e-6;
            for axis in 0..3 {
                let step = Vector3::ith(axis, h);
                let (ahead, back) = (lumen.sample(&(p + step)), lumen.sample(&(p - step)));
                let slope = (ahead.distance_m - back.distance_m) / (2.0 * h);
                assert!((slope - here.gradient[axis]).abs() < 1e-5, "{p} {axis}");
                let bend = (ahead.gradient - back.gradient) / (2.0 * h);
                let error = (bend - here.hessian.column(axis)).norm();
                assert!(error < 1e-3 * here.hessian.norm(), "{p} {axis}: {error}");
            }
        }
    }

    #[test]
    fn an_arc_is_an_arc_and_a_taper_leans() {
        let arc = TubePath::from(Vector3::zeros(), Vector3::x(), 3e-3)
            .arc(0.05, 1.2, Vector3::y(), 3e-3)
            .tube();
        let lumen = Lumen::tube(arc);
        for angle in [0.05, 0.33, 0.71, 1.1] {
            let off_axis: f64 = 1.7e-3;
            let radius = 0.05 + off_axis;
            let p = Vector3::new(radius * f64::sin(angle), 0.05 - radius * f64::cos(angle), 0.0);
            let error = lumen.sample(&p).distance_m - (3e-3 - off_axis);
            assert!(error.abs() < 1e-10, "{angle}: {error}");
        }
        // A cone between radii a and b over length l leans by asin((a − b)/l).
        let cone = TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3).straight(0.1, 3e-3).tube();
        let here = Lumen::tube(cone).sample(&Vector3::new(0.05, 2e-3, 0.0));
        assert!((here.gradient.x + 0.02).abs() < 1e-9, "{}", here.gradient);
    }

    #[test]
    fn a_curve_through_stations_meets_them() {
        let stations: Vec<Station> = (0..12)
            .map(|i| {
                let a = 0.1 * f64::from(i);
                let position_m = Vector3::new(0.05 * a.sin(), 0.05 - 0.05 * a.cos(), 0.0);
                Station { position_m, radius_m: 3e-3 }
            })
            .collect();
        let lumen = Lumen::tube(Tube::through(&stations).unwrap());
        let error =
            lumen.sample(&Vector3::new(0.05 * 0.55f64.sin(), 0.05 - 0.05 * 0.55f64.cos(), 2e-3));
        assert!((error.distance_m - 1e-3).abs() < 2e-7, "{}", error.distance_m);
        assert!(Tube::through(&stations[..1]).is_none());
    }

    #[test]
    fn a_closed_end_is_a_half_sphere_and_an_open_one_goes_on() {
        let tube = TubePath::from(Vector3::zeros(), Vector3::x(), 3e-3).straight(0.04, 3e-3).tube();
        let lumen = Lumen::tube(tube.with_open_ends([true, false]));
        let at = |x: f64| lumen.sample(&Vector3::new(x, 1e-3, 0.0)).distance_m;
        for (x, distance_m) in [(-0.1, 2e-3), (0.02, 2e-3), (0.042, 3e-3 - 5f64.sqrt() * 1e-3)] {
            assert!((at(x) - distance_m).abs() < 1e-12, "{x}: {}", at(x));
        }
    }
}
