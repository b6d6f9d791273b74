//! Wavelet denoising with the universal soft threshold (Donoho and Johnstone 1994; Donoho 1995).
//!
//! Details d become sign(d) max(|d| − λ, 0) with λ = σ √(2 ln n), where n is the number of values and
//! σ the standard deviation of the noise, from the median of the finest details. White noise alone
//! exceeds λ less and less likely as n grows, so that what is left of it is smooth.

use crate::hampel::median;
use crate::noise::MEDIAN;
use crate::wavelet::{Family, Transform};

/// Rows back from which the causal form knows the noise: half a second of a load cell at 1 kHz.
const NOISE_ROWS: usize = 512;

/// A signal without its white noise. Looks at both sides of a row; nothing is late.
pub fn denoise(values: &[f64], family: Family, levels: usize) -> Vec<f64> {
    let mut transform = Transform::of(values, family, levels);
    let mut finest: Vec<f64> = transform.finest().iter().map(|d| d.abs()).collect();
    if finest.is_empty() {
        return values.to_vec();
    }
    let sd = median(&mut finest) / MEDIAN;
    let threshold = sd * universal(values.len());
    for detail in transform.details.iter_mut().flatten() {
        *detail = soft(*detail, threshold);
    }
    transform.inverse()
}

/// The same from this row and those before it, by the redundant Haar transform that looks back only
/// (Renaud, Starck and Murtagh 2005):
///
/// > c_0 = x,   c_{j+1}(t) = ½ (c_j(t) + c_j(t − 2^j)),   d_{j+1} = c_j − c_{j+1},   x = c_J + Σ d_j
///
/// What exceeds the threshold passes at once; the rest is the mean over the last 2^J rows and hence
/// late by (2^J − 1)/2 rows. White noise of standard deviation σ is one of σ/√2^j in d_j. σ is that of
/// the last 512 rows.
pub fn denoise_causally(values: &[f64], levels: usize) -> Vec<f64> {
    let mut averages = values.to_vec();
    let mut thresholds: Vec<f64> = Vec::new();
    let mut kept = vec![0.0; values.len()];
    for level in 0..levels {
        let back = 1 << level;
        let next: Vec<f64> = (0..averages.len())
            .map(|t| 0.5 * (averages[t] + averages[t.saturating_sub(back)]))
            .collect();
        let details: Vec<f64> = averages.iter().zip(&next).map(|(c, n)| c - n).collect();
        if level == 0 {
            thresholds = running_thresholds(&details);
        }
        let smaller = ((2 << level) as f64).sqrt().recip();
        for ((kept, detail), threshold) in kept.iter_mut().zip(&details).zip(&thresholds) {
            *kept += soft(*detail, smaller * threshold);
        }
        averages = next;
    }
    averages.iter().zip(&kept).map(|(average, kept)| average + kept).collect()
}

/// λ at every row, from the finest details up to it.
fn running_thresholds(finest: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = Vec::with_capacity(NOISE_ROWS + 1);
    let place = |sorted: &[f64], x: f64| sorted.partition_point(|y| *y < x);
    let threshold = |t: usize| {
        let own = finest[t].abs();
        sorted.insert(place(&sorted, own), own);
        if t >= NOISE_ROWS {
            let old = finest[t - NOISE_ROWS].abs();
            sorted.remove(place(&sorted, old));
        }
        let middle = 0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]);
        2.0_f64.sqrt() * middle / MEDIAN * universal(sorted.len())
    };
    (0..finest.len()).map(threshold).collect()
}

/// λ/σ of so many values.
fn universal(count: usize) -> f64 {
    (2.0 * (count.max(1) as f64).ln()).sqrt()
}

fn soft(detail: f64, threshold: f64) -> f64 {
    (detail.abs() - threshold).max(0.0).copysign(detail)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Of standard deviation 1, by twelve uniform numbers.
    fn noise(count: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let one = |_| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        (0..count).map(one).collect()
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0), |(sum, n), x| (sum + x * x, n + 1));
        (sum / f64::from(count)).sqrt()
    }

    fn left(found: &[f64], truth: &[f64]) -> f64 {
        rms(found.iter().zip(truth).map(|(a, b)| a - b))
    }

    #[test]
    fn a_slow_wave_comes_out_of_noise() {
        let wave: Vec<f64> = (0..2000).map(|i| 5.0 * (0.01 * f64::from(i)).sin()).collect();
        let measured: Vec<f64> = wave.iter().zip(noise(2000)).map(|(w, n)| w + 0.1 * n).collect();
        let found = denoise(&measured, Family::Sym4, 5);
        let off = left(&found, &wave);
        assert!(off < 0.035, "{off}: a third of the noise is left at most");
        let causal = denoise_causally(&measured, 3);
        let off = left(&causal[20..], &wave[20..]);
        // 3.5 rows late on a slope of 0.05 a row at most.
        assert!(off < 0.15, "{off}");
    }

    #[test]
    fn a_straight_line_without_noise_stays_and_a_jump_passes_at_once() {
        let line: Vec<f64> = (0..300).map(|i| 0.3 * f64::from(i)).collect();
        let found = denoise(&line, Family::Sym4, 4);
        // Away from the ends, where the line is mirrored.
        assert!(left(&found[40..260], &line[40..260]) < 0.05);
        let jump: Vec<f64> =
            noise(800).iter().enumerate().map(|(i, n)| 0.01 * n + (i / 600) as f64).collect();
        let found = denoise_causally(&jump, 4);
        assert!(found[599] < 0.1 && found[600] > 0.8, "{} {}", found[599], found[600]);
    }

    #[test]
    fn the_causal_form_knows_nothing_of_later_rows() {
        let values = noise(1500);
        let (whole, part) = (denoise_causally(&values, 4), denoise_causally(&values[..900], 4));
        assert_eq!(whole[..900], part);
        // Of white noise, almost nothing but the mean over sixteen rows is left.
        let spread = rms(whole[600..].iter().copied());
        assert!((spread - 0.25).abs() < 0.08, "{spread}");
    }

    #[test]
    fn nothing_is_done_on_no_levels_or_to_nothing() {
        let values = noise(10);
        assert_eq!(denoise(&values, Family::Db4, 0), values);
        assert_eq!(denoise_causally(&values, 0), values);
        assert!(denoise(&[], Family::Haar, 3).is_empty());
    }
}
