//! The rows of one trial, by column.

use cathforce_mechanics::MAX_TENDONS;

use super::columns;
use crate::axis::{Axis, CommandKind};

/// Encoder positions at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderReading {
    pub insertion_m: f64,
    pub rotation_rad: f64,
}

/// Column of vectors with gaps; `None` where a row has no value.
pub type VectorColumn = Vec<Option<[f64; 3]>>;

/// Columns of a catheter's trial, one entry a row.
#[derive(Clone, Debug, PartialEq)]
pub struct CatheterTrial {
    pub insertion_m: Vec<f64>,
    pub rotation_rad: Vec<f64>,
    /// Force of the instrument on the phantom; `None` when the column is missing.
    pub force_n: Option<VectorColumn>,
    /// Axial force on the instrument behind the guide, positive when pushing.
    pub drive_force_n: Option<Vec<Option<f64>>>,
    pub tip_m: Option<VectorColumn>,
    /// Points on the shape, tip first; empty without them.
    pub shape_m: Vec<VectorColumn>,
    /// Present if and only if the rig has a guidewire.
    pub guidewire: Option<GuidewireTrial>,
    /// Displacements of the tendons' drives, one column for each of the rig's `[[tendons]]`.
    pub tendons_m: Vec<Vec<f64>>,
}

/// Columns of the guidewire's drive, one entry a row, with the catheter's units and signs.
#[derive(Clone, Debug, PartialEq)]
pub struct GuidewireTrial {
    pub insertion_m: Vec<f64>,
    pub rotation_rad: Vec<f64>,
    pub drive_force_n: Option<Vec<Option<f64>>>,
}

/// Columns of the encoders of one drive, insertion and rotation, with their names.
pub(super) type Encoders<'a> = [(&'static str, &'a [f64]); 2];

impl CatheterTrial {
    /// The encoders of the catheter's drive, then those of the guidewire's, if there is one.
    pub(super) fn encoders(&self) -> impl Iterator<Item = Encoders<'_>> {
        let of = |names: [&'static str; 2], insertion_m, rotation_rad| {
            [(names[0], insertion_m), (names[1], rotation_rad)]
        };
        let own =
            of([columns::INSERTION, columns::ROTATION], &self.insertion_m[..], &self.rotation_rad);
        let wire = self.guidewire.as_ref().map(move |wire| {
            let names = [columns::GUIDEWIRE_INSERTION, columns::GUIDEWIRE_ROTATION];
            of(names, &wire.insertion_m[..], &wire.rotation_rad)
        });
        std::iter::once(own).chain(wire)
    }
}

/// Columns of a drive's trial, one entry a row, in the units of their names.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveTrial {
    pub axis: Axis,
    pub kind: CommandKind,
    pub position: Vec<f64>,
    pub command: Vec<f64>,
    pub setpoint: Option<Vec<Option<f64>>>,
    /// Force or torque that it takes to hold the axis against what is known.
    pub load: Option<Vec<f64>>,
}

/// Columns of a transmission's trial, one entry a row, in the units of their names.
#[derive(Clone, Debug, PartialEq)]
pub struct TransmissionTrial {
    pub input_kind: Axis,
    pub output_kind: Axis,
    pub input: Vec<f64>,
    pub output: Vec<f64>,
    /// Force \[N\] or torque \[N·m\] that holds the output back.
    pub load: Option<Vec<f64>>,
    /// Sum of the angles of the sheath.
    pub bend_rad: Option<Vec<f64>>,
}

/// What was measured, by plant.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialData {
    Catheter(CatheterTrial),
    Drive(DriveTrial),
    Transmission(TransmissionTrial),
}

/// One trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Number in the file's name.
    pub number: u32,
    /// Rising strictly \[s\].
    pub t_s: Vec<f64>,
    pub data: TrialData,
}

impl Trial {
    /// Number of rows; never 0.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there are no rows; never true of a trial that was read.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Time from the first row to the last \[s\].
    pub fn duration_s(&self) -> f64 {
        match (self.t_s.first(), self.t_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Columns of a catheter's trial.
    pub fn catheter(&self) -> Option<&CatheterTrial> {
        match &self.data {
            TrialData::Catheter(catheter) => Some(catheter),
            TrialData::Drive(_) | TrialData::Transmission(_) => None,
        }
    }

    /// Encoder positions at any time by linear interpolation, held before the first row and
    /// after the last: how rows of any rate become samples at 1 kHz. `None` for a drive.
    pub fn encoder_at(&self, t_s: f64) -> Option<EncoderReading> {
        let catheter = self.catheter()?;
        self.reading_at(t_s, &catheter.insertion_m, &catheter.rotation_rad)
    }

    /// The same of the guidewire's drive; `None` without one.
    pub fn guidewire_at(&self, t_s: f64) -> Option<EncoderReading> {
        let wire = self.catheter()?.guidewire.as_ref()?;
        self.reading_at(t_s, &wire.insertion_m, &wire.rotation_rad)
    }

    /// Displacements of the tendons' drives likewise, zero for those that the rig does not have.
    pub fn tendons_at(&self, t_s: f64) -> [f64; MAX_TENDONS] {
        let mut at_m = [0.0; MAX_TENDONS];
        let columns = self.catheter().map_or(&[][..], |catheter| &catheter.tendons_m);
        if let Some((low, high, share)) = self.rows_around(t_s) {
            for (at_m, column) in at_m.iter_mut().zip(columns) {
                *at_m = column[low] + (column[high] - column[low]) * share;
            }
        }
        at_m
    }

    fn reading_at(
        &self,
        t_s: f64,
        insertion_m: &[f64],
        rotation_rad: &[f64],
    ) -> Option<EncoderReading> {
        let (low, high, share) = self.rows_around(t_s)?;
        let at = |column: &[f64]| column[low] + (column[high] - column[low]) * share;
        Some(EncoderReading { insertion_m: at(insertion_m), rotation_rad: at(rotation_rad) })
    }

    /// The rows before and after a time, and the share of the second one.
    fn rows_around(&self, t_s: f64) -> Option<(usize, usize, f64)> {
        let after = self.t_s.partition_point(|&t| t <= t_s);
        let (low, high) = (after.saturating_sub(1), after.min(self.len().saturating_sub(1)));
        let (start, end) = (self.t_s.get(low)?, self.t_s.get(high)?);
        let share = if high > low { ((t_s - start) / (end - start)).clamp(0.0, 1.0) } else { 0.0 };
        Some((low, high, share))
    }
}
