//! What a master's own frames mean, for robots that do not send ENCODER and GUIDEWIRE.
//!
//! Where in a frame a quantity stands is data, part of the device image: identifier, start bit,
//! length, byte order, sign, scale and offset, counted as a DBC counts them. Frames described so
//! carry neither our counter nor our CRC: what a repeated or damaged one does is left to the
//! checks of freshness, range and speed.

use serde::{Deserialize, Serialize};

use crate::process::Id;
use crate::{Counter, Frame, MAX_ID};

/// A quantity in a frame: raw value × scale + offset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// Its lowest bit, or in big-endian order its highest; bit 7 of byte 0 is 7, of byte 1 is 15.
    pub start_bit: u8,
    /// 1 to 32.
    pub bits: u8,
    pub big_endian: bool,
    /// Two's complement.
    pub signed: bool,
    /// What one count stands for \[m, rad, or 1 for a button\].
    pub scale: f32,
    /// \[m, rad, or 1\]
    pub offset: f32,
}

/// A drive's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveFrame {
    /// 11-bit identifier; both drives may share one.
    pub id: u16,
    /// \[m\]
    pub insertion: Signal,
    /// \[rad\]
    pub rotation: Signal,
    /// Not 0 while the operator holds this drive's button; only the guidewire's is asked.
    pub held: Option<Signal>,
}

/// The frames of a master. `None`: the drive's position comes in our own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Master {
    pub catheter: Option<DriveFrame>,
    pub guidewire: Option<DriveFrame>,
}

/// Why a master's frames are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MasterError {
    /// No identifier of 11 bits, or one that this protocol uses itself.
    Id,
    /// Not 1 to 32 bits, or not within 8 bytes.
    Bits,
    /// A scale of 0, or a number that is not finite.
    Scale,
}

impl MasterError {
    pub const fn text(self) -> &'static str {
        match self {
            Self::Id => "the identifier has more than 11 bits or is one of cathforce's own",
            Self::Bits => "a signal must have 1 to 32 bits within 8 bytes",
            Self::Scale => "a scale must be finite and not 0, an offset finite",
        }
    }
}

/// What a frame says of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    pub insertion_m: f32,
    pub rotation_rad: f32,
    pub held: bool,
}

impl Signal {
    /// Places of its bits in the frame, the lowest first.
    fn places(self) -> impl Iterator<Item = u8> {
        let low_first = (0..self.bits).map(move |bit| {
            if !self.big_endian {
                return self.start_bit.saturating_add(bit);
            }
            // From the highest bit downwards, through byte after byte, each from its own top.
            let down = self.bits - 1 - bit;
            let from_top = (self.start_bit / 8) * 8 + 7 - self.start_bit % 8;
            let place = from_top.saturating_add(down);
            (place / 8) * 8 + 7 - place % 8
        });
        low_first.take(32)
    }

    /// Checks the layout.
    pub fn validate(self) -> Result<(), MasterError> {
        let is_within = (1..=32).contains(&self.bits)
            && self.start_bit < 64
            && self.places().all(|place| place < 64);
        if !is_within {
            Err(MasterError::Bits)
        } else if self.scale == 0.0 || !self.scale.is_finite() || !self.offset.is_finite() {
            Err(MasterError::Scale)
        } else {
            Ok(())
        }
    }

    /// The quantity; `None` if the frame is too short for it.
    pub fn read(self, data: &[u8]) -> Option<f32> {
        let mut raw = 0_u32;
        for (bit, place) in self.places().enumerate() {
            let byte = data.get(usize::from(place / 8))?;
            raw |= u32::from(byte >> (place % 8) & 1) << bit;
        }
        let count = if self.signed {
            let unused = 32_u32.saturating_sub(u32::from(self.bits)).min(31);
            ((raw << unused).cast_signed() >> unused) as f32
        } else {
            raw as f32
        };
        Some(count * self.scale + self.offset)
    }

    /// Puts the nearest code of a quantity into a frame, saturating.
    pub fn write(self, value: f64, data: &mut [u8; 8]) {
        let count = (value - f64::from(self.offset)) / f64::from(self.scale);
        let count = (count + if count < 0.0 { -0.5 } else { 0.5 }) as i64;
        let bits = u32::from(self.bits.clamp(1, 32));
        let (min, max) = match self.signed {
            true => (-(1_i64 << (bits - 1)), (1_i64 << (bits - 1)) - 1),
            false => (0, (1_i64 << bits) - 1),
        };
        let raw = count.clamp(min, max);
        for (bit, place) in self.places().enumerate() {
            if let Some(byte) = data.get_mut(usize::from(place / 8)) {
                let mask = 1 << (place % 8);
                *byte = if raw >> bit & 1 != 0 { *byte | mask } else { *byte & !mask };
            }
        }
    }
}

impl DriveFrame {
    /// Checks identifier and signals.
    pub fn validate(&self) -> Result<(), MasterError> {
        // What a drive's own frame would have been called is free.
        let is_taken =
            Id::from_raw(self.id).is_some_and(|id| !matches!(id, Id::Encoder | Id::Guidewire));
        if self.id > MAX_ID || is_taken {
            return Err(MasterError::Id);
        }
        let signals = [Some(self.insertion), Some(self.rotation), self.held];
        signals.into_iter().flatten().try_for_each(Signal::validate)
    }

    /// What a frame says, if it has this identifier; else what it counts as.
    pub fn read(&self, frame: &Frame) -> Option<Result<Reading, Counter>> {
        if frame.id() != self.id {
            return None;
        }
        let read = |signal: Signal| signal.read(frame.data()).ok_or(Counter::WrongLength);
        let reading = || {
            Ok(Reading {
                insertion_m: read(self.insertion)?,
                rotation_rad: read(self.rotation)?,
                held: self.held.map(read).transpose()?.is_some_and(|held| held != 0.0),
            })
        };
        Some(reading())
    }

    /// Adds this drive's position to a frame of 8 bytes.
    pub fn write(&self, insertion_m: f64, rotation_rad: f64, held: bool, data: &mut [u8; 8]) {
        self.insertion.write(insertion_m, data);
        self.rotation.write(rotation_rad, data);
        if let Some(signal) = self.held {
            signal.write(f64::from(u8::from(held)), data);
        }
    }
}

impl Master {
    /// Checks both drives' frames.
    pub fn validate(&self) -> Result<(), MasterError> {
        [self.catheter, self.guidewire].iter().flatten().try_for_each(DriveFrame::validate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIGNAL: Signal = Signal {
        start_bit: 0,
        bits: 16,
        big_endian: false,
        signed: false,
        scale: 1.0,
        offset: 0.0,
    };

    /// Places as the DBC format counts them, from its documentation.
    #[test]
    fn bits_lie_where_a_dbc_says() {
        let data = [0x12, 0x34, 0x56, 0x78, 0, 0, 0, 0xFE];
        let read = |signal: Signal| signal.read(&data).unwrap();
        assert_eq!(read(SIGNAL), f32::from(0x3412_u16));
        // Motorola: bit 7 is the highest of byte 0.
        let big = Signal { start_bit: 7, big_endian: true, ..SIGNAL };
        assert_eq!(read(big), f32::from(0x1234_u16));
        assert_eq!(read(Signal { start_bit: 3, bits: 12, ..big }), f32::from(0x234_u16));
        assert_eq!(read(Signal { start_bit: 4, bits: 8, ..SIGNAL }), f32::from(0x41_u8));
        let signed = Signal { start_bit: 56, bits: 8, signed: true, ..SIGNAL };
        assert_eq!(read(signed), -2.0);
        assert_eq!(read(Signal { scale: -0.5, offset: 3.0, ..signed }), 4.0);
        assert_eq!(SIGNAL.read(&data[..1]), None, "too short");
    }

    #[test]
    fn what_lies_outside_of_a_frame_or_scales_to_nothing_is_refused() {
        let wrong = |signal: Signal| signal.validate().unwrap_err();
        assert_eq!(SIGNAL.validate(), Ok(()));
        assert_eq!(wrong(Signal { start_bit: 49, ..SIGNAL }), MasterError::Bits);
        assert_eq!(wrong(Signal { bits: 0, ..SIGNAL }), MasterError::Bits);
        assert_eq!(wrong(Signal { bits: 33, ..SIGNAL }), MasterError::Bits);
        assert_eq!(
            wrong(Signal { start_bit: 60, big_endian: true, ..SIGNAL }),
            MasterError::Bits,
            "past the last byte"
        );
        assert_eq!(wrong(Signal { scale: 0.0, ..SIGNAL }), MasterError::Scale);
        assert_eq!(wrong(Signal { offset: f32::NAN, ..SIGNAL }), MasterError::Scale);
        let drive = DriveFrame { id: 0x321, insertion: SIGNAL, rotation: SIGNAL, held: None };
        assert_eq!(drive.validate(), Ok(()));
        for id in [0x800, 0x080, 0x110, 0x180, 0x200, 0x600] {
            assert_eq!(DriveFrame { id, ..drive }.validate(), Err(MasterError::Id));
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_and_nothing_else_is_touched(
            start_bit in 0u8..64, bits in 1u8..=32, big_endian: bool, signed: bool,
            fill: u8, share in 0.0f64..1.0
        ) {
            let signal = Signal { start_bit, bits, big_endian, signed, scale: 0.5, offset: 3.0 };
            prop_assume!(signal.validate().is_ok());
            let low = if signed { -(2f64.powi(i32::from(bits) - 1)) } else { 0.0 };
            let count = (low + share * (2f64.powi(i32::from(bits)) - 1.0)).floor();
            let mut data = [fill; 8];
            signal.write(count * 0.5 + 3.0, &mut data);
            let read = f64::from(signal.read(&data).unwrap());
            // 24 bits of a count survive in single precision.
            prop_assert!((read - (count * 0.5 + 3.0)).abs() <= count.abs() * 1e-7 + 1e-6);
            signal.write(0.5 * low + 3.0, &mut data);
            let mut other = [fill; 8];
            signal.write(0.5 * low + 3.0, &mut other);
            prop_assert_eq!(data, other);
        }

        #[test]
        fn p03_any_layout_and_any_bytes_are_a_number_or_none(
            start_bit: u8, bits: u8, big_endian: bool, signed: bool, scale: f32, offset: f32,
            data in prop::collection::vec(any::<u8>(), 0..=8)
        ) {
            let signal = Signal { start_bit, bits, big_endian, signed, scale, offset };
            let _ = (signal.validate(), signal.read(&data));
            signal.write(1.0, &mut [0; 8]);
        }
    }
}
