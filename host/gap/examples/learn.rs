//! Learns the priors of the diagnosis from cases whose causes are known, and tells what each of them is worth.
//!
//! `learn EVIDENCE:LABELS …`: folders with NAME.json as `evidence` writes it, and as `cathforce gap blind-test make`
//! writes labels. Prints the objective with the priors of the product, with each of them switched off or
//! changed by a third, and where a search from there ends.

use std::path::Path;
use std::process::ExitCode;

use cathforce_gap::evidence::discrepancy::{Cell, Evidence, Size};
use cathforce_gap::rules::{Prior, Rules};
use serde_json::Value;

/// A case is as good as lost once its truth has this probability.
const LOST: f64 = 0.03;
/// Gap in floors from which on a case counts.
const VISIBLE: f64 = 1.5;
/// A posterior probability counts as this at most, so that one wrong answer does not decide.
const MOST: f64 = 0.999;
/// Share of its value by which a prior is changed.
const STEP: f64 = 0.33;

fn main() -> ExitCode {
    let pairs: Vec<String> = std::env::args().skip(1).collect();
    let loaded: Result<Vec<Vec<Case>>, String> = pairs.iter().map(|pair| load(pair)).collect();
    match loaded.map(|cases| cases.concat()) {
        Ok(cases) if !cases.is_empty() => {
            tell(&cases);
            ExitCode::SUCCESS
        }
        Ok(_) => {
            eprintln!("learn EVIDENCE:LABELS …: no case was found");
            ExitCode::from(2)
        }
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

/// A set of effects that was fitted to a case.
#[derive(Clone)]
struct Set {
    effects: Vec<String>,
    evidence: Evidence,
    is_at_bound: bool,
}

/// A case with its truth.
#[derive(Clone)]
struct Case {
    kind: String,
    /// In ascending order.
    truth: Vec<String>,
    is_visible: bool,
    sets: Vec<Set>,
    /// Of each effect that was named, the posterior probability and whether it is there.
    named: Vec<(f64, bool)>,
}

fn load(pair: &str) -> Result<Vec<Case>, String> {
    let (evidence, labels) = pair.split_once(':').ok_or_else(|| format!("{pair}: no colon"))?;
    let folder = std::fs::read_dir(evidence).map_err(|why| format!("{evidence}: {why}"))?;
    let mut files: Vec<_> = folder.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|own| own == "json"));
    files.sort();
    files.iter().map(|path| case(path, Path::new(labels))).collect()
}

fn case(path: &Path, labels: &Path) -> Result<Case, String> {
    let read = |path: &Path| -> Result<Value, String> {
        let text =
            std::fs::read_to_string(path).map_err(|why| format!("{}: {why}", path.display()))?;
        serde_json::from_str(&text).map_err(|why| format!("{}: {why}", path.display()))
    };
    let name = path.file_name().ok_or("a file without a name")?;
    let (evidence, label) = (read(path)?, read(&labels.join(name))?);
    let names = |list: &Value| {
        let all = list.as_array().into_iter().flatten();
        let mut names: Vec<String> = all.filter_map(|own| Some(own.as_str()?.to_owned())).collect();
        names.sort();
        names
    };
    let set = |own: &Value| Set {
        effects: names(&own["effects"]),
        evidence: Evidence {
            cells: own["cells"].as_array().into_iter().flatten().map(cell).collect(),
            size: Size {
                bins: own["bins"].as_array().into_iter().flatten().map(count).collect(),
                channels: count(&own["channels"]),
            },
            is_beyond_stated: own["is_beyond_stated"] == true,
        },
        is_at_bound: own["at_bound"] == true,
    };
    let ids: Vec<Value> =
        label["effects"].as_array().into_iter().flatten().map(|own| own["id"].clone()).collect();
    let truth = names(&Value::Array(ids));
    let no_lapse = 1.0 - Rules::USED.confidence.lapse;
    let posterior = |own: &Value| {
        let is_there = truth.iter().any(|id| own["id"] == **id);
        Some((own["confidence"].as_f64()? / no_lapse, is_there))
    };
    let effects = evidence["answer"]["effects"].as_array().into_iter().flatten();
    let gap = label["gap_over_floor"].as_f64().or(label["gap_over_noise"].as_f64());
    Ok(Case {
        kind: label["kind"].as_str().unwrap_or_default().to_owned(),
        is_visible: gap.is_some_and(|gap| gap >= VISIBLE),
        sets: evidence["sets"].as_array().into_iter().flatten().map(set).collect(),
        named: effects.filter_map(posterior).collect(),
        truth,
    })
}

fn cell(own: &Value) -> Cell {
    let at = |i: usize| own[i].as_f64().unwrap_or(f64::NEG_INFINITY);
    let trials = 3..own.as_array().map_or(3, Vec::len);
    Cell {
        amplitude: at(0),
        kappa: at(1),
        looseness: at(2),
        log_densities: trials.map(at).collect(),
    }
}

fn count(own: &Value) -> usize {
    own.as_u64().unwrap_or_default() as usize
}

impl Case {
    /// Probability of each set, without and with a cause outside the library.
    fn posterior(&self, prior: &Prior) -> Vec<[f64; 2]> {
        let of = |set: &Set| {
            let [mine, others] = prior.log_posteriors(&set.evidence, set.effects.len());
            [if set.is_at_bound { f64::NEG_INFINITY } else { mine }, others]
        };
        let all: Vec<[f64; 2]> = self.sets.iter().map(of).collect();
        let most = all.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = all.iter().flatten().map(|own| (own - most).exp()).sum();
        all.iter().map(|own| own.map(|ln| (ln - most).exp() / sum)).collect()
    }

    /// Probability of the truth; half of it where another cause is seen beside it. `None` where no gap shows.
    fn of_truth(&self, prior: &Prior) -> Option<f64> {
        if self.kind != "none" && !self.is_visible {
            return None;
        }
        let posterior = self.posterior(prior);
        if self.kind == "outside" {
            return Some(posterior.iter().map(|own| own[1]).sum());
        }
        let sets = self.sets.iter().zip(&posterior).filter(|(set, _)| set.effects == self.truth);
        Some(sets.map(|(_, [mine, others])| mine + 0.5 * others).sum())
    }
}

/// Mean of −ln P(truth), and how many truths are more probable than not.
fn objective(cases: &[Case], prior: &Prior) -> (f64, usize, usize) {
    let all: Vec<f64> = cases.iter().filter_map(|case| case.of_truth(prior)).collect();
    let loss: f64 = all.iter().map(|own| -(LOST + (1.0 - LOST) * own).ln()).sum();
    let count = all.len();
    (loss / count.max(1) as f64, all.iter().filter(|own| **own > 0.5).count(), count)
}

/// Changes a prior to a multiple of what it is.
type Change = fn(&mut Prior, f64);

/// What may be learned.
const PRIORS: [(&str, Change); 6] = [
    ("median of κ", |own, by| own.kappa.0 *= by),
    ("median of κ with others", |own, by| own.kappa_with_others.0 *= by),
    ("observations of a channel", |own, by| own.of_channel *= by),
    ("temper", |own, by| own.temper *= by),
    ("ln odds of an effect", |own, by| own.of_effect *= by),
    ("ln odds of others", |own, by| own.of_others *= by),
];

/// Switches a prior off.
type Off = fn(&mut Prior);

/// Priors that are switched off one by one.
const OFF: [(&str, Off); 5] = [
    ("a channel may be less", |own| own.of_channel = 0.0),
    ("no temper", |own| own.temper = 1.0),
    ("no cause outside", |own| own.of_others = -1e9),
    ("effects cost nothing", |own| own.of_effect = 0.0),
    ("any share of the gap", |own| own.kappa.1 = 1e3),
];

fn tell(cases: &[Case]) {
    let line = |name: &str, prior: &Prior| {
        let (loss, right, count) = objective(cases, prior);
        println!("{name:<34} {loss:>8.3} {right:>6} of {count}");
    };
    println!("{:<34} {:>8} {:>12}", "", "-ln P", "P > 1/2");
    line("as in the product", &Rules::USED.prior);
    for (name, off) in OFF {
        let mut prior = Rules::USED.prior;
        off(&mut prior);
        line(name, &prior);
    }
    for (name, change) in PRIORS {
        for by in [1.0 - STEP, 1.0 + STEP] {
            let mut prior = Rules::USED.prior;
            change(&mut prior, by);
            line(&format!("{name} × {by:.2}"), &prior);
        }
    }
    let learned = learned(cases);
    line("after a search", &learned);
    println!("{learned:?}");
    tell_lapse(&cases.iter().flat_map(|case| case.named.iter().copied()).collect::<Vec<_>>());
}

/// Tells the share of lapses that makes the named effects most probable, and how far the answers hold with it.
fn tell_lapse(named: &[(f64, bool)]) {
    let loss = |lapse: f64| {
        let of = |(p, is_there): &(f64, bool)| {
            let confidence = (1.0 - lapse) * p.min(MOST);
            -(if *is_there { confidence } else { 1.0 - confidence }).ln()
        };
        named.iter().map(of).sum::<f64>() / named.len().max(1) as f64
    };
    println!("{:<34} {:>8} of {} named effects", "lapses", "-ln P", named.len());
    for percent in (0..=50).step_by(5) {
        println!("{:<34} {:>8.3}", f64::from(percent) / 100.0, loss(f64::from(percent) / 100.0));
    }
    println!("{:<34} {:>8} {:>6}", "posterior", "there", "of");
    for (low, high) in [(0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 0.98), (0.98, 1.1)] {
        let own = named.iter().filter(|(p, _)| (low..high).contains(p));
        let there = own.clone().filter(|(_, is_there)| *is_there).count();
        println!(
            "{:<34} {there:>8} {:>6}",
            format!("{low} to {}", f64::min(high, 1.0)),
            own.count()
        );
    }
}

/// Changes one prior after the other for the better, by steps that become smaller.
fn learned(cases: &[Case]) -> Prior {
    let mut best = Rules::USED.prior;
    let mut least = objective(cases, &best).0;
    for step in [1.33, 1.15, 1.07] {
        for _ in 0..3 {
            for (_, change) in PRIORS {
                for by in [step, 1.0 / step] {
                    let mut tried = best;
                    change(&mut tried, by);
                    let loss = objective(cases, &tried).0;
                    if loss < least {
                        (best, least) = (tried, loss);
                    }
                }
            }
        }
    }
    best
}
