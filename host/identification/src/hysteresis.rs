//! The loop of a tendon that is pulled back and forth.

use cathforce_mechanics::{
    Description, DescriptionError, Drive, Drives, Lumen, Model, State, settle, step,
};
use thiserror::Error;

/// Share of the tip's range by which it has to move before it counts as moving.
const MOVES: f64 = 0.02;

/// Features of a loop of tip displacement over tendon displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopFeatures {
    /// Least and largest displacement of the tip \[m\].
    pub lowest_m: f64,
    pub highest_m: f64,
    /// Tendon displacement after a reversal before the tip follows: at the largest and at the least
    /// displacement of the tendon \[m\].
    pub dead_at_highest_m: f64,
    pub dead_at_lowest_m: f64,
    /// Difference of the tip's displacement between letting out and pulling, halfway along the tendon's
    /// way \[m\].
    pub thickness_m: f64,
}

/// Why a record is no loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum LoopError {
    #[error("tendon and tip have {tendon} and {tip} samples; give one of each at a time")]
    Unequal { tendon: usize, tip: usize },
    #[error("sample {0} is not a finite number")]
    NotFinite(usize),
    #[error("the tendon is not pulled, let out and pulled again; record one whole loop")]
    NoLoop,
}

/// Features of the last whole loop of a record, from one largest displacement of the tendon to the next.
pub fn loop_features(tendon_m: &[f64], tip_m: &[f64]) -> Result<LoopFeatures, LoopError> {
    if tendon_m.len() != tip_m.len() {
        return Err(LoopError::Unequal { tendon: tendon_m.len(), tip: tip_m.len() });
    }
    let both = tendon_m.iter().zip(tip_m);
    if let Some(sample) = both.clone().position(|(a, b)| !(a + b).is_finite()) {
        return Err(LoopError::NotFinite(sample));
    }
    let (least, most) = range(tendon_m);
    let middle = 0.5 * (least + most);
    let turns = turns(tendon_m, middle);
    // High, low, high: let out, then pulled.
    let [high, low, again] = last_loop(&turns).ok_or(LoopError::NoLoop)?;
    let (lowest_m, highest_m) = range(&tip_m[high..=again]);
    let moves_m = MOVES * (highest_m - lowest_m);
    let dead = |from: usize, to: usize| {
        let moved = (from..=to).find(|&i| (tip_m[i] - tip_m[from]).abs() > moves_m);
        (tendon_m[moved.unwrap_or(to)] - tendon_m[from]).abs()
    };
    let at_middle = |from: usize, to: usize| {
        let i = (from..to).find(|&i| (tendon_m[i] - middle) * (tendon_m[i + 1] - middle) <= 0.0);
        let i = i.ok_or(LoopError::NoLoop)?;
        let (a, b) = (tendon_m[i], tendon_m[i + 1]);
        let share = if a == b { 0.0 } else { (middle - a) / (b - a) };
        Ok(tip_m[i] + share * (tip_m[i + 1] - tip_m[i]))
    };
    Ok(LoopFeatures {
        lowest_m,
        highest_m,
        dead_at_highest_m: dead(high, low),
        dead_at_lowest_m: dead(low, again),
        thickness_m: at_middle(high, low)? - at_middle(low, again)?,
    })
}

fn range(of: &[f64]) -> (f64, f64) {
    of.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
}

/// Where the tendon turns, and whether it turns above the middle: the end of each stay at an extreme.
fn turns(tendon_m: &[f64], middle: f64) -> Vec<(usize, bool)> {
    let mut found: Vec<(usize, bool)> = Vec::new();
    for (i, &x) in tendon_m.iter().enumerate() {
        let above = x > middle;
        match found.last_mut() {
            Some((best, side)) if *side == above => {
                let farther = if above { x >= tendon_m[*best] } else { x <= tendon_m[*best] };
                if farther {
                    *best = i;
                }
            }
            _ => found.push((i, above)),
        }
    }
    found
}

fn last_loop(turns: &[(usize, bool)]) -> Option<[usize; 3]> {
    let whole = |w: &&[(usize, bool)]| w[0].1 && !w[1].1 && w[2].1;
    let [a, b, c] = turns.windows(3).rfind(whole)? else { return None };
    Some([a.0, b.0, c.0])
}

/// A catheter in free space whose first tendon is pulled.
pub struct PulledTip {
    model: Model<f64>,
    state: Box<State<f64>>,
    at: Drive<f64>,
    /// Direction in which the tip's displacement is taken.
    across: [f64; 3],
}

impl PulledTip {
    /// At rest with all tendons at zero. The tip's displacement is that towards `up` of the entry.
    pub fn new(
        description: Description<f64>,
        insertion_m: f64,
        lumen: &Lumen<'_>,
    ) -> Result<Self, DescriptionError> {
        let across = description.entry.up;
        let model = Model::new(description)?;
        let at = Drive { insertion_m, rotation_rad: 0.0 };
        let mut state = Box::new(State::new());
        while !settle(&model, lumen, &mut state, at) {}
        Ok(Self { model, state, at, across })
    }

    /// Another catheter in the same state, which saves feeding it in. Both differ in their tendons only,
    /// which are slack in it, so that the state is the other's rest too.
    pub fn with(&self, description: Description<f64>) -> Result<Self, DescriptionError> {
        let model = Model::new(description)?;
        Ok(Self { model, state: self.state.clone(), at: self.at, across: self.across })
    }

    /// The description of the catheter.
    pub fn description(&self) -> &Description<f64> {
        self.model.description()
    }

    /// The tip's displacement for these displacements of the first tendon, one a tick \[m\].
    pub fn pull(&mut self, lumen: &Lumen<'_>, tendon_m: &[f64]) -> Vec<f64> {
        let tick = |&first_m: &f64| {
            let tendons_m = [first_m, 0.0, 0.0, 0.0];
            let drives = Drives { catheter: self.at, tendons_m, ..Drives::default() };
            step(&self.model, lumen, &mut self.state, drives);
            let tip_m = self.state.node_position_m(0).unwrap_or_default();
            (0..3).map(|i| tip_m[i] * self.across[i]).sum()
        };
        tendon_m.iter().map(tick).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Play of half width `play`, of slope `slope`.
    fn with_play(tendon_m: &[f64], play: f64, slope: f64) -> Vec<f64> {
        let mut at = tendon_m[0] - play;
        let follow = |&x: &f64| {
            at = at.clamp(x - play, x + play);
            slope * at
        };
        tendon_m.iter().map(follow).collect()
    }

    fn back_and_forth(amplitude: f64) -> Vec<f64> {
        (0..4000)
            .map(|i| amplitude * (std::f64::consts::TAU * f64::from(i) / 1000.0).sin())
            .collect()
    }

    #[test]
    fn a_play_has_the_features_of_its_closed_form() {
        // Seven amplitudes, as in the experiment.
        for amplitude in [4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0].map(|x| 1e-3 * x) {
            let (play, slope) = (0.5e-3, 3.0);
            let tendon_m = back_and_forth(amplitude);
            let found = loop_features(&tendon_m, &with_play(&tendon_m, play, slope)).unwrap();
            let most = slope * (amplitude - play);
            let near = |a: f64, b: f64| (a - b).abs() < 2e-5 * b.abs() + 1e-9;
            assert!(near(found.highest_m, most) && near(found.lowest_m, -most), "{found:?}");
            assert!(near(found.thickness_m, 2.0 * play * slope), "{found:?}");
            // Twice the play, and what moves the tip by a fiftieth of its range.
            let dead = 2.0 * play + 0.02 * 2.0 * most / slope;
            for found in [found.dead_at_highest_m, found.dead_at_lowest_m] {
                assert!((found - dead).abs() < 0.01 * amplitude, "{found} {dead}");
            }
        }
    }

    #[test]
    fn what_is_no_loop_says_why() {
        let pulled: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(loop_features(&pulled, &pulled), Err(LoopError::NoLoop));
        let unequal = LoopError::Unequal { tendon: 100, tip: 99 };
        assert_eq!(loop_features(&pulled, &pulled[..99]), Err(unequal));
        let mut broken = pulled.clone();
        broken[3] = f64::NAN;
        assert_eq!(loop_features(&pulled, &broken), Err(LoopError::NotFinite(3)));
    }
}
