//! The middle of the catheter, to a fraction of a pixel.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::contrast::Contrast;
use super::mask::Thresholds;
use crate::picture::Picture;

/// Reach of the parabola that smooths the centre line, in widths of the catheter: along it, a tip that is
/// bent to a radius of six widths stays within a hundredth of a width.
const SMOOTH_WIDTHS: f64 = 2.0;
/// Weight of a place at which the catheter is not seen, against one where it is.
const UNSEEN: f64 = 1e-3;
/// Rounds in which the line is measured across and smoothed; the second moves it by less than 0.05 px.
const ROUNDS: usize = 2;

/// A centre line from a rough path of pixels, one point a pixel, from the entry to just before the tip.
pub fn centre_line(
    path: &[[f64; 2]],
    contrast: &Contrast,
    thresholds: Thresholds,
    width_px: f64,
) -> Vec<Vector2<f64>> {
    let reach = (SMOOTH_WIDTHS * width_px).max(4.0);
    let rough: Vec<Vector2<f64>> = path.iter().map(|p| Vector2::from(*p)).collect();
    // Thinning leaves an end that points anywhere, half a width before the catheter's. Cutting a whole
    // width makes the parabola reach farther and the tip half as good: 0.145 mm off instead of 0.087 mm.
    let sound = rough.len().saturating_sub((0.5 * width_px).ceil() as usize).max(2);
    let mut line = resampled(&smooth(&rough[..sound.min(rough.len())], None, reach), 1.0);
    for _ in 0..ROUNDS {
        let measured: Vec<_> = (0..line.len())
            .map(|i| {
                let normal = normal(&line, i);
                match across(&contrast.smooth, line[i], normal, width_px, thresholds.low) {
                    Some((offset_px, weight)) => (line[i] + offset_px * normal, weight),
                    None => (line[i], UNSEEN),
                }
            })
            .collect();
        let (points, weights): (Vec<_>, Vec<_>) = measured.into_iter().unzip();
        line = resampled(&smooth(&points, Some(&weights), reach), 1.0);
    }
    line
}

/// The centre of gravity of the contrast across the line, from the line \[px\], and its weight. `None`
/// where no contrast is above `low`.
fn across(
    contrast: &Picture,
    at: Vector2<f64>,
    normal: Vector2<f64>,
    width_px: f64,
    low: f64,
) -> Option<(f64, f64)> {
    const STEP_PX: f64 = 0.5;
    let count = ((width_px + 2.0) / STEP_PX).ceil() as i32;
    let offset = |k: i32| STEP_PX * f64::from(k);
    let value = |k: i32| contrast.sample((at + offset(k) * normal).into());
    let profile: Vec<f64> = (-count..=count).map(value).collect();
    // Another dark thing beside the catheter may be darker: the nearest summit is climbed.
    let mut summit = count as usize;
    while let Some(next) = [summit.wrapping_sub(1), summit + 1]
        .into_iter()
        .filter(|k| profile.get(*k).is_some_and(|there| *there > profile[summit]))
        .max_by(|a, b| profile[*a].total_cmp(&profile[*b]))
    {
        summit = next;
    }
    let peak = profile[summit];
    if peak < low {
        return None;
    }
    // What is below a third of the summit is ground or a neighbour.
    let level = peak / 3.0;
    let first = (0..=summit).rev().take_while(|k| profile[*k] > level).last()?;
    let last = (summit..profile.len()).take_while(|k| profile[*k] > level).last()?;
    let (mut sum, mut moment) = (0.0, 0.0);
    for (k, value) in profile.iter().enumerate().take(last + 1).skip(first) {
        let weight = value - level;
        sum += weight;
        moment += weight * offset(k as i32 - count);
    }
    (sum > 0.0).then(|| (moment / sum, peak))
}

/// Unit normal of a line at one of its points, to the right as seen along it.
fn normal(line: &[Vector2<f64>], i: usize) -> Vector2<f64> {
    let (before, after) = (line[i.saturating_sub(2)], line[(i + 2).min(line.len() - 1)]);
    let along = (after - before).try_normalize(1e-9).unwrap_or(Vector2::x());
    Vector2::new(-along.y, along.x)
}

/// Each point moved onto the parabola that fits those within `reach` steps best; near ones count more.
fn smooth(points: &[Vector2<f64>], weights: Option<&[f64]>, reach: f64) -> Vec<Vector2<f64>> {
    let n = points.len();
    let span = reach.ceil() as usize;
    (0..n)
        .map(|i| {
            let (mut square, mut x, mut y) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
            for j in i.saturating_sub(span)..(i + span + 1).min(n) {
                let t = (j as f64 - i as f64) / reach;
                let near = (1.0 - t.abs().min(1.0).powi(3)).powi(3);
                let weight = near * weights.map_or(1.0, |weights| weights[j]);
                let row = Vector3::new(1.0, t, t * t);
                square += weight * row * row.transpose();
                x += weight * row * points[j].x;
                y += weight * row * points[j].y;
            }
            let found = square.cholesky().map(|f| Vector2::new(f.solve(&x)[0], f.solve(&y)[0]));
            found.unwrap_or(points[i])
        })
        .collect()
}

/// Points at equal steps along a line, about `step` apart, both ends included.
pub fn resampled(line: &[Vector2<f64>], step: f64) -> Vec<Vector2<f64>> {
    let lengths = arc(line);
    let total = lengths.last().copied().unwrap_or(0.0);
    let count = (total / step).round().max(1.0) as usize;
    (0..=count).map(|k| at_arc(line, &lengths, total * k as f64 / count as f64)).collect()
}

/// Length along a line up to each of its points.
pub fn arc<const N: usize>(line: &[nalgebra::SVector<f64, N>]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = line.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    std::iter::once(0.0)
        .chain(steps.map(|step| {
            sum += step;
            sum
        }))
        .collect()
}

/// The point at a length along a line of at least one point.
pub fn at_arc<const N: usize>(
    line: &[nalgebra::SVector<f64, N>],
    lengths: &[f64],
    at: f64,
) -> nalgebra::SVector<f64, N> {
    let next = lengths.partition_point(|length| *length < at).clamp(1, line.len().max(2) - 1);
    let (Some(from), Some(to)) = (line.get(next - 1), line.get(next)) else { return line[0] };
    let span = lengths[next] - lengths[next - 1];
    let share = if span > 0.0 { (at - lengths[next - 1]) / span } else { 0.0 };
    from + share * (to - from)
}

/// Half of the width over which the end's contrast is averaged, in widths: a round end is there no more
/// than 2 % of a width shorter than at its middle.
const END_HALF_WIDTHS: f64 = 0.25;
/// The end lies so far ahead of a thinned line at most, in widths.
const END_AHEAD_WIDTHS: f64 = 3.0;

/// Continues a line to where the catheter ends: its contrast falls to half there.
///
/// Returns `None` if it does not fall, because the line is not at an end, or the picture is.
pub fn with_end(
    line: &[Vector2<f64>],
    contrast: &Contrast,
    width_px: f64,
) -> Option<Vec<Vector2<f64>>> {
    const STEP_PX: f64 = 0.25;
    // A parabola over the last four widths goes on as the tip bends.
    let count = ((4.0 * width_px).ceil() as usize).clamp(3, line.len().max(3));
    let last = line.len().checked_sub(count)?;
    let ahead = Extrapolation::of(&line[last..])?;
    let value = |s: f64| {
        let (at, normal) = (ahead.at(s), ahead.normal(s));
        let across = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|k| k * END_HALF_WIDTHS * width_px);
        let values = across.map(|n| contrast.sharp.sample((at + n * normal).into()));
        values.iter().sum::<f64>() / values.len() as f64
    };
    let mut inside: Vec<f64> =
        (0..=8).map(|k| value(-2.0 * width_px * f64::from(k) / 8.0)).collect();
    inside.sort_by(f64::total_cmp);
    let half = 0.5 * inside[inside.len() / 2];
    let most = (END_AHEAD_WIDTHS * width_px / STEP_PX) as i32;
    let start = -(0.5 * width_px / STEP_PX) as i32;
    let mut before = value(STEP_PX * f64::from(start));
    for k in start + 1..=most {
        let here = value(STEP_PX * f64::from(k));
        if here < half && before >= half {
            let end = STEP_PX * (f64::from(k) - (half - here) / (before - here));
            if !contrast.sharp.contains(ahead.at(end).into(), 2.0) {
                return None;
            }
            let mut whole = line.to_vec();
            // Points beyond the end go; those up to it come.
            let beyond = (-end).max(0.0).ceil() as usize;
            whole.truncate(whole.len() - beyond.min(count - 2));
            let from = -(beyond as f64);
            whole.extend(
                (1..).map(|i| from + f64::from(i)).take_while(|s| *s < end).map(|s| ahead.at(s)),
            );
            whole.push(ahead.at(end));
            return Some(whole);
        }
        before = here;
    }
    None
}

/// A parabola through the last points of a line, which are one pixel apart; s = 0 at the last.
struct Extrapolation {
    x: Vector3<f64>,
    y: Vector3<f64>,
}

impl Extrapolation {
    fn of(points: &[Vector2<f64>]) -> Option<Self> {
        let (mut square, mut x, mut y) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
        for (i, point) in points.iter().enumerate() {
            let s = i as f64 + 1.0 - points.len() as f64;
            let row = Vector3::new(1.0, s, s * s);
            square += row * row.transpose();
            x += row * point.x;
            y += row * point.y;
        }
        let factor = square.cholesky()?;
        Some(Self { x: factor.solve(&x), y: factor.solve(&y) })
    }

    fn at(&self, s: f64) -> Vector2<f64> {
        let row = Vector3::new(1.0, s, s * s);
        Vector2::new(self.x.dot(&row), self.y.dot(&row))
    }

    fn normal(&self, s: f64) -> Vector2<f64> {
        let row = Vector3::new(0.0, 1.0, 2.0 * s);
        Vector2::new(-self.y.dot(&row), self.x.dot(&row)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_left_as_it_is_and_lengths_are_equal() {
        let points: Vec<_> =
            (0..40).map(f64::from).map(|t| Vector2::new(t, 0.02 * t * t)).collect();
        let smoothed = smooth(&points, None, 6.0);
        assert!(points.iter().zip(&smoothed).all(|(a, b)| (a - b).norm() < 1e-9));
        let again = resampled(&points, 0.5);
        let steps: Vec<f64> = again.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-3), "{steps:?}");
        assert_eq!((again[0], again[again.len() - 1]), (points[0], points[39]));
    }

    #[test]
    fn a_place_without_weight_is_carried_over_by_its_neighbours() {
        let mut points: Vec<_> = (0..30).map(|i| Vector2::new(f64::from(i), 5.0)).collect();
        let mut weights = vec![1.0; 30];
        for i in 12..16 {
            (points[i].y, weights[i]) = (8.0, UNSEEN);
        }
        let smoothed = smooth(&points, Some(&weights), 8.0);
        assert!((smoothed[14].y - 5.0).abs() < 0.02, "{}", smoothed[14].y);
    }
}
