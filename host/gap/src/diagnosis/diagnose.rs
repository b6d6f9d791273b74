//! The whole run: noise floor, gap, location, effects, size, certainty, next recording.

use std::time::Instant;

use crate::data::sanity;
use crate::diagnosis::answer::Answer;
use crate::diagnosis::phase_per_trial::{closes_more, with_own_phases};
use crate::diagnosis::report::Diagnosis;
use crate::fitting::problem::Problem;
use crate::fitting::progress::Progress;
use crate::noise::floor::Floor;
use crate::plant::{BROKEN_DOWN, Plant};
use crate::rules::Rules;
use crate::scoring::folds::Folds;
use crate::searching::selector::Selector;

/// Diagnoses the trials of a plant.
///
/// `bundle`: name for the answer. Deterministic: the same trials give the same answer.
pub fn diagnose(plant: &dyn Plant, bundle: &str, progress: Progress<'_>) -> Diagnosis {
    diagnose_by(&Rules::USED, plant, bundle, progress)
}

/// The same by other rules, which tells what each of them is worth.
pub fn diagnose_by(
    rules: &Rules,
    plant: &dyn Plant,
    bundle: &str,
    progress: Progress<'_>,
) -> Diagnosis {
    let start = Instant::now();
    let answer = run(rules, plant, bundle, None, progress);
    let altered = if answer.cut { None } else { with_own_phases(rules, plant, &answer, progress) };
    let answer = match altered {
        Some(altered) => {
            let again = run(rules, &altered, bundle, None, progress);
            if closes_more(rules, &answer, &again) { again } else { answer }
        }
        None => answer,
    };
    answer.told(start)
}

/// Fits these effects, indices into [`Plant::effects`], and no others: what they close is
/// answered in the same terms, but nothing is compared with rivals.
pub fn diagnose_given(
    plant: &dyn Plant,
    bundle: &str,
    effects: &[usize],
    progress: Progress<'_>,
) -> Diagnosis {
    let start = Instant::now();
    run(&Rules::USED, plant, bundle, Some(effects), progress).told(start)
}

fn run(
    rules: &Rules,
    plant: &dyn Plant,
    bundle: &str,
    given: Option<&[usize]>,
    progress: Progress<'_>,
) -> Diagnosis {
    let floor = Floor::of(plant);
    let problem = Problem::new(plant, &floor, progress).by(*rules);
    let mut answer = Answer::new(plant, bundle, &floor);
    let folds = match Folds::of(plant) {
        Ok(folds) => folds,
        Err(why) => return answer.inconclusive(why),
    };
    folds.remarks(plant.trials().len()).into_iter().for_each(|remark| answer.remark(remark));
    let selector = Selector { problem: &problem, folds: &folds };
    let Some(nominal) = selector.nominal() else {
        return answer.inconclusive(format!(
            "the nominal model breaks down on these trials, so nothing is compared: {BROKEN_DOWN}"
        ));
    };
    let complaints = match plant.complaint() {
        Some(own) => vec![own.to_owned()],
        None => sanity::complaints(&problem, &nominal),
    };
    if !complaints.is_empty() {
        return answer.inconclusive(complaints.join("; "));
    }
    let mut diagnosis = answer.finish(&problem, &selector, nominal, given);
    diagnosis.details.simulations = problem.simulations();
    diagnosis
}

/// About how many trials a diagnosis will simulate, for a progress bar.
pub fn expected_simulations(plant: &dyn Plant) -> u64 {
    let nuisances = plant.nuisances().len();
    let again = if plant.cheap() { nuisances + 4 } else { 0 };
    let fit = |k: usize, starts: usize| 1 + starts + 4 * (k + 2) + again;
    let effects = plant.effects().iter();
    let singles: usize = effects.map(|e| fit(e.parameters.len(), e.starts.len())).sum();
    // Sets of several effects, as many as on the bundles that it was tried on.
    let sets = if plant.cheap() { 250 } else { 16 };
    let more = sets * fit(3, 2);
    ((1 + nuisances + singles + more) * plant.trials().len()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::report::Verdict;
    use crate::plant::Point;

    /// Data that rise by so much, of which an effect may explain 10.
    fn toy(slope: f64) -> impl Plant {
        use crate::toy::{Toy, effect, noise, parameter};
        let measured = (0..400).map(|i| slope * i as f64 / 400.0 + 0.01 * noise(i));
        let predict = |i: usize, point: &Point| point.effects[0][0] * i as f64 / 400.0;
        let mut toy = Toy::new(0.01, 0.01, measured, predict).times(4);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy.cheap = false;
        toy
    }

    fn answer(slope: f64) -> Diagnosis {
        diagnose(&toy(slope), "toy", &crate::unwatched)
    }

    #[test]
    fn whoever_watches_is_told_the_most_probable_set_so_far() {
        use std::ops::ControlFlow;
        use std::sync::Mutex;

        use crate::{BestSoFar, Watcher};

        #[derive(Default)]
        struct Seen(Mutex<Vec<BestSoFar>>);
        impl Watcher for Seen {
            fn simulated(&self, _simulations: usize) -> ControlFlow<()> {
                ControlFlow::Continue(())
            }

            fn found(&self, best: &BestSoFar) {
                self.0.lock().unwrap().push(best.clone());
            }
        }

        let seen = Seen::default();
        let answer = diagnose(&toy(9.5), "toy", &seen);
        assert_eq!(answer.verdict, Verdict::Named);
        let seen = seen.0.into_inner().unwrap();
        let last = seen.last().expect("it is told at least once");
        let [only] = &last.effects[..] else { panic!("{last:?}") };
        assert_eq!((only.id, only.values[0].0.name, last.sets), ("slope", "slope", 2));
        assert!((only.values[0].1 - 9.5).abs() < 0.1 && last.closes > 0.9, "{last:?}");
    }

    /// A force zero of which each trial has its own, and which all trials may share.
    #[test]
    fn what_all_trials_share_beyond_a_prior_is_a_gap() {
        use crate::plant::Nuisance;
        use crate::toy::{Toy, effect, noise, parameter};
        const SD: f64 = 0.1;
        let verdict = |shared: f64| {
            let measured = (0..400).map(|i| shared + 0.3 * noise(i));
            let predict = |_, point: &Point| point.effects[0][0] + point.nuisances[0];
            let mut toy = Toy::new(0.01, 0.3, measured, predict).times(4);
            toy.effects = vec![effect("offset", vec![parameter("offset")], vec![vec![0.5]])];
            toy.nuisances =
                vec![Nuisance { name: "zero", unit: "1", sd: SD, effect: Some("offset") }];
            toy.cheap = false;
            diagnose(&toy, "toy", &crate::unwatched).verdict
        };
        assert_eq!(verdict(2.0 * SD), Verdict::NoGap);
        // Both are at the floor, but the second has its nuisance at the limit.
        assert_ne!(verdict(4.5 * SD), Verdict::NoGap);
    }

    #[test]
    fn what_was_asked_for_has_no_rival_and_hence_no_confidence() {
        let asked = |slope| diagnose_given(&toy(slope), "toy", &[0], &crate::unwatched);
        let named = asked(9.5);
        assert_eq!((named.verdict, named.effects[0].confidence), (Verdict::Named, None));
        assert!(answer(9.5).effects[0].confidence.is_some());
        let json = serde_json::to_value(&named).unwrap();
        assert_eq!(
            (&json["asked_for"][0], &json["effects"][0]["confidence"]),
            (&"slope".into(), &serde_json::Value::Null)
        );
        // Half of the slope, three quarters of its energy.
        let beyond = asked(20.0).sentence();
        assert!(beyond.contains("only 50 % of the gap; no other effect was tried"), "{beyond}");
    }

    #[test]
    fn what_is_left_is_described_where_not_all_is_explained() {
        let named = answer(9.5);
        assert_eq!((named.verdict, &named.left), (Verdict::Named, &None));
        let beyond = answer(10.4);
        let left = beyond.left.as_ref().expect("its verdict is unknown");
        assert_eq!(left.after, ["slope"], "the effect that comes nearest, though it is not named");
        assert!((left.gap_share - (1.0 - beyond.details.shrink)).abs() < 1e-12);
        // What is not named closes nothing, though it would.
        let force = beyond.gap.force_rms_n.unwrap();
        let would = left.gap.force_rms_n.unwrap();
        assert!(force.after == force.before && force.before == would.before, "{force:?}");
        assert!(would.after < 0.1 * would.before, "{would:?}");
        // Of 10.4 i/400, 10 i/400 are explained.
        let descriptors = left.places[0].descriptors;
        assert!((descriptors.mean - 0.2).abs() < 0.02, "{descriptors:?}");
        assert!(descriptors.time.unwrap() > 0.9 && left.words.contains("drifts with time"));
        assert!(beyond.places[0].descriptors.mean > 5.0, "nominal: {:?}", beyond.places[0]);
        assert!(left.words.starts_with("after the model with slope"), "{}", left.words);
        let json = serde_json::to_value(&beyond).unwrap();
        assert_eq!(json["left"]["where"][0]["channel"], "fx_N");
    }

    /// Whether `json` has every key of `pattern` with a value of that kind; one of an array stands for all.
    fn has_form(json: &serde_json::Value, pattern: &serde_json::Value) -> bool {
        use serde_json::Value::{Array, Bool, Null, Number, Object, String};
        match (json, pattern) {
            (Object(own), Object(keys)) => {
                keys.iter().all(|(key, of)| own.get(key).is_some_and(|own| has_form(own, of)))
            }
            (Array(own), Array(of)) => own.iter().all(|own| has_form(own, &of[0])),
            (Null, Object(_)) => true,
            (own, of) => matches!(
                (own, of),
                (String(_), String(_))
                    | (Number(_), Number(_))
                    | (Bool(_), Bool(_))
                    | (Null, Number(_))
            ),
        }
    }

    #[test]
    fn an_answer_has_the_form_of_gap_diagnosis_2() {
        // ../shared/formats/diagnosis.md; what is not measured or not there is null.
        let figures = serde_json::json!({ "before": 0.1, "after": 0.1, "floor": 0.1 });
        let pattern = serde_json::json!({
            "format": "", "bundle": "", "verdict": "", "sentence": "",
            "none_of_mine": 0.1, "seconds": 0.1, "cut": false,
            "detectable": [{ "id": "", "parameter": "", "size": 0.1, "unit": "" }],
            "effects": [{
                "id": "",
                "form": { "name": "", "probability": 0.5 },
                "parameters": { "slope": { "value": 1.0, "low": 1.0, "high": 1.0, "unit": "" } },
                "confidence": 0.5, "shrink": 0.5, "material": true,
            }],
            "confusable": [[""]],
            "ranking": [{ "id": "", "shrink": 0.5 }],
            "gap": { "force_rms_N": figures, "tip_rms_m": figures, "shape_rms_m": figures },
            "where": [{
                "channel": "", "phase": "", "regime": "", "arc_m": [0.1], "time_share": 0.1,
                "gap_share": 0.1, "gap_share_low": 0.1, "gap_share_high": 0.1, "note": "",
            }],
            "next_experiment": { "segment": "", "separates": [""] },
            "reproduce": { "command": "", "version": "", "bundle_sha256": "" },
        });
        for (slope, verdict, effects) in
            [(0.0, "no_gap", 0), (9.5, "named", 1), (10.4, "unknown", 0)]
        {
            let json = serde_json::to_value(answer(slope)).unwrap();
            assert!(has_form(&json, &pattern), "{json:#}");
            assert_eq!(
                (&json["format"], &json["verdict"]),
                (&"gap-diagnosis/2".into(), &verdict.into())
            );
            assert_eq!(json["effects"].as_array().unwrap().len(), effects, "{json:#}");
            assert_eq!(json["where"].as_array().unwrap().is_empty(), verdict == "no_gap");
            for own in json["ranking"].as_array().unwrap() {
                let shrink = own["shrink"].as_f64().unwrap();
                assert!((-1.0..=1.0).contains(&shrink), "{json:#}");
            }
        }
    }

    #[test]
    fn an_effect_at_its_bound_names_nothing_while_much_is_left() {
        assert_eq!(answer(9.5).verdict, Verdict::Named);
        let beyond = answer(10.4);
        assert_eq!(beyond.verdict, Verdict::Unknown);
        assert!(
            beyond.remarks.iter().any(|remark| remark.starts_with("slope fits best at a bound"))
        );
    }
}
