//! When packets were measured, by this computer's clock.
//!
//! The sensor measures at a steady rate, and the network and this computer delay each packet by another
//! time. So a line is laid through the arrivals over the packets' numbers, along those that came fastest.

/// Fewest packets that show a rate.
const FEWEST: usize = 50;
/// Share of the packets that come about as fast as they can: the line lies at its border.
const FASTEST: f64 = 0.05;
/// A packet that is later than the fastest by more than this was held up \[s\]: a switch and a thread that
/// waits for a processor take less on a computer that has time.
const HELD_UP_S: f64 = 1e-3;

/// The line: when the packet of a number was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Timing {
    /// Time of number 0 \[s\].
    start_s: f64,
    /// Time from one packet to the next \[s\].
    period_s: f64,
    /// Nine of ten packets, and the latest, came later than the line by at most this \[s\].
    pub(super) most_s: f64,
    pub(super) latest_s: f64,
}

impl Timing {
    /// `arrivals`: number of each packet, ascending, and when it arrived \[s\]. `None` for too few.
    pub(super) fn of(arrivals: &[(u64, f64)]) -> Option<Self> {
        if arrivals.len() < FEWEST {
            return None;
        }
        let mut line = fitted(arrivals.iter().copied())?;
        // Those that were held up would bend the line; without them the fastest show better.
        for _ in 0..3 {
            let fastest_s = quantile(&mut residuals(arrivals, line), FASTEST);
            let fast = arrivals.iter().copied();
            let is_fast = |(n, t_s): &(u64, f64)| t_s - at(line, *n) <= fastest_s + HELD_UP_S;
            line = fitted(fast.filter(is_fast))?;
        }
        let mut residuals = residuals(arrivals, line);
        let fastest_s = quantile(&mut residuals, FASTEST);
        let (start_s, period_s) = line;
        Some(Self {
            start_s: start_s + fastest_s,
            period_s,
            most_s: (quantile(&mut residuals, 0.9) - fastest_s).max(0.0),
            latest_s: (quantile(&mut residuals, 1.0) - fastest_s).max(0.0),
        })
    }

    /// When a packet was measured \[s\].
    pub(super) fn at_s(&self, number: u64) -> f64 {
        at((self.start_s, self.period_s), number)
    }

    pub(super) fn rate_hz(&self) -> f64 {
        1.0 / self.period_s
    }
}

fn at((start_s, period_s): (f64, f64), number: u64) -> f64 {
    start_s + period_s * number as f64
}

fn residuals(arrivals: &[(u64, f64)], line: (f64, f64)) -> Vec<f64> {
    arrivals.iter().map(|(n, t_s)| t_s - at(line, *n)).collect()
}

/// The value below which this share of the values is. Sorts them.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (share * values.len().saturating_sub(1) as f64).round() as usize;
    values.get(at).copied().unwrap_or_default()
}

/// Least squares; `None` unless the packets have a rate.
fn fitted(arrivals: impl Iterator<Item = (u64, f64)> + Clone) -> Option<(f64, f64)> {
    let count = arrivals.clone().count() as f64;
    let (n, t) = arrivals.clone().fold((0.0, 0.0), |(n, t), (m, s)| (n + m as f64, t + s));
    let (n, t) = (n / count, t / count);
    let (nn, nt) = arrivals.fold((0.0, 0.0), |(nn, nt), (m, s)| {
        let d = m as f64 - n;
        (nn + d * d, nt + d * (s - t))
    });
    let period_s = nt / nn;
    (period_s.is_finite() && period_s > 0.0).then_some((t - period_s * n, period_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1000 Hz and 40 ppm, a delay of 0.2 ms with a tail, packets lost, and a computer that stood still.
    #[test]
    fn the_line_is_that_of_the_fastest_packets() {
        let measured_s = |n: u64| 5.0 + 1e-3 * (1.0 + 40e-6) * n as f64;
        let delay_s = |n: u64| match n {
            4000..4200 => 0.2 - 1e-3 * (n - 4000) as f64,
            _ => 2e-4 + 1e-4 * ((n * 7919) % 13) as f64 / 13.0,
        };
        let numbers = (0..20_000).filter(|n| n % 11 != 0);
        let arrivals = numbers.map(|n| (n, measured_s(n) + delay_s(n).max(2e-4)));
        let timing = Timing::of(&arrivals.collect::<Vec<_>>()).unwrap();
        for n in [0, 4100, 19_999] {
            let late_s = timing.at_s(n) - measured_s(n);
            assert!((late_s - 2e-4).abs() < 5e-5, "{n}: {late_s}");
        }
        assert!((timing.rate_hz() - 999.96).abs() < 0.01, "{timing:?}");
        assert!((0.19..0.21).contains(&timing.latest_s) && timing.most_s < 1e-3, "{timing:?}");
        assert_eq!(Timing::of(&[(0, 0.0), (1, 0.001)]), None);
        assert_eq!(Timing::of(&[(3, 1.0); 60]), None);
    }
}
