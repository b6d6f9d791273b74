//! Places that an operator has to reach with the tip, one after the other.

use serde::Serialize;

/// The places in their order, and when they were reached.
#[derive(Clone, Debug, Default)]
pub struct Targets {
    /// From the entry, in the vessel's frame \[m\].
    places_m: Vec<[f64; 3]>,
    /// Distance of the tip at which a place is reached \[m\].
    within_m: f64,
    reached_s: Vec<f64>,
    distance_m: Option<f64>,
}

/// How far an operator has come.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShownTargets {
    pub targets: usize,
    /// Time at which each of those that were reached was, since the first frame \[s\].
    pub reached_s: Vec<f64>,
    /// The next one, from the entry in the vessel's frame \[m\]; `None` once all are reached.
    pub next_m: Option<[f64; 3]>,
    /// Of the tip from it \[m\]; `None` before the device has told where the tip is.
    pub distance_m: Option<f64>,
}

impl Targets {
    pub fn new(places_m: Vec<[f64; 3]>, within_m: f64) -> Self {
        Self { places_m, within_m, ..Self::default() }
    }

    fn next_m(&self) -> Option<[f64; 3]> {
        self.places_m.get(self.reached_s.len()).copied()
    }

    /// The tip is there at a time.
    pub fn tip(&mut self, from_entry_m: [f32; 3], t_s: f64) {
        let Some(next_m) = self.next_m() else { return };
        let square = |k: usize| (f64::from(from_entry_m[k]) - next_m[k]).powi(2);
        let distance_m = (0..3).map(square).sum::<f64>().sqrt();
        if distance_m <= self.within_m {
            self.reached_s.push(t_s);
            // Of the next one nothing is known until the tip is told again.
            self.distance_m = None;
        } else {
            self.distance_m = Some(distance_m);
        }
    }

    /// `None` without targets.
    pub fn shown(&self) -> Option<ShownTargets> {
        (!self.places_m.is_empty()).then(|| ShownTargets {
            targets: self.places_m.len(),
            reached_s: self.reached_s.clone(),
            next_m: self.next_m(),
            distance_m: self.distance_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_reached_in_their_order() {
        assert_eq!(Targets::default().shown(), None);
        let mut targets = Targets::new(vec![[0.03, 0.0, 0.0], [0.06, 0.01, 0.0]], 2e-3);
        targets.tip([0.06, 0.01, 0.0], 1.0);
        let shown = targets.shown().unwrap();
        assert!(shown.reached_s.is_empty(), "the second one is not the next one");
        assert!((shown.distance_m.unwrap() - 0.0316).abs() < 1e-4, "{shown:?}");
        targets.tip([0.0285, 0.001, 0.0], 2.0);
        let shown = targets.shown().unwrap();
        assert_eq!((shown.reached_s, shown.distance_m), (vec![2.0], None));
        assert_eq!(shown.next_m, Some([0.06, 0.01, 0.0]));
        targets.tip([0.061, 0.01, 0.0], 5.5);
        let shown = targets.shown().unwrap();
        assert_eq!((shown.reached_s, shown.next_m), (vec![2.0, 5.5], None));
    }
}
