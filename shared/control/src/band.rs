//! The band: uncertainty of the estimated forces.
//!
//! A diagnosis measures it and tabulates it over insertion and direction of motion
//! (docs/explanation/diagnosis.md (D15)). A tick looks it up; nothing else in a tick depends on it.

use serde::{Deserialize, Serialize};

use crate::memory_visitor::{MemoryWord, VisitMemory};

/// Number of insertions in the table of a band.
pub const BAND_ROWS: usize = 24;
/// Code of an unknown half width.
pub const BAND_UNKNOWN: u16 = u16::MAX;
/// Half width of one count in the table \[N\].
pub const BAND_UNIT_N: f32 = 1e-4;

/// Ticks without a band after an unresolved one (a snap). The diagnosis measures the band outside of
/// snaps.
const SNAP_TICKS: u8 = 100;
/// Smallest feed that counts as a change of direction \[m\]; the jitter of encoders is smaller.
const TURN_M: f32 = 1e-4;

/// Half widths at one insertion, in counts of [`BAND_UNIT_N`]: force on the vessel x, y, z, then the
/// force behind the guide. [`BAND_UNKNOWN`] where they are not known.
pub type BandRow = [u16; 4];

/// Half widths of the band that contains nine of ten true forces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Insertion of the first row, and difference between two rows \[m\].
    pub from_m: f32,
    pub step_m: f32,
    /// Rows for feed, and for withdrawal.
    pub feed: [BandRow; BAND_ROWS],
    pub withdrawal: [BandRow; BAND_ROWS],
}

/// Half widths in one tick; `None` where they are not known.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct HalfWidths {
    /// Half widths of the force on the vessel, x, y, z \[N\].
    pub force_n: Option<[f32; 3]>,
    /// Half width of the force behind the guide \[N\].
    pub drive_force_n: Option<f32>,
}

impl Band {
    /// Checks the numbers of the table. The error names the first one that is out of range.
    pub fn validate(&self) -> Result<(), &'static str> {
        let Self { from_m, step_m, .. } = *self;
        match () {
            () if !(0.0..=2.0).contains(&from_m) => Err("from_m"),
            () if !(1e-4..=0.1).contains(&step_m) => Err("step_m"),
            () => Ok(()),
        }
    }

    /// Interpolates between two rows; `None` outside of them.
    fn at(&self, insertion_m: f32, withdrawn: bool) -> Option<HalfWidths> {
        let rows = if withdrawn { &self.withdrawal } else { &self.feed };
        let place = (insertion_m - self.from_m) / self.step_m;
        // In this form, NaN is outside too.
        if !(place >= 0.0 && place <= (BAND_ROWS - 1) as f32) {
            return None;
        }
        let row = place as usize;
        let low = rows.get(row)?;
        let high = rows.get(row + 1).unwrap_or(low);
        let share = place - row as f32;
        let between = |low: u16, high: u16| {
            let known = low != BAND_UNKNOWN && high != BAND_UNKNOWN;
            let (low, high) = (f32::from(low), f32::from(high));
            known.then_some((low + share * (high - low)) * BAND_UNIT_N)
        };
        let ([x, y, z, drive], [to_x, to_y, to_z, to_drive]) = (*low, *high);
        let force_n = match [between(x, to_x), between(y, to_y), between(z, to_z)] {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        Some(HalfWidths { force_n, drive_force_n: between(drive, to_drive) })
    }
}

/// Recent motion of the instrument, from which its direction is known.
#[derive(Clone, Debug)]
pub(crate) struct InsertionHistory {
    /// Farthest insertion in the present direction \[m\].
    farthest_m: f32,
    withdrawn: bool,
    since_snap_ticks: u8,
}

impl InsertionHistory {
    pub fn new() -> Self {
        Self { farthest_m: 0.0, withdrawn: false, since_snap_ticks: 0 }
    }

    /// The band of a tick. `unresolved`: the model's forces are uncertain in this tick.
    pub fn update(
        &mut self,
        band: Option<&Band>,
        insertion_m: f32,
        unresolved: bool,
    ) -> HalfWidths {
        let ahead_m = if self.withdrawn {
            self.farthest_m - insertion_m
        } else {
            insertion_m - self.farthest_m
        };
        // A corrupt memory (NaN) starts over like a change of direction.
        let turned = ahead_m < -TURN_M || ahead_m.is_nan();
        self.withdrawn ^= turned;
        if turned || ahead_m > 0.0 {
            self.farthest_m = insertion_m;
        }
        self.since_snap_ticks =
            if unresolved { 0 } else { self.since_snap_ticks.saturating_add(1).min(SNAP_TICKS) };
        let resolved = self.since_snap_ticks >= SNAP_TICKS;
        let band = band.filter(|_| resolved);
        band.and_then(|band| band.at(insertion_m, self.withdrawn)).unwrap_or_default()
    }
}

impl VisitMemory for InsertionHistory {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        visit(MemoryWord::F32(&mut self.farthest_m));
        visit(MemoryWord::U8(&mut self.since_snap_ticks));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band() -> Band {
        let mut feed = [[BAND_UNKNOWN; 4]; BAND_ROWS];
        for (row, widths) in feed.iter_mut().enumerate().take(10) {
            *widths = [100 * row as u16, 10, 20, 30];
        }
        Band { from_m: 0.02, step_m: 0.01, feed, withdrawal: [[500; 4]; BAND_ROWS] }
    }

    /// The band after ticks at these insertions, each held until no snap is near.
    fn after(insertions_m: &[f32]) -> HalfWidths {
        let (mut history, mut last) = (InsertionHistory::new(), HalfWidths::default());
        for &at in insertions_m {
            for _ in 0..SNAP_TICKS {
                last = history.update(Some(&band()), at, false);
            }
        }
        last
    }

    #[test]
    fn a_band_is_interpolated_and_unknown_outside_its_rows() {
        let x_n = |insertions_m: &[f32]| after(insertions_m).force_n.map(|[x, ..]| x);
        let near = |found: Option<f32>, wanted_n: f32| {
            found.is_some_and(|found| (found - wanted_n).abs() < 1e-6)
        };
        assert!(near(x_n(&[0.02]), 0.0) && near(x_n(&[0.045]), 0.025), "{:?}", x_n(&[0.045]));
        assert_eq!(x_n(&[0.019]), None, "before the first row");
        assert_eq!(x_n(&[0.113]), None, "next to a row that is not known");
        assert_eq!(x_n(&[0.26]), None, "behind the last row");
        assert_eq!(x_n(&[f32::NAN]), None);
        assert!(near(after(&[0.045]).drive_force_n, 3e-3));
    }

    #[test]
    fn a_withdrawal_has_rows_of_its_own_and_trembling_is_none() {
        let withdrawn = |insertions_m: &[f32]| {
            let [x, ..] = after(insertions_m).force_n.expect("known there");
            (x - 0.05).abs() < 1e-6
        };
        assert!(withdrawn(&[0.05, 0.0495]));
        assert!(!withdrawn(&[0.05, 0.049_95]), "less than a turn");
        assert!(!withdrawn(&[0.05, 0.0495, 0.0499]), "fed again");
    }

    #[test]
    fn a_way_that_is_no_number_is_forgotten() {
        let mut history = InsertionHistory { farthest_m: f32::NAN, ..InsertionHistory::new() };
        history.update(None, 0.05, false);
        assert_eq!((history.farthest_m, history.withdrawn), (0.05, true));
        history.update(None, 0.06, false);
        assert!(!history.withdrawn);
    }

    #[test]
    fn there_is_no_band_in_a_snap_and_shortly_after_it() {
        let mut history = InsertionHistory::new();
        let mut update = |unresolved| history.update(Some(&band()), 0.05, unresolved);
        assert_eq!(update(true), HalfWidths::default());
        let stated = (0..SNAP_TICKS).filter(|_| update(false).force_n.is_some()).count();
        assert_eq!(stated, 1, "in the last of them");
        assert_eq!(update(true), HalfWidths::default());
    }

    #[test]
    fn a_table_that_is_none_is_refused() {
        assert_eq!(band().validate(), Ok(()));
        assert_eq!(Band { from_m: -1.0, ..band() }.validate(), Err("from_m"));
        assert_eq!(Band { step_m: f32::NAN, ..band() }.validate(), Err("step_m"));
    }
}
