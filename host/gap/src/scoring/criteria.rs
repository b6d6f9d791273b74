//! Parsimony: when a model is better than a simpler one.

use crate::plant::{Plant, Quantity};
use crate::scoring::candidate::Candidate;
use crate::scoring::score::Score;

/// Energy per sample of every quantity below which there is no gap, in floors. In the tuning sets,
/// cases without an effect leave at most 1.11, and small effects leave 1.23 and more.
pub const NO_GAP: f64 = 1.2;
/// A gain must exceed so many of its standard errors over the blocks.
const GAIN_STANDARD_ERRORS: f64 = 2.0;
/// Or else losing blocks must lose less than this share of what the others gain: an effect that
/// shows in few blocks scatters over all.
const MOST_LOST: f64 = 0.25;
/// Smallest share of the gap above the floor that an effect must remove: of the one that is left,
/// in all or in one quantity, or of the whole. In between lie terms that mend the shape of another
/// effect.
const SHARE_OF_LEFT: f64 = 0.5;
const SHARE_OF_ALL: f64 = 0.1;
/// The first of them for a drive: beside Coulomb friction, three terms that are all there may each
/// remove less than half of what is left.
const SHARE_OF_LEFT_CHEAP: f64 = 0.3;
/// Of a drive, smallest share of the whole: what removes less mends what the turnover of friction at
/// rest leaves.
const LEAST_OF_ALL_CHEAP: f64 = 5e-4;
/// Of a catheter, smallest share of the whole, unless it halves a quantity that was far from its
/// floor: no reality has quite the shape that the library gives to its largest effect.
const LEAST_OF_ALL: f64 = 0.02;
/// And smallest share of what such a quantity had above its floor in the nominal model: less is what the
/// shape of a large effect leaves.
const LEAST_OF_QUANTITY: f64 = 0.05;
/// Or this share of what is left above the floor: no other effect mends a shape so well.
const MOST_OF_LEFT: f64 = 0.6;
/// Energy per sample up to which a quantity of a catheter counts as near its floor.
pub const NEAR_FLOOR: f64 = 2.5;
/// Models whose errors differ by less than this share of the gap are equally good.
const EQUAL_SHARE: f64 = 0.02;
/// Smallest N_eff ln(E_old/E_new) − k ln N_eff.
pub const EVIDENCE: f64 = 6.0;

/// What a model must remove to be worth its parameters.
#[derive(Clone, Debug)]
pub struct Parsimony {
    /// The nominal model's excess, and its energy by quantity.
    gap: f64,
    quantities: Vec<(Quantity, f64)>,
    /// Smallest share of it.
    least: f64,
    /// Smallest share of what is left.
    of_left: f64,
    /// Where every quantity is at its floor, the explanation of a drive ends. Small effects of a catheter
    /// that lie together at its floor are told apart.
    ends_at_floor: bool,
}

impl Parsimony {
    pub fn of(plant: &dyn Plant, nominal: &Score) -> Self {
        let (least, of_left) = match plant.cheap() {
            true => (LEAST_OF_ALL_CHEAP, SHARE_OF_LEFT_CHEAP),
            false => (LEAST_OF_ALL, SHARE_OF_LEFT),
        };
        let quantities = nominal.quantities.iter().map(|(own, energy, _)| (*own, *energy));
        Self {
            gap: nominal.excess(),
            quantities: quantities.collect(),
            least,
            of_left,
            ends_at_floor: plant.cheap(),
        }
    }

    /// Whether a model is enough better than the one that it extends.
    pub fn pays(&self, old: &Score, new: &Score, parameters: usize) -> bool {
        let (gain, error) = new.gain_over(old);
        (gain > GAIN_STANDARD_ERRORS * error || new.share_lost_to(old) < MOST_LOST)
            && self.is_needed(old, new, parameters)
    }

    /// Whether what a model has more than another is worth its parameters, however its gain is
    /// spread over the blocks.
    pub fn is_needed(&self, old: &Score, new: &Score, parameters: usize) -> bool {
        if self.ends_at_floor && old.worst() <= NO_GAP {
            return false;
        }
        let n = new.effective.max(2.0);
        let evidence = n * (old.energy / new.energy).ln() - parameters as f64 * n.ln();
        let removed = old.excess() - new.excess();
        let halves_one = || {
            type Own = (Quantity, f64, usize);
            let halved = |((_, old, _), (_, new, _)): (&Own, &Own)| {
                *old > NO_GAP && old - new >= SHARE_OF_LEFT * (old - 1.0)
            };
            removed > 0.0 && old.quantities.iter().zip(&new.quantities).any(halved)
        };
        let much = removed >= self.of_left * old.excess()
            || removed >= SHARE_OF_ALL * self.gap
            || halves_one();
        let counts = removed >= self.least * self.gap
            || (removed > 0.0 && self.is_much_of_one(old, new))
            || (old.worst() > NO_GAP && removed >= MOST_OF_LEFT * old.excess());
        much && counts && evidence > EVIDENCE
    }

    /// Whether a quantity that was far from its floor is halved, and loses enough of what the nominal
    /// model leaves of it.
    fn is_much_of_one(&self, old: &Score, new: &Score) -> bool {
        old.quantities.iter().zip(&new.quantities).any(|((own, old, _), (_, new, _))| {
            let nominal = self.quantities.iter().find(|(quantity, _)| quantity == own);
            let gap = nominal.map_or(0.0, |(_, energy)| energy - 1.0);
            *old > NEAR_FLOOR
                && old - new >= (LEAST_OF_QUANTITY * gap).max(SHARE_OF_LEFT * (old - 1.0))
        })
    }
}

/// Whether a model says clearly less about what was held out than another.
pub fn predicts_less(other: &Score, model: &Score, gap: f64) -> bool {
    model.excess() - other.excess() > EQUAL_SHARE * gap
}

/// What a model costs in the same terms: N_eff ln E + k ln N_eff, for models side by side.
fn cost(score: &Score, effective: f64, parameters: usize) -> f64 {
    effective * score.energy.ln() + parameters as f64 * effective.ln()
}

/// Costs that differ by less say nothing.
const TIE: f64 = 2.0;

/// The candidates, the least costly first; ties in the order that they had. N_eff is the
/// smallest of all, so that none is favoured by what it leaves.
///
/// Of those within one standard error of the first, or within the smallest share of the gap that
/// counts, one with a parameter at a bound stands behind the others.
pub fn by_cost<T>(
    plant: &dyn Plant,
    gap: f64,
    candidates: &mut [T],
    of: impl Fn(&T) -> &Candidate,
) {
    let effective = candidates.iter().map(|c| of(c).score.effective).fold(f64::INFINITY, f64::min);
    let key = |c: &T| {
        let candidate = of(c);
        cost(&candidate.score, effective.max(2.0), candidate.fit.parameters(plant))
    };
    let least = candidates.iter().map(key).fold(f64::INFINITY, f64::min);
    candidates.sort_by_cached_key(|c| ((key(c) - least) / TIE).round() as i64);
    let Some(first) = candidates.first().map(|c| of(c).score.clone()) else { return };
    let equal = |c: &T| {
        let (gain, error) = first.gain_over(&of(c).score);
        gain <= error.max(EQUAL_SHARE * gap)
    };
    candidates.sort_by_cached_key(|c| match (equal(c), of(c).fit.at_bound(plant)) {
        (true, false) => 0,
        (true, true) => 1,
        (false, _) => 2,
    });
}

/// Puts the one with the fewest parameters first, of candidates that are within one standard error
/// of the first and have no parameter at a bound; else leaves them in their order. Those of a drive
/// stay in theirs: Coulomb friction, which has two, is not a richer viscous friction.
pub fn simplest_first<T>(plant: &dyn Plant, candidates: &mut [T], of: impl Fn(&T) -> &Candidate) {
    if plant.cheap() {
        return;
    }
    let Some(first) = candidates.first().map(|c| of(c).score.clone()) else { return };
    candidates.sort_by_cached_key(|c| {
        let (gain, error) = first.gain_over(&of(c).score);
        let fit = &of(c).fit;
        if gain <= error && !fit.at_bound(plant) { fit.coordinates.len() } else { usize::MAX }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitting::fit::{Depth, Start};
    use crate::plant::Point;
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 100;

    /// Energies per sample of the force at the drive and of the tip.
    fn score(drive: f64, tip: f64) -> Score {
        Score {
            residuals: Vec::new(),
            blocks: vec![0.5 * (drive + tip); 4],
            weights: vec![0.5 * SAMPLES as f64; 4],
            energy: 0.5 * (drive + tip),
            quantities: vec![(Quantity::DriveForce, drive, SAMPLES), (Quantity::Tip, tip, SAMPLES)],
            gap: 0.5 * ((drive - 1.0).max(0.0) + (tip - 1.0).max(0.0)),
            effective: SAMPLES as f64,
        }
    }

    /// Of a gap of a thousand floors, to which the tip adds so many.
    fn parsimony(tip: f64) -> Parsimony {
        let quantities = vec![(Quantity::DriveForce, 2000.0), (Quantity::Tip, 1.0 + tip)];
        Parsimony {
            gap: 1000.0,
            quantities,
            least: LEAST_OF_ALL,
            of_left: SHARE_OF_LEFT,
            ends_at_floor: false,
        }
    }

    #[test]
    fn a_small_term_pays_where_it_halves_a_quantity_far_from_its_floor() {
        let own = parsimony(20.0);
        assert!(own.pays(&score(2.0, 6.0), &score(2.0, 1.5), 2));
        // It is what a shape leaves of a tip that was farther off.
        assert!(own.pays(&score(8.0, 6.0), &score(8.0, 1.5), 2));
        assert!(!parsimony(200.0).pays(&score(8.0, 6.0), &score(8.0, 1.5), 2));
        // Near the floor it mends the shape of the largest effect.
        assert!(!own.pays(&score(2.0, 2.2), &score(2.0, 1.1), 2));
        // But not where it explains most of what is left.
        assert!(own.pays(&score(2.0, 2.2), &score(1.2, 1.1), 2));
        // Not halved.
        assert!(!own.pays(&score(2.0, 6.0), &score(2.0, 4.0), 2));
        // The tip is nearer, the whole is not.
        assert!(!own.pays(&score(2.0, 6.0), &score(8.0, 1.5), 2));
    }

    #[test]
    fn of_a_drive_that_is_at_its_floor_nothing_more_is_asked() {
        let (old, new) = (score(1.18, 1.18), score(0.8, 0.8));
        let of = |ends_at_floor| Parsimony { ends_at_floor, gap: 0.2, ..parsimony(20.0) };
        assert!(of(false).pays(&old, &new, 1), "it would be worth its parameter");
        assert!(!of(true).pays(&old, &new, 1));
        // One quantity above the floor is enough to go on.
        assert!(of(true).pays(&score(1.3, 1.1), &new, 1));
    }

    #[test]
    fn a_term_that_removes_much_of_the_whole_pays_wherever_it_does() {
        assert!(parsimony(20.0).pays(&score(300.0, 2.0), &score(20.0, 2.0), 2));
        // Of parameters that many cost more than that.
        assert!(!parsimony(20.0).pays(&score(300.0, 2.0), &score(20.0, 2.0), 60));
    }

    /// Parameters of what is put first of a line and of one that may bend, where the data bend by
    /// so much.
    fn first_has(bend: f64) -> usize {
        let along = |i: usize| i as f64 / SAMPLES as f64;
        let measured = |i: usize| 2.0 * along(i) + bend * along(i).powi(2) + 0.01 * noise(i);
        let predict = move |i: usize, point: &Point| {
            let (line, own) = (point.effects[0][0], &point.effects[1]);
            (line + own[0]) * along(i) + own[1] * along(i).powi(2)
        };
        let mut toy = Toy::new(0.01, 0.01, (0..SAMPLES).map(measured), predict);
        toy.cheap = false;
        let [slope, curve] = ["slope", "curve"].map(parameter);
        toy.effects = vec![
            effect("line", vec![slope], vec![vec![1.0]]),
            effect("bent", vec![slope, curve], vec![vec![1.0, 0.1]]),
        ];
        explained_by(&toy, &[1], |selector, selection| {
            let nominal = &selection.nominal.fit;
            let nuisances = selector.nuisances_at(nominal).unwrap();
            let fitted = |effect: usize| {
                let start = Start::Fit(nominal);
                let fit = selector.candidate(Depth::Whole, &nuisances, start, &[effect], None);
                fit.unwrap()
            };
            let mut candidates = [fitted(1), fitted(0)];
            simplest_first(&toy, &mut candidates, |candidate| candidate);
            candidates[0].fit.coordinates.len()
        })
    }

    #[test]
    fn of_what_explains_as_much_the_simpler_comes_first() {
        assert_eq!(first_has(0.0), 1);
        assert_eq!(first_has(0.5), 2);
    }
}
