//! Units of the columns of a log.

use std::f64::consts::TAU;

use cathforce_bundle::bundle::{Axis, CommandKind};

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    Time,
    /// A position, or a speed without its time.
    Position(Axis),
    Command(CommandKind, Axis),
}

/// A unit and how many SI units it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveUnit {
    pub name: &'static str,
    pub measure: Measure,
    pub factor: f64,
}

const DEGREE: f64 = TAU / 360.0;
const POUND_FORCE_N: f64 = 4.448_221_615_260_5;
const KILOGRAM_FORCE_N: f64 = 9.806_65;

const fn unit(name: &'static str, measure: Measure, factor: f64) -> DriveUnit {
    DriveUnit { name, measure, factor }
}

const METRES: Measure = Measure::Position(Axis::Linear);
const RADIANS: Measure = Measure::Position(Axis::Rotary);
const NEWTONS: Measure = Measure::Command(CommandKind::Force, Axis::Linear);
const NEWTON_METRES: Measure = Measure::Command(CommandKind::Force, Axis::Rotary);
// The axis of a current or a voltage is that of the position.
const AMPERES: Measure = Measure::Command(CommandKind::Current, Axis::Rotary);
const VOLTS: Measure = Measure::Command(CommandKind::Voltage, Axis::Rotary);

const UNITS: [DriveUnit; 41] = [
    unit("s", Measure::Time, 1.0),
    unit("ms", Measure::Time, 1e-3),
    unit("us", Measure::Time, 1e-6),
    unit("µs", Measure::Time, 1e-6),
    unit("ns", Measure::Time, 1e-9),
    unit("min", Measure::Time, 60.0),
    unit("m", METRES, 1.0),
    unit("cm", METRES, 1e-2),
    unit("mm", METRES, 1e-3),
    unit("um", METRES, 1e-6),
    unit("µm", METRES, 1e-6),
    unit("in", METRES, 0.0254),
    unit("inch", METRES, 0.0254),
    unit("rad", RADIANS, 1.0),
    unit("mrad", RADIANS, 1e-3),
    unit("deg", RADIANS, DEGREE),
    unit("°", RADIANS, DEGREE),
    unit("degrees", RADIANS, DEGREE),
    unit("turn", RADIANS, TAU),
    unit("turns", RADIANS, TAU),
    unit("rev", RADIANS, TAU),
    unit("N", NEWTONS, 1.0),
    unit("mN", NEWTONS, 1e-3),
    unit("kN", NEWTONS, 1e3),
    unit("kgf", NEWTONS, KILOGRAM_FORCE_N),
    unit("lbf", NEWTONS, POUND_FORCE_N),
    unit("Nm", NEWTON_METRES, 1.0),
    unit("N·m", NEWTON_METRES, 1.0),
    unit("N*m", NEWTON_METRES, 1.0),
    unit("mNm", NEWTON_METRES, 1e-3),
    unit("Ncm", NEWTON_METRES, 1e-2),
    unit("Nmm", NEWTON_METRES, 1e-3),
    unit("kgcm", NEWTON_METRES, 1e-2 * KILOGRAM_FORCE_N),
    unit("A", AMPERES, 1.0),
    unit("mA", AMPERES, 1e-3),
    unit("V", VOLTS, 1.0),
    unit("mV", VOLTS, 1e-3),
    unit("amps", AMPERES, 1.0),
    unit("volts", VOLTS, 1.0),
    unit("sec", Measure::Time, 1.0),
    unit("seconds", Measure::Time, 1.0),
];

impl Measure {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Time => "a time",
            Self::Position(_) => "a position",
            Self::Command(CommandKind::Force, _) => "a force or a torque",
            Self::Command(CommandKind::Current, _) => "a current",
            Self::Command(CommandKind::Voltage, _) => "a voltage",
        }
    }

    /// Whether a unit of one may be that of the other, whatever the axis.
    pub fn is_like(self, other: Self) -> bool {
        matches!(
            (self, other),
            (Self::Time, Self::Time)
                | (Self::Position(_), Self::Position(_))
                | (Self::Command(..), Self::Command(..))
        )
    }
}

impl DriveUnit {
    /// By its name; capital letters matter only where they must.
    pub fn parse(name: &str) -> Result<Self, String> {
        let exact = UNITS.iter().find(|unit| unit.name == name);
        let lower = || UNITS.iter().find(|unit| unit.name.to_lowercase() == name.to_lowercase());
        exact.or_else(lower).copied().ok_or_else(|| {
            let names: Vec<&str> = UNITS.iter().map(|unit| unit.name).collect();
            format!("`{name}` is no unit that is known: write one of {}", names.join(", "))
        })
    }

    /// The unit that a column's name ends in: `Pos [deg]`, `speed (rad)`, `t_ms`.
    pub fn of_name(name: &str) -> Option<Self> {
        let trimmed = name.trim_end_matches([']', ')', ' ']);
        let last = trimmed.rsplit(['[', '(', ' ', '_']).next().filter(|last| *last != trimmed)?;
        UNITS.iter().find(|unit| unit.name == last).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_by_name_and_at_the_end_of_a_column() {
        assert_eq!(DriveUnit::parse("ms").unwrap().factor, 1e-3);
        assert_eq!(DriveUnit::parse("DEG").unwrap().name, "deg");
        assert_eq!(DriveUnit::parse("mA").unwrap().factor, 1e-3);
        assert!(DriveUnit::parse("furlong").unwrap_err().contains("write one of s, ms"));
        for (name, unit) in
            [("Pos [deg]", "deg"), ("t_ms", "ms"), ("torque (Nm)", "Nm"), ("I_A", "A")]
        {
            assert_eq!(DriveUnit::of_name(name).map(|own| own.name), Some(unit), "{name}");
        }
        for name in ["m", "position", "time"] {
            assert_eq!(DriveUnit::of_name(name), None, "{name}");
        }
    }
}
