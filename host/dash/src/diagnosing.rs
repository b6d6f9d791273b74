//! A diagnosis that still runs: how far it is and what it has found, then its answer.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::diagnosis;

/// Before this share of the simulations nothing is said of the time that is left. The first simulations are the
/// fastest: `gap diagnose examples/tapered-none --dash` did 41 a second in its first 4 s and 29 a second in 52 s.
const TOO_EARLY: f64 = 0.03;

/// A diagnosis that another part of the program runs. Clones show the same one.
#[derive(Clone, Default)]
pub struct Diagnosing(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    /// When the search began, and what it was allowed.
    run: Option<Run>,
    simulations: u64,
    best: Option<Value>,
    answer: Option<(Value, Arc<str>)>,
}

struct Run {
    started: Instant,
    expected: u64,
    budget: Option<Duration>,
}

impl Diagnosing {
    /// The search begins. `expected`: about how many simulations it takes. `budget`: ends it.
    pub fn begins(&self, expected: u64, budget: Option<Duration>) {
        self.state().run = Some(Run { started: Instant::now(), expected, budget });
    }

    /// So many simulations are done.
    pub fn simulated(&self, simulations: u64) {
        self.state().simulations = simulations;
    }

    /// What the search has found so far: a sentence for each effect, the share of the gap that they close
    /// together, and how many sets of effects were compared.
    pub fn found(&self, sentences: &[String], closes: f64, sets: usize) {
        let found = json!({ "sentences": sentences, "closes": closes, "sets": sets });
        self.state().best = Some(found);
    }

    /// The answer, as JSON of a diagnosis.
    pub fn ends(&self, answer: Value) {
        let text = answer.to_string().into();
        self.state().answer = Some((answer, text));
    }

    /// Whether there is an answer.
    pub fn is_over(&self) -> bool {
        self.state().answer.is_some()
    }

    /// The answer; `None` while it is sought.
    pub(crate) fn data(&self) -> Option<Arc<str>> {
        self.state().answer.as_ref().map(|(_, text)| Arc::clone(text))
    }

    /// What `GET /api/state` says.
    pub(crate) fn json(&self) -> Value {
        let state = self.state();
        if let Some((answer, _)) = &state.answer {
            return diagnosis::state(answer);
        }
        let elapsed = state.run.as_ref().map(|run| run.started.elapsed());
        json!({
            "source": "diagnosis",
            "mode": "diagnosing",
            "tick": null,
            "age_ms": null,
            "forces": null,
            "simulations": state.simulations,
            "expected": state.run.as_ref().map(|run| run.expected),
            "seconds": elapsed.map(|own| own.as_secs_f64()),
            "seconds_left": state.left(elapsed),
            "best": state.best,
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// The time that is left \[s\]; `None` where nobody can know.
    fn left(&self, elapsed: Option<Duration>) -> Option<f64> {
        let (run, elapsed) = (self.run.as_ref()?, elapsed?.as_secs_f64());
        let to_budget = run.budget.map(|budget| (budget.as_secs_f64() - elapsed).max(0.0));
        let (done, expected) = (self.simulations as f64, run.expected as f64);
        let is_known = done > TOO_EARLY * expected && done < expected;
        let to_end = is_known.then(|| elapsed * (expected - done) / done);
        match (to_end, to_budget) {
            (Some(end), Some(budget)) => Some(end.min(budget)),
            (end, budget) => end.or(budget),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_followed_from_its_begin_to_its_answer() {
        let shown = Diagnosing::default();
        let run = shown.clone();
        assert_eq!(
            (&shown.json()["mode"], &shown.json()["seconds"]),
            (&"diagnosing".into(), &Value::Null)
        );
        run.begins(1000, None);
        run.simulated(10);
        assert!(shown.json()["seconds_left"].is_null(), "nobody knows so early");
        run.simulated(500);
        let half = shown.json();
        let [done, left] = ["seconds", "seconds_left"].map(|key| half[key].as_f64().unwrap());
        assert!((done - left).abs() < 0.1 * done.max(1e-3), "{half}");
        run.found(&["The wall is softer.".into()], 0.8, 20);
        assert_eq!(shown.json()["best"]["sentences"][0], "The wall is softer.");
        run.simulated(1500);
        assert!(shown.json()["seconds_left"].is_null(), "it takes longer than was expected");
        assert!(!shown.is_over() && shown.data().is_none());
        run.ends(json!({ "verdict": "named" }));
        assert_eq!((&shown.json()["mode"], shown.is_over()), (&"diagnosis".into(), true));
        assert_eq!(shown.data().as_deref(), Some("{\"verdict\":\"named\"}"));
    }

    #[test]
    fn a_budget_is_the_longest_that_it_takes() {
        let run = Diagnosing::default();
        run.begins(1_000_000_000, Some(Duration::from_secs(60)));
        let left = run.json()["seconds_left"].as_f64().unwrap();
        assert!((0.0..=60.0).contains(&left), "{left}");
    }
}
