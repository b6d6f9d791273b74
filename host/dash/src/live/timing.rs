//! How old what is shown is, stage by stage.

use std::collections::VecDeque;

use cathforce_recording::latency::Spread;
use serde::Serialize;

/// Ticks over which times are summed up: two seconds.
const WINDOW: usize = 2000;
/// Width of a bin of the histogram \[ms\]; the last bin holds everything above.
pub const BIN_MS: f64 = 1.0;
const BINS: usize = 51;

/// The times of one stage, the newest last \[s\].
#[derive(Default)]
pub struct Times(VecDeque<f64>);

impl Times {
    pub fn push(&mut self, time_s: f64) {
        if self.0.len() == WINDOW {
            self.0.pop_front();
        }
        self.0.push_back(time_s);
    }

    /// `None` before the first.
    pub fn stage(&self, name: &'static str, what: &'static str) -> Option<Stage> {
        let spread = Spread::of(self.0.iter().copied().collect())?;
        let ms = |s: f64| 1e3 * s;
        let mut bins = vec![0; BINS];
        for time_s in &self.0 {
            let bin = (ms(*time_s) / BIN_MS).max(0.0) as usize;
            bins[bin.min(BINS - 1)] += 1;
        }
        Some(Stage {
            name,
            what,
            p50_ms: ms(spread.p50_s),
            p99_ms: ms(spread.p99_s),
            max_ms: ms(spread.max_s),
            bins,
        })
    }
}

/// A stage of the way from the encoder to the browser.
#[derive(Clone, Debug, Serialize)]
pub struct Stage {
    pub name: &'static str,
    pub what: &'static str,
    pub p50_ms: f64,
    pub p99_ms: f64,
    pub max_ms: f64,
    pub bins: Vec<u32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_in_one_bin_and_old_times_are_forgotten() {
        let mut times = Times::default();
        assert!(times.stage("a", "b").is_none());
        times.push(9.0);
        (0..WINDOW).for_each(|i| times.push(1e-3 * (i % 3) as f64 + 1e-4));
        times.push(1.0);
        let stage = times.stage("a", "b").unwrap();
        assert_eq!(stage.bins.iter().sum::<u32>() as usize, WINDOW);
        assert_eq!((stage.bins[3], stage.bins[BINS - 1]), (0, 1));
        assert_eq!(stage.max_ms, 1000.0, "the 9 s are forgotten");
    }
}
