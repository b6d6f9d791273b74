//! Positions of all drives in a tick.

use cathforce_control::{EncoderSample, GuidewireSample, Inputs, TendonPair};
use cathforce_mechanics::{Drive, Drives, MAX_TENDONS};

/// Drives that a rig has, in the order of the columns of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    pub has_guidewire: bool,
    pub tendons: usize,
}

const CATHETER: [&str; 2] = ["insertion_m", "rotation_rad"];
const GUIDEWIRE: [&str; 2] = ["guidewire_insertion_m", "guidewire_rotation_rad"];
const TENDONS: [&str; MAX_TENDONS] = ["tendon_1_m", "tendon_2_m", "tendon_3_m", "tendon_4_m"];

/// An insertion that is longer than this many times the reach of the links was not given in metres. The
/// device itself clamps to the reach, so that up to here it may be meant.
const IN_OTHER_UNITS: f64 = 10.0;

/// Positions of the drives of a rig at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Row {
    /// Insertion \[m\] and rotation \[rad\].
    pub catheter: [f64; 2],
    pub guidewire: [f64; 2],
    pub tendons_m: [f64; MAX_TENDONS],
}

impl Layout {
    /// Names of the columns.
    pub fn columns(self) -> Vec<&'static str> {
        let wire = GUIDEWIRE.into_iter().filter(|_| self.has_guidewire);
        CATHETER.into_iter().chain(wire).chain(TENDONS.into_iter().take(self.tendons)).collect()
    }

    /// The numbers of a row, in the order of the columns; `None` of another number of columns.
    pub fn row(self, numbers: &[f64]) -> Option<Row> {
        let (catheter, rest) = numbers.split_first_chunk()?;
        let (guidewire, rest) = match self.has_guidewire {
            true => rest.split_first_chunk()?,
            false => (&[0.0; 2], rest),
        };
        let mut row = Row { catheter: *catheter, guidewire: *guidewire, ..Row::default() };
        row.tendons_m.get_mut(..self.tendons)?.copy_from_slice(rest.get(..self.tendons)?);
        (rest.len() == self.tendons).then_some(row)
    }

    /// The numbers of a row, in the order of the columns.
    pub fn numbers(self, row: &Row) -> Vec<f64> {
        let wire = row.guidewire.into_iter().filter(|_| self.has_guidewire);
        let tendons = row.tendons_m.into_iter().take(self.tendons);
        row.catheter.into_iter().chain(wire).chain(tendons).collect()
    }

    /// Refuses numbers that no drive can have; names the column.
    pub fn check(self, row: &Row, reach_m: f64) -> Result<(), String> {
        let Row { catheter, guidewire, tendons_m } = row;
        let named = CATHETER.iter().zip(catheter).chain(GUIDEWIRE.iter().zip(guidewire));
        let named = named.chain(TENDONS.iter().zip(tendons_m));
        for (name, &number) in named {
            if !number.is_finite() {
                return Err(format!("{name} is {number}\n  fix: give a finite number"));
            }
            if name.ends_with("_m") && number.abs() > IN_OTHER_UNITS * reach_m {
                return Err(format!(
                    "{name} = {number} m, and the links reach {reach_m:.4} m\n  fix: give metres, not \
                     millimetres"
                ));
            }
        }
        Ok(())
    }
}

impl Row {
    pub fn inputs(&self, layout: Layout) -> Inputs {
        let sample = |[insertion_m, rotation_rad]: [f64; 2]| EncoderSample {
            insertion_m: insertion_m as f32,
            rotation_rad: rotation_rad as f32,
        };
        let wire = GuidewireSample { at: sample(self.guidewire), held: false };
        let pair = |i: usize| TendonPair {
            displacements_m: [self.tendons_m[2 * i] as f32, self.tendons_m[2 * i + 1] as f32],
        };
        Inputs {
            encoder: Some(sample(self.catheter)),
            guidewire: layout.has_guidewire.then_some(wire),
            tendons: std::array::from_fn(|i| (2 * i < layout.tendons).then(|| pair(i))),
            ..Inputs::default()
        }
    }

    pub fn drives(&self) -> Drives<f64> {
        let drive = |[insertion_m, rotation_rad]: [f64; 2]| Drive { insertion_m, rotation_rad };
        Drives {
            catheter: drive(self.catheter),
            guidewire: drive(self.guidewire),
            tendons_m: self.tendons_m,
        }
    }

    /// A share of the way to another row.
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |a: f64, b: f64| if share < 1.0 { a + (b - a) * share } else { b };
        Self {
            catheter: std::array::from_fn(|k| between(self.catheter[k], other.catheter[k])),
            guidewire: std::array::from_fn(|k| between(self.guidewire[k], other.guidewire[k])),
            tendons_m: std::array::from_fn(|k| between(self.tendons_m[k], other.tendons_m[k])),
        }
    }
}
