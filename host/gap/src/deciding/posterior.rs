//! How probable each set of effects is, and that a cause is outside the library.

use crate::plant::Point;
use crate::rules::Rules;

/// A set of effects that was fitted.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// In ascending order; empty for the nominal model.
    pub effects: Vec<usize>,
    pub point: Point,
    /// Probability that these effects are there and no other cause.
    pub probability: f64,
    /// Probability that they are there beside a cause outside the library.
    pub with_others: f64,
}

impl Explanation {
    /// Whatever else there is.
    pub fn in_all(&self) -> f64 {
        self.probability + self.with_others
    }
}

/// The probabilities of all sets that were fitted, which add up to 1; the most probable one first.
#[derive(Clone, Debug, Default)]
pub struct Posterior {
    pub sets: Vec<Explanation>,
}

impl Posterior {
    /// From sets and the logarithms of their two probabilities, but for a constant.
    ///
    /// See docs/explanation/diagnosis.md (D12).
    pub fn of(sets: impl IntoIterator<Item = (Explanation, [f64; 2])>) -> Self {
        let sets: Vec<(Explanation, [f64; 2])> = sets.into_iter().collect();
        let most = sets.iter().flat_map(|(_, own)| *own).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = sets.iter().flat_map(|(_, own)| *own).map(|own| (own - most).exp()).sum();
        let share = |ln: f64| (ln - most).exp() / total;
        let normalised = |(own, [mine, others]): (Explanation, [f64; 2])| Explanation {
            probability: share(mine),
            with_others: share(others),
            ..own
        };
        let mut sets: Vec<Explanation> = sets.into_iter().map(normalised).collect();
        sets.sort_by(|a, b| b.in_all().total_cmp(&a.in_all()));
        Self { sets }
    }

    /// That a cause is outside the library.
    pub fn none_of_mine(&self) -> f64 {
        self.sets.iter().map(|own| own.with_others).sum()
    }

    /// That there is no effect of the library and no other cause.
    pub fn of_no_effect(&self) -> f64 {
        let none = self.sets.iter().find(|own| own.effects.is_empty());
        none.map_or(0.0, |own| own.probability)
    }

    /// That there is no effect of the library, whatever else is.
    pub fn without_effect(&self) -> f64 {
        let none = self.sets.iter().find(|own| own.effects.is_empty());
        none.map_or(0.0, Explanation::in_all)
    }

    /// That an effect is there, whatever else is.
    pub fn of_effect(&self, effect: usize) -> f64 {
        let with = self.sets.iter().filter(|own| own.effects.contains(&effect));
        with.map(Explanation::in_all).sum()
    }

    /// Effects that could stand in the place of one of a set, the most probable first.
    pub fn in_place_of(&self, set: &[usize], effect: usize) -> Vec<usize> {
        let Some(own) = self.sets.iter().find(|own| own.effects == set) else { return Vec::new() };
        let replaced = |other: &Explanation| {
            let mut new = other.effects.iter().filter(|e| !set.contains(e));
            let kept = set.iter().filter(|e| other.effects.contains(e)).count();
            let is_exchange = other.effects.len() == set.len()
                && kept + 1 == set.len()
                && !other.effects.contains(&effect);
            let alike = other.in_all() >= Rules::USED.verdict.not_told_apart * own.in_all();
            new.next().copied().filter(|_| is_exchange && alike)
        };
        self.sets.iter().filter_map(replaced).collect()
    }

    /// Probability that the effects of a set are there, or others that cannot be told apart from them,
    /// whatever other effects are there beside them.
    pub fn of_class(&self, set: &[usize]) -> f64 {
        let rivals: Vec<Vec<usize>> = set.iter().map(|e| self.in_place_of(set, *e)).collect();
        let is_in = |other: &Explanation| {
            set.iter().zip(&rivals).all(|(own, rivals)| {
                other.effects.contains(own) || rivals.iter().any(|r| other.effects.contains(r))
            })
        };
        self.sets.iter().filter(|own| is_in(own)).map(Explanation::in_all).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Anchor;

    fn point() -> Point {
        let anchor =
            Anchor { effects: Default::default(), ways: Default::default(), is_everywhere: false };
        Point { effects: Vec::new(), nuisances: Vec::new(), anchor }
    }

    fn posterior(sets: &[(&[usize], f64, f64)]) -> Posterior {
        Posterior::of(sets.iter().map(|(effects, mine, others)| {
            let own = Explanation {
                effects: effects.to_vec(),
                point: point(),
                probability: 0.0,
                with_others: 0.0,
            };
            (own, [mine.ln(), others.ln()])
        }))
    }

    #[test]
    fn probabilities_add_up_over_sets_and_causes() {
        let found = posterior(&[(&[], 1.0, 1.0), (&[3], 10.0, 2.0), (&[3, 5], 4.0, 2.0)]);
        assert_eq!(found.sets[0].effects, [3]);
        assert!((found.none_of_mine() - 0.25).abs() < 1e-12);
        assert!((found.of_effect(3) - 0.9).abs() < 1e-12);
        assert!((found.of_effect(5) - 0.3).abs() < 1e-12);
    }

    #[test]
    fn what_is_about_as_probable_in_a_place_cannot_be_told_apart() {
        let found = posterior(&[
            (&[1, 2], 10.0, 0.0),
            (&[1, 4], 2.0, 0.0),
            (&[1, 5], 0.5, 0.0),
            (&[3, 4], 9.0, 0.0),
        ]);
        assert_eq!(found.in_place_of(&[1, 2], 2), [4]);
        assert!(found.in_place_of(&[1, 2], 1).is_empty(), "two effects are others");
        assert!((found.of_class(&[1, 2]) - 12.0 / 21.5).abs() < 1e-12);
        let beside = posterior(&[(&[1], 2.0, 0.0), (&[1, 3], 6.0, 0.0), (&[2], 2.0, 0.0)]);
        assert!((beside.of_class(&[1]) - 1.0).abs() < 1e-12, "beside others, or the rival 2");
    }
}
