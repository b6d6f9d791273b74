//! Places where four squares of a checkerboard may meet.

use crate::filter::blur;
use crate::picture::Picture;

/// A crossing of two edges between dark and bright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    pub pixel: [f64; 2],
    /// Directions of the two edges \[rad\], from 0 to π, the smaller first.
    pub edges_rad: [f64; 2],
    /// Whether the sector between the first edge and the second is dark.
    pub is_dark_between: bool,
    /// Difference between the bright and the dark sectors, in grey values.
    pub contrast: f64,
}

/// Blur before second derivatives are taken \[px\]: a webcam's own blur, so that noise is averaged
/// and the squares stay apart.
const BLUR_PX: f64 = 1.5;
/// Radius of the ring on which a crossing shows four sectors \[px\]. Squares must be larger.
const RING_PX: f64 = 5.0;
/// Samples on the ring: one for each pixel of its length.
const RING: usize = 32;
/// Smallest contrast of a crossing: several times the noise of a bright picture.
const LEAST_CONTRAST: f64 = 12.0;
/// The two edges of a board seen at 70° from its normal meet at 20° at least.
const LEAST_ANGLE_RAD: f64 = 0.3;

/// All places that look like a crossing of a checkerboard's edges, to about a pixel.
///
/// A crossing is a saddle of the grey values: the determinant of second derivatives is negative and
/// its size has a local maximum. Source: Chen and Zhang, "A new sub-pixel detector for X-corners in
/// camera calibration targets", 2005. A ring around it shows four sectors, in turn dark and bright.
pub fn candidates(picture: &Picture) -> Vec<Candidate> {
    let smooth = blur(picture, BLUR_PX);
    let saddle = saddles(&smooth);
    let (width, height) = (picture.width, picture.height);
    let border = RING_PX.ceil() as usize + 2;
    if width <= 2 * border || height <= 2 * border {
        return Vec::new();
    }
    let mut found = Vec::new();
    for y in border..height - border {
        for x in border..width - border {
            let here = saddle[y * width + x];
            // A crossing of contrast c has a saddle of about (c / 2 π σ²)² under a blur σ.
            if here > LEAST_SADDLE && is_highest(&saddle, width, [x, y], here) {
                found.extend(crossing(&smooth, [x as f64, y as f64]));
            }
        }
    }
    found
}

/// The saddle of a crossing of the least contrast that counts, under the blur; half of it, because
/// edges need not meet at right angles.
const LEAST_SADDLE: f32 = {
    let slope = LEAST_CONTRAST / (2.0 * std::f64::consts::PI * 2.0 * BLUR_PX * BLUR_PX);
    (0.5 * slope * slope) as f32
};

/// −determinant of the second derivatives.
fn saddles(picture: &Picture) -> Vec<f32> {
    let (width, height) = (picture.width, picture.height);
    let mut saddle = vec![0.0; width * height];
    for y in 1..height - 1 {
        let [above, here, below] =
            [y - 1, y, y + 1].map(|row| &picture.grey[row * width..][..width]);
        let out = &mut saddle[y * width..][..width];
        for x in 1..width - 1 {
            let xx = here[x - 1] - 2.0 * here[x] + here[x + 1];
            let yy = above[x] - 2.0 * here[x] + below[x];
            let xy = 0.25 * (below[x + 1] - below[x - 1] - above[x + 1] + above[x - 1]);
            out[x] = xy * xy - xx * yy;
        }
    }
    saddle
}

/// Whether no value within three pixels is larger; of equal ones the first counts.
fn is_highest(values: &[f32], width: usize, [x, y]: [usize; 2], here: f32) -> bool {
    const REACH: usize = 3;
    (y - REACH..=y + REACH).all(|v| {
        (x - REACH..=x + REACH).all(|u| {
            let there = values[v * width + u];
            there < here || (there == here && (v, u) >= (y, x))
        })
    })
}

/// The sectors around a place, if there are four that alternate.
fn crossing(picture: &Picture, pixel: [f64; 2]) -> Option<Candidate> {
    let angle = |i: f64| i * std::f64::consts::TAU / RING as f64;
    let ring: [f64; RING] = std::array::from_fn(|i| {
        let (sine, cosine) = angle(i as f64).sin_cos();
        picture.sample([pixel[0] + RING_PX * cosine, pixel[1] + RING_PX * sine])
    });
    let (low, high) = ring.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let contrast = high - low;
    if contrast < LEAST_CONTRAST {
        return None;
    }
    let middle = 0.5 * (low + high);
    let mut crossings = Vec::new();
    for i in 0..RING {
        let (a, b) = (ring[i] - middle, ring[(i + 1) % RING] - middle);
        if (a < 0.0) != (b < 0.0) {
            crossings.push((angle(i as f64 + a / (a - b)), b < 0.0));
        }
    }
    let [(a, dark_after_a), (b, _), (c, _), (d, _)] = crossings[..] else { return None };
    // An edge goes straight through: its two ends lie opposite.
    let half = std::f64::consts::PI;
    const MOST_BEND_RAD: f64 = 0.5;
    if (c - a - half).abs() > MOST_BEND_RAD || (d - b - half).abs() > MOST_BEND_RAD {
        return None;
    }
    let edges = [0.5 * (a + c - half), 0.5 * (b + d - half)];
    let between = edges[1] - edges[0];
    if !(LEAST_ANGLE_RAD..=half - LEAST_ANGLE_RAD).contains(&between) {
        return None;
    }
    Some(Candidate { pixel, edges_rad: edges, is_dark_between: dark_after_a, contrast })
}

impl Candidate {
    /// Whether the sector around a direction is dark.
    pub fn is_dark_towards(&self, direction: [f64; 2]) -> bool {
        let half = std::f64::consts::PI;
        let angle = direction[1].atan2(direction[0]).rem_euclid(half);
        let [first, second] = self.edges_rad;
        let is_between = angle > first && angle < second
            || angle - half > first && angle - half < second
            || angle + half > first && angle + half < second;
        is_between == self.is_dark_between
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quarters() -> Picture {
        let mut picture = Picture::uniform(60, 60, 200.0);
        for y in 0..60 {
            for x in 0..60 {
                if (x < 30) == (y < 25) {
                    picture.grey[y * 60 + x] = 40.0;
                }
            }
        }
        picture
    }

    #[test]
    fn a_crossing_is_found_with_its_dark_sectors() {
        let found = candidates(&quarters());
        let [one] = found[..] else { panic!("{found:?}") };
        assert!((one.pixel[0] - 29.5).abs() <= 0.5 && (one.pixel[1] - 24.5).abs() <= 0.5);
        assert!(one.is_dark_towards([-1.0, -1.0]) && one.is_dark_towards([1.0, 1.0]));
        assert!(!one.is_dark_towards([1.0, -1.0]) && !one.is_dark_towards([-1.0, 1.0]));
    }

    #[test]
    fn an_edge_a_spot_and_an_even_picture_hold_no_crossing() {
        assert!(candidates(&Picture::uniform(60, 60, 90.0)).is_empty());
        let mut edge = Picture::uniform(60, 60, 200.0);
        edge.grey[..30 * 60].fill(20.0);
        assert!(candidates(&edge).is_empty());
        let mut spot = Picture::uniform(60, 60, 200.0);
        for y in 28..33 {
            spot.grey[y * 60 + 28..][..5].fill(10.0);
        }
        assert!(candidates(&spot).is_empty());
    }
}
