//! Raw codes of the process frames, each with its unit.
//!
//! `from_*` rounds to the nearest code and saturates; NaN becomes 0. Decoding is one multiplication,
//! which gives the same bits on host and device.

/// The nearest code, with halves rounded away from zero. The caller's cast saturates, and makes NaN 0.
fn nearest(value: f32, unit: f32) -> f32 {
    let code = value / unit;
    code + if code < 0.0 { -0.5 } else { 0.5 }
}

/// Defines a 16-bit code: name, unit of one count, conversions.
macro_rules! code_i16 {
    ($(#[$doc:meta])* $name:ident, $unit:literal, $from:ident, $to:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
        pub struct $name(pub i16);

        impl $name {
            /// Quantity of one count.
            pub const UNIT: f32 = $unit;

            #[doc = "Nearest code, saturating."]
            pub fn $from(value: f32) -> Self {
                Self(nearest(value, Self::UNIT) as i16)
            }

            #[doc = "The quantity."]
            pub fn $to(self) -> f32 {
                f32::from(self.0) * Self::UNIT
            }
        }
    };
}

code_i16!(
    /// Force rendered to the operator's linear axis, 0.5 mN a count (±16.4 N).
    HapticForce, 5e-4, from_n, n
);
code_i16!(
    /// Torque rendered to the operator's rotary axis, 2 µN·m a count (±65.5 mN·m).
    HapticTorque, 2e-6, from_n_m, n_m
);
code_i16!(
    /// Contact or drive force, 0.1 mN a count (±3.28 N).
    Force, 1e-4, from_n, n
);
code_i16!(
    /// Torque at the drive, 0.5 µN·m a count (±16.4 mN·m).
    DriveTorque, 5e-7, from_n_m, n_m
);
code_i16!(
    /// Moment on the vessel, 10 µN·m a count (±0.328 N·m).
    Moment, 1e-5, from_n_m, n_m
);
code_i16!(
    /// Coordinate relative to the entry, 20 µm a count (±0.655 m).
    Position, 2e-5, from_m, m
);

/// Half width of a band, 0.5 mN a count (0 to 2.047 N).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BandWidth(pub(crate) u16);

impl BandWidth {
    /// Quantity of one count \[N\].
    pub const UNIT_N: f32 = 5e-4;
    /// Code of an unknown width: the highest of 12 bits.
    pub(crate) const UNKNOWN: u16 = 0xFFF;

    /// Nearest code, saturating.
    pub fn from_n(value: f32) -> Self {
        Self((nearest(value, Self::UNIT_N) as u16).min(Self::UNKNOWN - 1))
    }

    /// The quantity \[N\].
    pub fn n(self) -> f32 {
        f32::from(self.0) * Self::UNIT_N
    }

    pub(crate) fn known(code: u16) -> Option<Self> {
        (code < Self::UNKNOWN).then_some(Self(code))
    }
}

/// Insertion of the drive: 24 bits without sign, 100 nm a count (0 to 1.678 m).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Insertion(u32);

impl Insertion {
    /// Quantity of one count \[m\].
    pub const UNIT_M: f32 = 1e-7;
    const MAX: u32 = 0xFF_FFFF;

    /// Nearest code, saturating; negative insertions become 0.
    ///
    /// Takes `f64`, because recordings have a finer resolution than `f32`.
    pub fn from_m(value: f64) -> Self {
        Self(((value * 1e7 + 0.5) as u32).min(Self::MAX))
    }

    /// The quantity \[m\].
    pub fn m(self) -> f32 {
        // 24 bits are exact in f32, so only the product is rounded.
        self.0 as f32 * Self::UNIT_M
    }

    pub(crate) fn to_bytes(self) -> [u8; 3] {
        let [a, b, c, _] = self.0.to_le_bytes();
        [a, b, c]
    }

    pub(crate) fn from_bytes([a, b, c]: [u8; 3]) -> Self {
        Self(u32::from_le_bytes([a, b, c, 0]))
    }
}

/// Rotation of the drive: 24 bits with sign, 10 µrad a count (±83.9 rad).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Rotation(i32);

impl Rotation {
    /// Quantity of one count \[rad\].
    pub const UNIT_RAD: f32 = 1e-5;
    const MAX: i32 = 0x7F_FFFF;

    /// Nearest code, saturating.
    pub fn from_rad(value: f64) -> Self {
        let code = value * 1e5;
        let code = (code + if code < 0.0 { -0.5 } else { 0.5 }) as i32;
        Self(code.clamp(-Self::MAX - 1, Self::MAX))
    }

    /// The quantity \[rad\].
    pub fn rad(self) -> f32 {
        self.0 as f32 * Self::UNIT_RAD
    }

    pub(crate) fn to_bytes(self) -> [u8; 3] {
        let [a, b, c, _] = self.0.to_le_bytes();
        [a, b, c]
    }

    pub(crate) fn from_bytes([a, b, c]: [u8; 3]) -> Self {
        // Shifting down from the high bytes extends the sign.
        Self(i32::from_le_bytes([0, a, b, c]) >> 8)
    }
}

/// Displacement of a tendon's drive: 24 bits with sign, 100 nm a count (±0.839 m).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Displacement(i32);

impl Displacement {
    /// Quantity of one count \[m\].
    pub const UNIT_M: f32 = 1e-7;
    const MAX: i32 = 0x7F_FFFF;

    /// Nearest code, saturating.
    pub fn from_m(value: f64) -> Self {
        let code = value * 1e7;
        let code = (code + if code < 0.0 { -0.5 } else { 0.5 }) as i32;
        Self(code.clamp(-Self::MAX - 1, Self::MAX))
    }

    /// The quantity \[m\].
    pub fn m(self) -> f32 {
        // 24 bits are exact in f32, so only the product is rounded.
        self.0 as f32 * Self::UNIT_M
    }

    pub(crate) fn to_bytes(self) -> [u8; 3] {
        let [a, b, c, _] = self.0.to_le_bytes();
        [a, b, c]
    }

    pub(crate) fn from_bytes([a, b, c]: [u8; 3]) -> Self {
        // Shifting down from the high bytes extends the sign.
        Self(i32::from_le_bytes([0, a, b, c]) >> 8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn out_of_range_saturates_and_nan_is_zero() {
        assert_eq!(Force::from_n(1e9).0, i16::MAX);
        assert_eq!(Force::from_n(f32::NEG_INFINITY).0, i16::MIN);
        assert_eq!(Force::from_n(f32::NAN).0, 0);
        assert_eq!(Insertion::from_m(-0.1), Insertion::default());
        assert_eq!(Insertion::from_m(f64::NAN), Insertion::default());
        assert_eq!(Insertion::from_m(9.0).to_bytes(), [0xFF; 3]);
        assert_eq!(Rotation::from_rad(1e9).to_bytes(), [0xFF, 0xFF, 0x7F]);
        assert_eq!(Rotation::from_rad(-1e9).to_bytes(), [0, 0, 0x80]);
        assert_eq!(Displacement::from_m(1e9).to_bytes(), [0xFF, 0xFF, 0x7F]);
        assert_eq!(Displacement::from_m(-1e9).to_bytes(), [0, 0, 0x80]);
        assert_eq!(Displacement::from_m(f64::NAN), Displacement::default());
    }

    proptest! {
        #[test]
        fn a_quantity_comes_back_within_half_a_count(x in -3.2f32..3.2, s in 0.0f64..1.6, r in -80.0f64..80.0) {
            prop_assert!((Force::from_n(x).n() - x).abs() <= 0.51 * Force::UNIT);
            // Half a count, and what f32 loses of the product.
            let within = |half: f64, value: f64| half + 1.2e-7 * value.abs();
            prop_assert!((f64::from(Insertion::from_m(s).m()) - s).abs() <= within(5e-8, s));
            prop_assert!((f64::from(Rotation::from_rad(r).rad()) - r).abs() <= within(5e-6, r));
            let pulled = 0.01 * r;
            prop_assert!(
                (f64::from(Displacement::from_m(pulled).m()) - pulled).abs() <= within(5e-8, pulled)
            );
        }

        #[test]
        fn every_code_survives_the_way_through_its_quantity(code: i16) {
            prop_assert_eq!(HapticForce::from_n(HapticForce(code).n()).0, code);
            prop_assert_eq!(HapticTorque::from_n_m(HapticTorque(code).n_m()).0, code);
            prop_assert_eq!(Force::from_n(Force(code).n()).0, code);
            prop_assert_eq!(DriveTorque::from_n_m(DriveTorque(code).n_m()).0, code);
            prop_assert_eq!(Moment::from_n_m(Moment(code).n_m()).0, code);
            prop_assert_eq!(Position::from_m(Position(code).m()).0, code);
        }

        #[test]
        fn every_three_bytes_are_an_encoder_reading(bytes: [u8; 3]) {
            prop_assert_eq!(Insertion::from_bytes(bytes).to_bytes(), bytes);
            prop_assert_eq!(Rotation::from_bytes(bytes).to_bytes(), bytes);
            prop_assert_eq!(Displacement::from_bytes(bytes).to_bytes(), bytes);
        }
    }
}
