//! A vessel as a scan shows it: centre line and radii off by smooth random errors.

use cathforce_reference_solver::Station;
use nalgebra::Vector3;
use rand::Rng;

use super::path::arcs_m;
use crate::noise::Noise;

/// Standard deviation of a centre line's place across itself: from half a voxel to one of an angiography
/// by computed tomography \[m\].
const SD_M: [f64; 2] = [1.5e-4, 3e-4];
/// Radii come from the mean of a whole rim, and are off by less.
const RADIUS_SHARE: f64 = 0.6;
/// Arc over which errors are alike: the smoothing of a segmentation \[m\].
const ALIKE_M: [f64; 2] = [6e-3, 1e-2];
/// Error grows from none over this arc, because the entry is where the phantom is held \[m\].
const HELD_M: f64 = 0.01;

/// The scan of a vessel, and the standard deviation of its error \[m\].
pub fn scanned(branches: &[Vec<Station>], rng: &mut impl Rng) -> (Vec<Vec<Station>>, f64) {
    let sd_m = rng.random_range(SD_M[0]..SD_M[1]);
    let alike_m = rng.random_range(ALIKE_M[0]..ALIKE_M[1]);
    let mut noise = Noise::of_seed(rng.random());
    let scan = |stations: &Vec<Station>| {
        let arcs = arcs_m(stations);
        let mut errors = || smooth(&arcs, alike_m, &mut noise);
        let [x, y, z, radius] = [errors(), errors(), errors(), errors()];
        let seen = |(k, station): (usize, &Station)| {
            let grown = (arcs[k] / HELD_M).min(1.0);
            let error = Vector3::new(x[k], y[k], z[k]) * (sd_m * grown);
            let (low, high) = (k.saturating_sub(1), (k + 1).min(stations.len() - 1));
            let along = (stations[high].position_m - stations[low].position_m).normalize();
            Station {
                position_m: station.position_m + error - along * along.dot(&error),
                radius_m: station.radius_m + RADIUS_SHARE * sd_m * grown * radius[k],
            }
        };
        stations.iter().enumerate().map(seen).collect()
    };
    (branches.iter().map(scan).collect(), sd_m)
}

/// Random numbers of standard deviation 1 along an arc, alike over a distance.
fn smooth(arcs_m: &[f64], alike_m: f64, noise: &mut Noise) -> Vec<f64> {
    // White numbers twice as dense as they are blurred, from outside of both ends.
    let step_m = 0.5 * alike_m;
    let length_m = arcs_m.last().copied().unwrap_or_default();
    let count = (length_m / step_m) as i32 + 13;
    let white: Vec<(f64, f64)> =
        (0..count).map(|k| (step_m * f64::from(k - 6), noise.normal())).collect();
    let at = |arc_m: &f64| {
        let weight = |at_m: f64| (-((arc_m - at_m) / alike_m).powi(2)).exp();
        let (mut sum, mut square) = (0.0, 0.0);
        for (at_m, value) in &white {
            sum += weight(*at_m) * value;
            square += weight(*at_m).powi(2);
        }
        sum / square.sqrt()
    };
    arcs_m.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::path::Path;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_scan_is_off_by_as_much_as_it_says_and_smoothly() {
        let path = Path::from(Vector3::zeros(), Vector3::x(), 4e-3).straight(3.0, 4e-3);
        let real = vec![path.stations()];
        let (scan, sd_m) = scanned(&real, &mut ChaCha8Rng::seed_from_u64(2));
        assert!((SD_M[0]..SD_M[1]).contains(&sd_m));
        assert_eq!(scan[0][0], real[0][0], "the entry is held");
        let off = |k: usize| scan[0][k].position_m - real[0][k].position_m;
        let square = |of: &dyn Fn(usize) -> f64| {
            let far = 10..scan[0].len();
            let count = far.len() as f64;
            (far.map(|k| of(k).powi(2)).sum::<f64>() / count).sqrt()
        };
        assert!((square(&|k| off(k).y) / sd_m - 1.0).abs() < 0.15);
        assert!(square(&|k| off(k).x) < 1e-3 * sd_m, "along itself a centre line is the same");
        let radius = square(&|k| scan[0][k].radius_m - real[0][k].radius_m);
        assert!((radius / (RADIUS_SHARE * sd_m) - 1.0).abs() < 0.15, "{radius}");
        // From one station to the next, 2 mm on, it changes by much less.
        assert!(square(&|k| off(k).y - off(k - 1).y) < 0.5 * sd_m);
    }
}
