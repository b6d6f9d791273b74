//! Declaration of every setting.
//!
//! The table at the end of this file is the only place where a setting is declared. The struct, its
//! defaults, validation, access by name and [`SETTINGS`] are made from it. The host makes its help and
//! documentation from [`SETTINGS`].

use core::fmt;

use serde::{Deserialize, Serialize};

/// Time of one tick \[s\]. Promises are stated in milliseconds and kept in ticks.
pub const TICK_S: f32 = 1e-3;

/// Largest force on the operator's linear axis, whatever the settings \[N\].
pub const FORCE_HARD_N: f32 = 10.0;
/// Largest torque on the operator's rotary axis, whatever the settings \[N·m\].
pub const TORQUE_HARD_N_M: f32 = 0.1;
/// Longest wait for an encoder sample with output on, whatever the settings \[ticks\].
pub const ENCODER_TIMEOUT_HARD_TICKS: u16 = 5;
/// Longest ramp to zero, whatever the settings \[ticks\].
pub const RAMP_HARD_TICKS: u16 = 20;

/// Factor on slew and ramp: a reserve of 1/1000 keeps rounded sums within the set values.
pub(crate) const ROUNDING: f32 = 0.999;

/// Declaration of a setting, for the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettingInfo {
    /// Name of the field of [`Settings`].
    pub name: &'static str,
    /// Unit of all numbers here; "1" if dimensionless.
    pub unit: &'static str,
    /// Smallest value accepted.
    pub min: f32,
    /// Largest value accepted.
    pub max: f32,
    /// Default value.
    pub default: f32,
    /// Only whole numbers are accepted.
    pub whole: bool,
    /// What it does.
    pub doc: &'static str,
}

/// Why a setting, or [`Settings`] as a whole, is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingError {
    /// There is no setting of that name.
    Unknown,
    /// NaN or infinite.
    NotFinite(&'static str),
    /// Outside the range of its [`SettingInfo`].
    Range(&'static str),
    /// The setting accepts only whole numbers.
    NotWhole(&'static str),
    /// A ramp from this limit to zero would take longer than `ramp_time_ticks`. Lower the limit or raise
    /// its slew rate.
    RampTooSlow(&'static str),
}

impl SettingError {
    /// The setting at fault, if it exists.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Unknown => None,
            Self::NotFinite(name)
            | Self::Range(name)
            | Self::NotWhole(name)
            | Self::RampTooSlow(name) => Some(name),
        }
    }
}

impl fmt::Display for SettingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let info = self.name().and_then(|name| SETTINGS.iter().find(|info| info.name == name));
        let Some(SettingInfo { name, unit, min, max, .. }) = info else {
            return f.write_str("there is no setting of that name");
        };
        match self {
            Self::Unknown => Ok(()),
            Self::NotFinite(_) => write!(f, "{name} is not a finite number"),
            Self::Range(_) => {
                write!(f, "{name} must be between {min} and {max}")?;
                if *unit == "1" { Ok(()) } else { write!(f, " {unit}") }
            }
            Self::NotWhole(_) => write!(f, "{name} counts {unit}: it must be a whole number"),
            Self::RampTooSlow(_) => write!(
                f,
                "{name} cannot be ramped to zero within ramp_time_ticks: lower it, or raise its slew"
            ),
        }
    }
}

impl core::error::Error for SettingError {}

/// A type that a setting may have.
trait Number: Copy {
    const WHOLE: bool;
    fn widen(self) -> f32;
    /// `None` if this type cannot represent the value.
    fn narrow(value: f32) -> Option<Self>;
}

impl Number for f32 {
    const WHOLE: bool = false;
    fn widen(self) -> f32 {
        self
    }
    fn narrow(value: f32) -> Option<Self> {
        Some(value)
    }
}

impl Number for u16 {
    const WHOLE: bool = true;
    fn widen(self) -> f32 {
        f32::from(self)
    }
    fn narrow(value: f32) -> Option<Self> {
        let whole = value as u16;
        (f32::from(whole) == value).then_some(whole)
    }
}

impl SettingInfo {
    fn check(&self, value: f32) -> Result<(), SettingError> {
        if !value.is_finite() {
            Err(SettingError::NotFinite(self.name))
        } else if value < self.min || value > self.max {
            Err(SettingError::Range(self.name))
        } else {
            Ok(())
        }
    }
}

macro_rules! settings {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident: $kind:ident {
            unit: $unit:literal,
            default: $default:expr,
            range: $min:expr, $max:expr $(,)?
        }
    )+) => {
        /// Settings of the operator. The hard limits hold even if these numbers are corrupt.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        pub struct Settings {
            $( $(#[doc = $doc])+ pub $name: $kind, )+
        }

        impl Default for Settings {
            fn default() -> Self {
                Self { $( $name: $default, )+ }
            }
        }

        /// Every setting, in the order of [`Settings`].
        pub const SETTINGS: &[SettingInfo] = &[ $( SettingInfo {
            name: stringify!($name),
            unit: $unit,
            min: $min as f32,
            max: $max as f32,
            default: $default as f32,
            whole: <$kind as Number>::WHOLE,
            doc: concat!($($doc),+).trim_ascii(),
        }, )+ ];

        impl Settings {
            /// Every setting with its value, in the order of [`SETTINGS`].
            pub fn iter(&self) -> impl Iterator<Item = (&'static SettingInfo, f32)> {
                SETTINGS.iter().zip([ $( self.$name.widen(), )+ ])
            }

            /// Sets one setting by name. On an error nothing changes.
            pub fn set(&mut self, name: &str, value: f32) -> Result<(), SettingError> {
                let info = SETTINGS.iter().find(|s| s.name == name).ok_or(SettingError::Unknown)?;
                info.check(value)?;
                match name {
                    $( stringify!($name) => {
                        self.$name = <$kind>::narrow(value).ok_or(SettingError::NotWhole(info.name))?;
                    } )+
                    _ => return Err(SettingError::Unknown),
                }
                Ok(())
            }

            /// Replaces every number by `f(index, number)` without checks, for tests of robustness.
            #[cfg(test)]
            pub(crate) fn corrupt(&mut self, f: impl Fn(usize, f32) -> f32) {
                let mut index = 0..;
                $( self.$name = f(index.next().unwrap_or(0), self.$name.widen()) as $kind; )+
            }
        }
    };
}

impl Settings {
    /// One setting by name; `None` if there is none of that name.
    pub fn get(&self, name: &str) -> Option<f32> {
        self.iter().find(|(info, _)| info.name == name).map(|(_, value)| value)
    }

    /// Checks every number, and that each limit can be ramped down in time. Returns the first error.
    pub fn validate(&self) -> Result<(), SettingError> {
        for (info, value) in self.iter() {
            info.check(value)?;
        }
        let ramp_s = ROUNDING * ROUNDING * TICK_S * f32::from(self.ramp_time_ticks);
        if self.force_limit_n > self.force_slew_n_per_s * ramp_s {
            return Err(SettingError::RampTooSlow("force_limit_n"));
        }
        if self.torque_limit_n_m > self.torque_slew_n_m_per_s * ramp_s {
            return Err(SettingError::RampTooSlow("torque_limit_n_m"));
        }
        Ok(())
    }
}

settings! {
    /// Force on the operator's linear axis over the axial force at the drive.
    force_gain: f32 { unit: "1", default: 1.0, range: 0.0, 20.0 }
    /// Torque on the operator's rotary axis over the torque at the drive.
    torque_gain: f32 { unit: "1", default: 1.0, range: 0.0, 20.0 }
    /// Force at the drive below which nothing is felt; subtracted above it, before the gain.
    force_deadband_n: f32 { unit: "N", default: 0.0, range: 0.0, 1.0 }
    /// Torque at the drive below which nothing is felt; subtracted above it, before the gain.
    torque_deadband_n_m: f32 { unit: "N·m", default: 0.0, range: 0.0, 0.01 }
    /// Largest force on the operator's linear axis.
    force_limit_n: f32 { unit: "N", default: 3.0, range: 0.0, FORCE_HARD_N }
    /// Largest torque on the operator's rotary axis.
    torque_limit_n_m: f32 {
        unit: "N·m", default: 0.03, range: 0.0, TORQUE_HARD_N_M
    }
    /// Fastest change of the force on the operator's linear axis.
    force_slew_n_per_s: f32 { unit: "N/s", default: 200.0, range: 1.0, 2000.0 }
    /// Fastest change of the torque on the operator's rotary axis.
    torque_slew_n_m_per_s: f32 {
        unit: "N·m/s", default: 2.0, range: 0.01, 20.0
    }
    /// Energy that may come out of the operator's axes, net, since arming; half from each.
    energy_limit_j: f32 { unit: "J", default: 0.1, range: 0.0, 1.0 }
    /// A feed faster than this between two samples is an encoder fault, not a motion.
    max_insertion_speed_m_per_s: f32 {
        unit: "m/s", default: 0.2, range: 0.001, 1.0
    }
    /// A rotation faster than this between two samples is an encoder fault, not a motion.
    max_rotation_speed_rad_per_s: f32 {
        unit: "rad/s", default: 20.0, range: 0.1, 200.0
    }
    /// Largest insertion that an encoder sample may claim.
    max_insertion_m: f32 { unit: "m", default: 1.0, range: 0.001, 1.6 }
    /// Largest rotation, either way, that an encoder sample may claim.
    max_rotation_rad: f32 { unit: "rad", default: 80.0, range: 0.1, 83.0 }
    /// Largest displacement of a tendon, either way, that its drive's encoder may claim.
    max_tendon_m: f32 { unit: "m", default: 0.05, range: 0.0001, 0.5 }
    /// A displacement faster than this between two samples is an encoder fault, not a motion.
    max_tendon_speed_m_per_s: f32 {
        unit: "m/s", default: 0.2, range: 0.001, 2.0
    }
    /// Ticks without a valid encoder sample after which output ramps to zero.
    encoder_timeout_ticks: u16 {
        unit: "ticks", default: 5, range: 1, ENCODER_TIMEOUT_HARD_TICKS
    }
    /// Ticks in which a ramp reaches zero.
    ramp_time_ticks: u16 { unit: "ticks", default: 20, range: 1, RAMP_HARD_TICKS }
    /// Ticks that the model may take to reach the measured insertion before output can be armed.
    settle_timeout_ticks: u16 { unit: "ticks", default: 10000, range: 100, 60000 }
    /// Successive ticks for which a force may be held because the model did not converge.
    unresolved_limit_ticks: u16 { unit: "ticks", default: 250, range: 1, 500 }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::string::ToString;

    #[test]
    fn the_table_is_sound() {
        assert_eq!(Settings::default().validate(), Ok(()));
        for info in SETTINGS {
            assert!(info.min <= info.default && info.default <= info.max, "{}", info.name);
            assert!(!info.doc.is_empty() && info.doc.ends_with('.'), "{}", info.name);
            assert_eq!(SETTINGS.iter().filter(|other| other.name == info.name).count(), 1);
        }
    }

    #[test]
    fn every_setting_is_read_and_written_by_name() {
        for info in SETTINGS {
            let mut settings = Settings::default();
            let bound = if info.default == info.min { info.max } else { info.min };
            assert_eq!(settings.get(info.name), Some(info.default));
            assert_eq!(settings.set(info.name, bound), Ok(()));
            assert_eq!(settings.get(info.name), Some(bound));
            let changed = settings.iter().filter(|(info, value)| *value != info.default);
            assert_eq!(changed.count(), 1, "{}", info.name);
        }
    }

    #[test]
    fn what_is_refused_changes_nothing_and_says_why() {
        let mut settings = Settings::default();
        for (name, value, error, text) in [
            ("nope", 1.0, SettingError::Unknown, "there is no setting of that name"),
            (
                "force_gain",
                f32::NAN,
                SettingError::NotFinite("force_gain"),
                "force_gain is not a finite number",
            ),
            (
                "force_limit_n",
                10.5,
                SettingError::Range("force_limit_n"),
                "force_limit_n must be between 0 and 10 N",
            ),
            (
                "ramp_time_ticks",
                2.5,
                SettingError::NotWhole("ramp_time_ticks"),
                "ramp_time_ticks counts ticks: it must be a whole number",
            ),
        ] {
            assert_eq!(settings.set(name, value), Err(error));
            assert_eq!(error.to_string(), text);
            assert_eq!(settings, Settings::default());
        }
    }

    #[test]
    fn a_limit_that_cannot_be_ramped_down_in_time_is_refused() {
        let settings = Settings { force_slew_n_per_s: 100.0, ..Settings::default() };
        assert_eq!(settings.validate(), Err(SettingError::RampTooSlow("force_limit_n")));
        let settings = Settings { ramp_time_ticks: 10, ..Settings::default() };
        assert_eq!(settings.validate(), Err(SettingError::RampTooSlow("force_limit_n")));
        let settings = Settings { torque_slew_n_m_per_s: 1.0, ..Settings::default() };
        assert_eq!(settings.validate(), Err(SettingError::RampTooSlow("torque_limit_n_m")));
    }
}
