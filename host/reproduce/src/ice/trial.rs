//! One search of a trial, and what trials make of a parameter.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::anyhow;
use cathforce_calibration::Parameter;
use cathforce_identification::{Effort, Experiment, Identified, Measured, SearchError, identify};

use crate::meter::{Meter, Trouble};

/// Identifies parameters. `work` of the meter: of a coarse and of a fine simulation.
pub fn search(
    parameters: &[Parameter],
    experiment: &dyn Experiment,
    measured: &Measured,
    effort: Effort,
    meter: &Meter,
    work: [u64; 2],
) -> Result<Identified, Trouble> {
    let stopped = AtomicBool::new(false);
    let tell = |fine: bool| {
        if meter.add(work[usize::from(fine)]).is_err() {
            stopped.store(true, Ordering::Relaxed);
        }
    };
    identify(parameters, experiment, measured, effort, &stopped, &tell).map_err(|error| match error
    {
        SearchError::Interrupted => Trouble::Stopped,
        _ if meter.is_stopped() => Trouble::Stopped,
        error => Trouble::Failed(anyhow!("the search: {error}")),
    })
}

/// Largest error of one parameter over trials, over its true value \[1\].
pub fn worst_error(found: &[f64], truth: &[f64]) -> f64 {
    let each = found.iter().zip(truth).map(|(found, truth)| (found / truth - 1.0).abs());
    each.fold(0.0, f64::max)
}

/// Which pairs of parameters trials do not tell apart, with the largest correlation of each.
pub fn pairs(all: &[Identified]) -> String {
    let mut named: Vec<(String, f64)> = Vec::new();
    for pair in all.iter().flat_map(|own| &own.inseparable) {
        let name = format!("{} and {}", pair.first, pair.second);
        match named.iter_mut().find(|(known, _)| *known == name) {
            Some((_, most)) if most.abs() < pair.correlation.abs() => *most = pair.correlation,
            Some(_) => {}
            None => named.push((name, pair.correlation)),
        }
    }
    let each = named.iter().map(|(name, most)| format!("{name} ({most:.3})"));
    let text = each.collect::<Vec<_>>().join(", ");
    if text.is_empty() { "none".into() } else { text }
}

#[cfg(test)]
mod tests {
    use cathforce_identification::Inseparable;

    use super::*;

    #[test]
    fn pairs_of_all_trials_are_named_once() {
        let of = |correlation| Identified {
            values: Vec::new(),
            sd: Vec::new(),
            told: Vec::new(),
            inseparable: vec![Inseparable { first: "a".into(), second: "b".into(), correlation }],
            cost: 0.0,
            valleys: 1,
            evaluations: [0; 2],
        };
        assert_eq!(pairs(&[of(-0.96), of(-0.98)]), "a and b (-0.980)");
        assert_eq!(pairs(&[]), "none");
        assert!((worst_error(&[1.1, 1.8], &[1.0, 2.0]) - 0.1).abs() < 1e-9);
    }
}
