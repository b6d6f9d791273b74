//! A master's own frames, for robots that do not send ENCODER and GUIDEWIRE.
//!
//! The device image describes the position of each quantity in a frame: identifier, start bit, length,
//! byte order, sign, scale and offset, in the conventions of a DBC. These frames have neither our
//! counter nor our CRC. Repeated and corrupt ones are left to the checks of freshness, range and speed.
//!
//! Names and order of the fields of [`Master`] are part of the image's schema.

use serde::{Deserialize, Serialize};

use crate::frame::is_id;
use crate::process::Id;
use crate::{Counter, Frame};

/// A quantity in a frame: raw value × scale + offset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// Lowest bit, or highest bit in big-endian order; bit 7 of byte 0 is 7, of byte 1 is 15.
    pub start_bit: u8,
    /// Number of bits, 1 to 32.
    pub bits: u8,
    pub big_endian: bool,
    /// Two's complement.
    pub signed: bool,
    /// The 32 bits are a floating-point number (IEEE 754), whatever `signed` says.
    pub float: bool,
    /// Quantity of one count \[m, rad, or 1 for a button\].
    pub scale: f32,
    /// Quantity of a raw value of 0 \[m, rad, or 1\].
    pub offset: f32,
}

/// Tells which frames of an identifier hold a quantity, where not all do: a multiplexor and its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Selector {
    /// As of a [`Signal`].
    pub start_bit: u8,
    pub bits: u8,
    pub big_endian: bool,
    /// Raw value in the frames that hold the quantity.
    pub value: u32,
}

/// A quantity, and the frame that contains it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Identifier, with [`EXTENDED`](crate::EXTENDED) added if it has 29 bits; any number of quantities may share one.
    pub id: u32,
    pub signal: Signal,
    /// `None`: every frame of this identifier holds it.
    pub selector: Option<Selector>,
}

/// Quantities of one drive. Each may be in a separate frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// Insertion \[m\].
    pub insertion: Place,
    /// Rotation \[rad\].
    pub rotation: Place,
    /// At least 0.5 while the operator holds this drive's button; `None` without a button.
    pub held: Option<Place>,
}

/// The frames of a master. A drive that is `None` sends its position in our own frame.
///
/// A drive has a new position once all of its frames have arrived since the last one. The oldest frame
/// therefore determines the age of the position, and a frame that stops coming makes the drive lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Master {
    pub catheter: Option<Drive>,
    pub guidewire: Option<Drive>,
    /// At least 0.5 while the operator grips the handle; applies to each drive described here.
    pub grip: Option<Place>,
}

/// Why a master's frames are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MasterError {
    /// No identifier of a frame, or one that this protocol uses itself.
    Id,
    /// Not 1 to 32 bits, or not within 8 bytes.
    Bits,
    /// A floating-point number that has not 32 bits.
    Float,
    /// A scale of 0, or a scale or offset that is not finite.
    Scale,
    /// A selector that is not 1 to 32 bits within 8 bytes, or whose value does not fit into them.
    Selector,
    /// A grip without a drive that it applies to.
    Grip,
}

impl MasterError {
    pub const fn text(self) -> &'static str {
        match self {
            Self::Id => {
                "the identifier has more than 29 bits, or 11 without the mark of 29, or is one of cathforce's own"
            }
            Self::Bits => "a signal must have 1 to 32 bits within 8 bytes",
            Self::Float => "a floating-point number must have 32 bits",
            Self::Scale => "a scale must be finite and not 0, an offset finite",
            Self::Selector => {
                "a selector must have 1 to 32 bits within 8 bytes, into which its value fits"
            }
            Self::Grip => "a grip is said of drives described beside it, and there is none",
        }
    }
}

/// A complete reading of one drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    pub insertion_m: f32,
    pub rotation_rad: f32,
    /// The operator holds the drive's button; `None` without a button.
    pub held: Option<bool>,
    /// The operator grips the handle; `true` if no frame tells.
    pub gripped: bool,
}

impl Signal {
    /// Positions of its bits in the frame, the lowest bit first.
    fn places(self) -> impl Iterator<Item = u8> {
        let low_first = (0..self.bits).map(move |bit| {
            if !self.big_endian {
                return self.start_bit.saturating_add(bit);
            }
            // Big-endian order counts down from the highest bit, through each byte from its top.
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
        } else if self.float && self.bits != 32 {
            Err(MasterError::Float)
        } else if self.scale == 0.0 || !self.scale.is_finite() || !self.offset.is_finite() {
            Err(MasterError::Scale)
        } else {
            Ok(())
        }
    }

    /// The quantity. `Err` counts a frame that is too short for it, or a number that is none.
    pub fn read(self, data: &[u8]) -> Result<f32, Counter> {
        let raw = self.raw(data)?;
        let count = if self.float {
            f32::from_bits(raw)
        } else if self.signed {
            let unused = 32_u32.saturating_sub(u32::from(self.bits)).min(31);
            ((raw << unused).cast_signed() >> unused) as f32
        } else {
            raw as f32
        };
        let value = count * self.scale + self.offset;
        if value.is_finite() { Ok(value) } else { Err(Counter::BadValue) }
    }

    /// Its bits; `Err` counts a frame that is too short.
    fn raw(self, data: &[u8]) -> Result<u32, Counter> {
        let mut raw = 0_u32;
        for (bit, place) in self.places().enumerate() {
            let byte = data.get(usize::from(place / 8)).ok_or(Counter::WrongLength)?;
            raw |= u32::from(byte >> (place % 8) & 1) << bit;
        }
        Ok(raw)
    }

    /// Writes the nearest code of a quantity into a frame, saturating.
    pub fn write(self, value: f64, data: &mut [u8; 8]) {
        let count = (value - f64::from(self.offset)) / f64::from(self.scale);
        if self.float {
            return self.write_raw((count as f32).to_bits().into(), data);
        }
        let count = (count + if count < 0.0 { -0.5 } else { 0.5 }) as i64;
        let bits = u32::from(self.bits.clamp(1, 32));
        let (min, max) = match self.signed {
            true => (-(1_i64 << (bits - 1)), (1_i64 << (bits - 1)) - 1),
            false => (0, (1_i64 << bits) - 1),
        };
        self.write_raw(count.clamp(min, max), data);
    }

    fn write_raw(self, raw: i64, data: &mut [u8; 8]) {
        for (bit, place) in self.places().enumerate() {
            if let Some(byte) = data.get_mut(usize::from(place / 8)) {
                let mask = 1 << (place % 8);
                *byte = if raw >> bit & 1 != 0 { *byte | mask } else { *byte & !mask };
            }
        }
    }
}

impl Selector {
    /// Its bits as an unsigned whole number.
    const fn signal(self) -> Signal {
        let Self { start_bit, bits, big_endian, .. } = self;
        Signal { start_bit, bits, big_endian, signed: false, float: false, scale: 1.0, offset: 0.0 }
    }

    /// Checks the layout.
    pub fn validate(self) -> Result<(), MasterError> {
        let is_whole = self.signal().validate().is_ok();
        let fits = self.bits >= 32 || self.value >> self.bits.min(31) == 0;
        if is_whole && fits { Ok(()) } else { Err(MasterError::Selector) }
    }

    /// Whether a frame is one of those; `Err` counts one that is too short.
    fn selects(self, data: &[u8]) -> Result<bool, Counter> {
        Ok(self.signal().raw(data)? == self.value)
    }

    /// Makes a frame one of those.
    pub fn write(self, data: &mut [u8; 8]) {
        self.signal().write_raw(self.value.into(), data);
    }
}

impl Place {
    /// Checks identifier and layout.
    pub fn validate(self) -> Result<(), MasterError> {
        // The identifiers of ENCODER and GUIDEWIRE are free, because these frames are replaced.
        let is_taken =
            Id::from_raw(self.id).is_some_and(|id| !matches!(id, Id::Encoder | Id::Guidewire));
        if !is_id(self.id) || is_taken {
            return Err(MasterError::Id);
        }
        self.signal.validate()?;
        self.selector.map_or(Ok(()), Selector::validate)
    }

    /// The quantity in a frame; `None` if the frame does not hold it.
    fn read(self, frame: &Frame) -> Result<Option<f32>, Counter> {
        if self.id != frame.id() {
            return Ok(None);
        }
        match self.selector.map(|selector| selector.selects(frame.data())).transpose()? {
            Some(false) => Ok(None),
            Some(true) | None => self.signal.read(frame.data()).map(Some),
        }
    }
}

impl Drive {
    fn places(self) -> impl Iterator<Item = Place> {
        [Some(self.insertion), Some(self.rotation), self.held].into_iter().flatten()
    }
}

impl Master {
    fn places(&self) -> impl Iterator<Item = Place> {
        let drives = [self.catheter, self.guidewire].into_iter().flatten();
        drives.flat_map(Drive::places).chain(self.grip)
    }

    /// Checks identifiers and layouts of all quantities.
    pub fn validate(&self) -> Result<(), MasterError> {
        if self.grip.is_some() && self.catheter.is_none() && self.guidewire.is_none() {
            return Err(MasterError::Grip);
        }
        self.places().try_for_each(Place::validate)
    }

    /// Frames of this identifier contain a quantity described here.
    pub fn has(&self, id: u32) -> bool {
        self.places().any(|place| place.id == id)
    }

    /// Number of frames that carry all quantities once.
    pub fn frames(&self) -> usize {
        let is_selected = |id| self.places().any(|one| one.id == id && one.selector.is_some());
        let is_first = |&(at, place): &(usize, Place)| {
            let same = |one: Place| (one.id, one.selector) == (place.id, place.selector);
            self.places().position(same) == Some(at)
        };
        // What is in every frame of an identifier comes along with what is in some.
        let own = |(_, place): &(usize, Place)| place.selector.is_some() || !is_selected(place.id);
        self.places().enumerate().filter(|place| is_first(place) && own(place)).count()
    }
}

/// Collects a master's frames until the position of a drive is complete.
#[derive(Clone, Copy, Debug, Default)]
pub struct Collector {
    master: Master,
    catheter: Partial,
    guidewire: Partial,
}

/// Quantities of a drive that have arrived since its last position.
#[derive(Clone, Copy, Debug, Default)]
struct Partial {
    insertion_m: Option<f32>,
    rotation_rad: Option<f32>,
    held: Option<bool>,
    gripped: Option<bool>,
}

/// Outcome of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameOutcome {
    /// It contains no quantity that is described.
    Foreign,
    /// It is too short for a quantity, or its number is none; the counter tells the reason.
    Rejected(Counter),
    /// It was used; `superseded`: it replaced a quantity that no position has used yet.
    Used { superseded: bool },
}

impl Collector {
    pub fn new(master: Master) -> Self {
        Self { master, ..Self::default() }
    }

    /// The description of the frames.
    pub fn master(&self) -> &Master {
        &self.master
    }

    /// Takes a frame completely or not at all.
    pub fn take(&mut self, frame: &Frame) -> FrameOutcome {
        if !self.master.has(frame.id()) {
            return FrameOutcome::Foreign;
        }
        let mut after = *self;
        match after.read(frame) {
            Ok(Some(superseded)) => {
                *self = after;
                FrameOutcome::Used { superseded }
            }
            Ok(None) => FrameOutcome::Foreign,
            Err(counter) => FrameOutcome::Rejected(counter),
        }
    }

    /// Whether a quantity was superseded; `None` if the frame holds none.
    fn read(&mut self, frame: &Frame) -> Result<Option<bool>, Counter> {
        let Master { catheter, guidewire, grip } = self.master;
        let read = |place: Option<Place>| place.map_or(Ok(None), |place| place.read(frame));
        let pressed = |place| Ok(read(place)?.map(|value| value >= PRESSED));
        let (mut holds, mut superseded) = (false, false);
        for (drive, partial) in [(catheter, &mut self.catheter), (guidewire, &mut self.guidewire)] {
            let Some(drive) = drive else { continue };
            let (insertion, rotation) = (read(Some(drive.insertion))?, read(Some(drive.rotation))?);
            let (held, gripped) = (pressed(drive.held)?, pressed(grip)?);
            holds |=
                insertion.is_some() || rotation.is_some() || held.is_some() || gripped.is_some();
            superseded |= put(&mut partial.insertion_m, insertion);
            superseded |= put(&mut partial.rotation_rad, rotation);
            superseded |= put(&mut partial.held, held);
            superseded |= put(&mut partial.gripped, gripped);
        }
        Ok(holds.then_some(superseded))
    }

    /// A reading of the catheter's drive, once all of its frames have arrived since the last reading.
    pub fn catheter(&mut self) -> Option<Reading> {
        self.catheter.whole(self.master.catheter?, self.master.grip.is_some())
    }

    /// A reading of the guidewire's drive, likewise.
    pub fn guidewire(&mut self) -> Option<Reading> {
        self.guidewire.whole(self.master.guidewire?, self.master.grip.is_some())
    }
}

/// Value from which on a button counts as held; it is 1 while held.
const PRESSED: f32 = 0.5;

fn put<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    value.is_some_and(|value| place.replace(value).is_some())
}

impl Partial {
    fn whole(&mut self, drive: Drive, has_grip: bool) -> Option<Reading> {
        let is_missing = |wanted: bool, known: Option<bool>| wanted && known.is_none();
        if is_missing(drive.held.is_some(), self.held) || is_missing(has_grip, self.gripped) {
            return None;
        }
        let reading = Reading {
            insertion_m: self.insertion_m?,
            rotation_rad: self.rotation_rad?,
            held: self.held,
            gripped: self.gripped.unwrap_or(true),
        };
        *self = Self::default();
        Some(reading)
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
        float: false,
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
        assert_eq!(SIGNAL.read(&data[..1]), Err(Counter::WrongLength), "too short");
    }

    /// As a drive sends its position that counts turns in single precision.
    #[test]
    fn a_floating_point_number_is_read_in_both_orders_and_none_is_refused() {
        let float = Signal { bits: 32, float: true, scale: 2.0, offset: 1.0, ..SIGNAL };
        assert_eq!(float.validate(), Ok(()));
        let mut data = [0xAA; 8];
        data[..4].copy_from_slice(&(-0.25_f32).to_le_bytes());
        assert_eq!(float.read(&data), Ok(0.5));
        let big = Signal { start_bit: 39, big_endian: true, ..float };
        data[4..].copy_from_slice(&3.5_f32.to_be_bytes());
        assert_eq!(big.read(&data), Ok(8.0));
        for value in [-123.456, 0.0, 1e-6] {
            big.write(value, &mut data);
            assert!((f64::from(big.read(&data).unwrap()) - value).abs() < 1e-5, "{value}");
        }
        assert_eq!(float.read(&data), Ok(0.5), "the others stay");
        for none in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            data[..4].copy_from_slice(&none.to_le_bytes());
            assert_eq!(float.read(&data), Err(Counter::BadValue), "{none}");
        }
        assert_eq!(Signal { bits: 31, ..float }.validate(), Err(MasterError::Float));
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
        let place = |id| Place { id, signal: SIGNAL, selector: None };
        let drive = Drive { insertion: place(0x321), rotation: place(0x322), held: None };
        let master = Master { catheter: Some(drive), ..Master::default() };
        assert_eq!(master.validate(), Ok(()));
        for id in [0x800, 0x080, 0x110, 0x180, 0x200, 0x600] {
            let drive = Some(Drive { rotation: place(id), ..drive });
            assert_eq!(Master { catheter: drive, ..master }.validate(), Err(MasterError::Id));
        }
        let grip = Master { grip: Some(place(0x321)), ..Master::default() };
        assert_eq!(grip.validate(), Err(MasterError::Grip));
    }

    /// Feed and turn in frames of their own, the button with the feed, the grip in a third.
    #[test]
    fn a_position_is_whole_when_the_last_of_its_frames_has_come() {
        let place = |id, start_bit, bits| Place {
            id,
            signal: Signal { start_bit, bits, ..SIGNAL },
            selector: None,
        };
        let drive = Drive {
            insertion: place(0x301, 0, 16),
            rotation: place(0x302, 0, 16),
            held: Some(place(0x301, 16, 1)),
        };
        let grip = Some(place(0x303, 0, 8));
        let master = Master { catheter: Some(drive), guidewire: None, grip };
        assert_eq!((master.validate(), master.frames()), (Ok(()), 3));
        let mut collector = Collector::new(master);
        let mut take = |id: u32, data: &[u8]| {
            let taken = collector.take(&Frame::new(id, data).unwrap());
            (taken, collector.catheter())
        };
        let (new, newer) =
            (FrameOutcome::Used { superseded: false }, FrameOutcome::Used { superseded: true });
        assert_eq!(take(0x301, &[7, 0, 1]), (new, None));
        assert_eq!(take(0x302, &[9, 0]), (new, None));
        assert_eq!(take(0x304, &[0; 8]), (FrameOutcome::Foreign, None));
        assert_eq!(take(0x301, &[8, 0, 0]), (newer, None), "of two the newest counts");
        let whole =
            Reading { insertion_m: 8.0, rotation_rad: 9.0, held: Some(false), gripped: true };
        assert_eq!(take(0x303, &[1]), (new, Some(whole)));
        assert_eq!(take(0x303, &[0]), (new, None), "every one of them again");
        // Too short for the button: nothing of it is taken, the feed neither.
        let short = FrameOutcome::Rejected(Counter::WrongLength);
        assert_eq!(take(0x301, &[5, 0]), (short, None));
        assert_eq!(take(0x302, &[1, 0]), (new, None));
        let open =
            Reading { insertion_m: 6.0, rotation_rad: 1.0, held: Some(true), gripped: false };
        assert_eq!(take(0x301, &[6, 0, 1]), (new, Some(open)));
    }

    /// Feed and turn take turns in frames of one identifier.
    #[test]
    fn a_multiplexed_quantity_is_in_the_frames_that_its_selector_names() {
        let selector = |value| Some(Selector { start_bit: 0, bits: 8, big_endian: false, value });
        let signal = Signal { start_bit: 8, ..SIGNAL };
        let place = |value| Place { id: 0x301, signal, selector: selector(value) };
        let (insertion, rotation) = (place(0), place(1));
        let held = Some(Place {
            selector: None,
            signal: Signal { start_bit: 24, bits: 1, ..SIGNAL },
            ..insertion
        });
        let drive = Drive { insertion, rotation, held };
        let master = Master { catheter: Some(drive), ..Master::default() };
        assert_eq!((master.validate(), master.frames()), (Ok(()), 2));
        let mut collector = Collector::new(master);
        let mut take = |data: &[u8]| {
            let taken = collector.take(&Frame::new(0x301, data).unwrap());
            (taken, collector.catheter().map(|reading| (reading.insertion_m, reading.rotation_rad)))
        };
        let used = |superseded| FrameOutcome::Used { superseded };
        assert_eq!(take(&[0, 7, 0, 1]), (used(false), None));
        assert_eq!(take(&[1, 9, 0, 1]), (used(true), Some((7.0, 9.0))), "the button is in both");
        let mut without = collector;
        without.master.catheter = Some(Drive { held: None, ..drive });
        let outcome = without.take(&Frame::new(0x301, &[2, 5, 0]).unwrap());
        assert_eq!(outcome, FrameOutcome::Foreign, "another multiplexed frame");
        let outcome = without.take(&Frame::new(0x301, &[]).unwrap());
        assert_eq!(outcome, FrameOutcome::Rejected(Counter::WrongLength));
        let mut data = [0xFF; 8];
        Selector { start_bit: 15, bits: 12, big_endian: true, value: 0x123 }.write(&mut data);
        assert_eq!(data[..4], [0xFF, 0x12, 0x3F, 0xFF]);
        let wrong = |one: Selector| one.validate() == Err(MasterError::Selector);
        let own = Selector { start_bit: 0, bits: 4, big_endian: false, value: 15 };
        assert!(own.validate().is_ok() && wrong(Selector { value: 16, ..own }));
        assert!(
            wrong(Selector { bits: 0, value: 0, ..own })
                && wrong(Selector { start_bit: 61, ..own })
        );
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_and_nothing_else_is_touched(
            start_bit in 0u8..64, bits in 1u8..=32, big_endian: bool, signed: bool,
            fill: u8, share in 0.0f64..1.0
        ) {
            let signal =
                Signal { start_bit, bits, big_endian, signed, scale: 0.5, offset: 3.0, ..SIGNAL };
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
            start_bit: u8, bits: u8, big_endian: bool, signed: bool, float: bool,
            scale: f32, offset: f32,
            data in prop::collection::vec(any::<u8>(), 0..=8)
        ) {
            let signal = Signal { start_bit, bits, big_endian, signed, float, scale, offset };
            let _ = (signal.validate(), signal.read(&data));
            signal.write(1.0, &mut [0; 8]);
        }
    }
}
