//! All numbers that can be set by name: settings of the operator, and parameters of the rig and its
//! effects.

use cathforce_control::{SETTINGS, SettingInfo, Settings};
use cathforce_mechanics::{Description, ParameterInfo, parameters};

/// A number that can be set by name.
#[derive(Clone, Copy, Debug)]
pub enum Key {
    /// A number of [`Settings`].
    Setting(&'static SettingInfo),
    /// A number of [`Description`].
    Parameter(&'static ParameterInfo),
}

/// Why a value is refused. [`Settings::validate`] also checks settings against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyError {
    NotFinite,
    Range,
    NotWhole,
}

/// All keys: first the settings, then the parameters, each in the order of declaration.
pub fn keys() -> impl Iterator<Item = Key> {
    SETTINGS.iter().map(Key::Setting).chain(parameters().map(Key::Parameter))
}

impl Key {
    /// The key with this name; `None` if there is none.
    pub fn find(name: &str) -> Option<Self> {
        keys().find(|key| key.name() == name)
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Setting(info) => info.name,
            Self::Parameter(info) => info.key,
        }
    }

    /// Unit; "1" if dimensionless.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Setting(info) => info.unit,
            Self::Parameter(info) => info.unit,
        }
    }

    /// Smallest and largest value.
    pub const fn range(self) -> [f32; 2] {
        match self {
            Self::Setting(info) => [info.min, info.max],
            Self::Parameter(info) => [info.min as f32, info.max as f32],
        }
    }

    /// Default value; `None` for numbers that rig.toml states.
    pub fn default(self) -> Option<f32> {
        match self {
            Self::Setting(info) => Some(info.default),
            Self::Parameter(info) => info.off.map(|off| off as f32),
        }
    }

    /// Only whole numbers are accepted.
    pub const fn is_whole(self) -> bool {
        match self {
            Self::Setting(info) => info.whole,
            Self::Parameter(info) => info.whole,
        }
    }

    /// Description.
    pub const fn doc(self) -> &'static str {
        match self {
            Self::Setting(info) => info.doc,
            Self::Parameter(info) => info.doc,
        }
    }

    /// Its value in a description and settings.
    pub fn value(self, description: &Description<f32>, settings: &Settings) -> Option<f32> {
        match self {
            Self::Setting(info) => settings.get(info.name),
            Self::Parameter(info) => description.parameter(info.key),
        }
    }

    /// Checks a value.
    pub fn check(self, value: f32) -> Result<(), KeyError> {
        let [min, max] = self.range();
        if !value.is_finite() {
            Err(KeyError::NotFinite)
        } else if value < min || value > max {
            Err(KeyError::Range)
        } else if self.is_whole() && value != (value as u32) as f32 {
            Err(KeyError::NotWhole)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn every_key_is_found_by_its_name_which_no_other_has() {
        for key in keys() {
            assert_eq!(keys().filter(|other| other.name() == key.name()).count(), 1);
            assert_eq!(Key::find(key.name()).map(Key::name), Some(key.name()));
            let [min, max] = key.range();
            assert!(min < max, "{}", key.name());
            assert!(key.default().is_none_or(|value| key.check(value).is_ok()), "{}", key.name());
        }
        assert!(Key::find("nope").is_none());
    }

    /// The check here and the check of whoever owns the number say the same.
    #[test]
    fn a_value_is_refused_here_exactly_when_it_cannot_be_set() {
        let mut description = crate::image::tests::wire::wire();
        for key in keys() {
            let [min, max] = key.range();
            let beyond = 1e-3 * (max - min);
            for value in [min - beyond, min, 0.5 * (min + max) + 0.3, max, max + beyond, f32::NAN] {
                let set = match key {
                    Key::Setting(info) => Settings::default().set(info.name, value).is_ok(),
                    Key::Parameter(info) => description.set_parameter(info.key, value).is_ok(),
                };
                assert_eq!(key.check(value).is_ok(), set, "{} {value}", key.name());
                let found = key.value(&description, &Settings::default());
                let taken = matches!(key, Key::Setting(_)) || !set || found == Some(value);
                assert!(taken, "{} {value}", key.name());
            }
        }
    }
}
