//! Loops of a tendon that follow a recorded drive.

use cathforce_mechanics::{DescriptionError, Lumen};

use crate::hysteresis::PulledTip;
use crate::tendon::{LoopRecord, TendonValues};

/// Time in which a drive is brought from zero to where a record begins \[s\]: a way of the usual pace.
const LEAD_S: f64 = 1.0;

impl LoopRecord {
    /// What a tendon with these values makes of the same drive, at the same times. `step_s`: between
    /// samples of the record.
    pub fn replayed(
        &self,
        step_s: f64,
        values: &TendonValues,
        rest: &PulledTip,
        lumen: &Lumen<'_>,
    ) -> Result<Self, DescriptionError> {
        let description = values.description(rest.description());
        let tick_s = description.solver.tick_s;
        let mut tip = rest.with(description)?;
        let begin_m = self.tendon_m.first().copied().unwrap_or(0.0);
        let lead = if begin_m == 0.0 { 0 } else { (LEAD_S / tick_s).ceil() as usize };
        let led = (1..=lead).map(|k| begin_m * k as f64 / lead as f64);
        let last = self.tendon_m.len().saturating_sub(1);
        let ticks = (last as f64 * step_s / tick_s).ceil() as usize + 1;
        // The model's tip follows a tick late: it is driven a tick ahead.
        let played = (1..=ticks).map(|k| between(&self.tendon_m, k as f64 * tick_s / step_s));
        let drive_m: Vec<f64> = led.chain(played).collect();
        let all_m = tip.pull(lumen, &drive_m);
        let at = |k: usize| between(&all_m[lead..], k as f64 * step_s / tick_s);
        Ok(Self { tendon_m: self.tendon_m.clone(), tip_m: (0..=last).map(at).collect() })
    }
}

/// A sampled signal at an index with its fraction, between two samples by a straight line; beyond its
/// ends it stays.
pub(crate) fn between(signal: &[f64], at: f64) -> f64 {
    let Some(last) = signal.len().checked_sub(1) else { return 0.0 };
    let index = (at.floor() as usize).min(last);
    let next = (index + 1).min(last);
    let share = (at - index as f64).clamp(0.0, 1.0);
    signal[index] + share * (signal[next] - signal[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_straight_between_its_samples_and_stays_beyond() {
        let signal = [0.0, 1.0, 3.0];
        assert_eq!(
            [0.0, 0.25, 1.5, 2.0, 7.0].map(|at| between(&signal, at)),
            [0.0, 0.25, 2.0, 3.0, 3.0]
        );
        assert_eq!(between(&[], 1.0), 0.0);
    }
}
