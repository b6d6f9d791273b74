//! Filters of grey pictures.

use crate::picture::Picture;

/// Blurs with a Gaussian of standard deviation `sigma_px`; the border's values continue outside.
pub fn blur(picture: &Picture, sigma_px: f64) -> Picture {
    // Beyond three standard deviations lie 0.3 % of a Gaussian.
    let reach = (3.0 * sigma_px).ceil() as usize;
    let weight = |i: usize| (-0.5 * ((i as f64 - reach as f64) / sigma_px).powi(2)).exp() as f32;
    let mut kernel: Vec<f32> = (0..=2 * reach).map(weight).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|weight| *weight /= sum);
    let (width, height) = (picture.width, picture.height);
    let mut across = Picture::uniform(width, height, 0.0);
    let mut padded = vec![0.0; width + 2 * reach];
    for (row, out) in picture.grey.chunks(width).zip(across.grey.chunks_mut(width)) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + width].copy_from_slice(row);
        padded[reach + width..].fill(row[width - 1]);
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(out, x)| *out += weight * x);
        }
    }
    let mut both = Picture::uniform(width, height, 0.0);
    for (y, out) in both.grey.chunks_mut(width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let from = (y + k).saturating_sub(reach).min(height - 1);
            let row = &across.grey[from * width..][..width];
            out.iter_mut().zip(row).for_each(|(out, x)| *out += weight * x);
        }
    }
    both
}

/// Grey closing with a square of `2 reach + 1` pixels: dark things narrower than the square vanish.
pub fn closing(picture: &Picture, reach: usize) -> Picture {
    least(&greatest(picture, reach), reach)
}

/// Grey opening with a square of `2 reach + 1` pixels: bright things narrower than the square vanish.
pub fn opening(picture: &Picture, reach: usize) -> Picture {
    greatest(&least(picture, reach), reach)
}

fn greatest(picture: &Picture, reach: usize) -> Picture {
    sliding(picture, reach, |a, b| if a > b { a } else { b })
}

fn least(picture: &Picture, reach: usize) -> Picture {
    sliding(picture, reach, |a, b| if a < b { a } else { b })
}

/// The choice of `of` over a square around each pixel.
///
/// A window is doubled until it is as large as asked for, so that the cost grows with the logarithm
/// of its size and each step works on whole rows.
fn sliding(picture: &Picture, reach: usize, of: impl Fn(f32, f32) -> f32 + Copy) -> Picture {
    let (width, height, window) = (picture.width, picture.height, 2 * reach + 1);
    let mut out = picture.clone();
    let mut padded = vec![0.0; width + 2 * reach];
    for row in out.grey.chunks_mut(width) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + width].copy_from_slice(row);
        padded[reach + width..].fill(row[width - 1]);
        for step in steps(window) {
            for i in 0..padded.len() - step {
                padded[i] = of(padded[i], padded[i + step]);
            }
        }
        row.copy_from_slice(&padded[..width]);
    }
    let rows = height + 2 * reach;
    let mut tall = Vec::with_capacity(rows * width);
    for y in 0..rows {
        let from = y.saturating_sub(reach).min(height - 1);
        tall.extend_from_slice(&out.grey[from * width..][..width]);
    }
    for step in steps(window) {
        for y in 0..rows - step {
            let (upper, lower) = tall.split_at_mut((y + step) * width);
            let row = &mut upper[y * width..][..width];
            row.iter_mut().zip(&lower[..width]).for_each(|(a, b)| *a = of(*a, *b));
        }
    }
    tall.truncate(width * height);
    Picture { width, height, grey: tall }
}

/// Shifts that grow a window from one value to `window`.
fn steps(window: usize) -> impl Iterator<Item = usize> {
    let mut have = 1;
    std::iter::from_fn(move || {
        let step = have.min(window - have);
        have += step;
        (step > 0).then_some(step)
    })
}

/// The value below which a share of the others lies.
pub fn quantile(values: &mut [f32], share: f64) -> f32 {
    let at = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(width: usize, height: usize) -> Picture {
        use rand::{Rng, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let grey = (0..width * height).map(|_| random.random_range(0.0..255.0)).collect();
        Picture { width, height, grey }
    }

    #[test]
    fn a_sliding_extreme_is_that_of_each_square() {
        let picture = random(17, 11);
        for reach in [1, 2, 3, 6] {
            let found = greatest(&picture, reach);
            for y in 0..11_usize {
                for x in 0..17_usize {
                    let rows = y.saturating_sub(reach)..=(y + reach).min(10);
                    let square = rows.flat_map(|v| {
                        (x.saturating_sub(reach)..=(x + reach).min(16)).map(move |u| (u, v))
                    });
                    let expected = square.map(|(u, v)| picture.at(u, v)).fold(0.0, f32::max);
                    assert_eq!(found.at(x, y), expected, "{x} {y} {reach}");
                }
            }
        }
    }

    #[test]
    fn a_blur_keeps_the_mean_and_has_the_variance_of_its_kernel() {
        let mut picture = Picture::uniform(41, 41, 0.0);
        picture.grey[20 * 41 + 20] = 1000.0;
        let blurred = blur(&picture, 2.0);
        let sum: f32 = blurred.grey.iter().sum();
        assert!((sum - 1000.0).abs() < 0.1, "{sum}");
        let second: f32 = (0..41)
            .map(|x| (x as f32 - 20.0).powi(2) * (0..41).map(|y| blurred.at(x, y)).sum::<f32>())
            .sum();
        assert!((second / sum - 4.0).abs() < 0.15, "{}", second / sum);
    }

    #[test]
    fn closing_removes_a_thin_dark_line_and_leaves_a_step() {
        let mut picture = Picture::uniform(40, 20, 200.0);
        for y in 0..20 {
            picture.grey[y * 40 + 10] = 50.0;
            picture.grey[y * 40 + 30..][..10].fill(90.0);
        }
        let closed = closing(&picture, 3);
        assert_eq!((closed.at(10, 10), closed.at(35, 10), closed.at(29, 10)), (200.0, 90.0, 200.0));
    }
}
