//! Every number that can be set by name, whoever declares it: settings of the operator, numbers of
//! the rig and its effects.

use cathforce_control::{SETTINGS, SettingInfo, Settings};
use cathforce_mechanics::{Description, ParameterInfo, parameters};

/// A number with a name.
#[derive(Clone, Copy, Debug)]
pub enum Key {
    /// Of [`Settings`].
    Setting(&'static SettingInfo),
    /// Of [`Description`].
    Parameter(&'static ParameterInfo),
}

/// Why a value is refused. Of a setting whose range depends on others, `Settings::validate` says
/// more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyError {
    NotFinite,
    Range,
    NotWhole,
}

/// Every key, those of the settings first, each group in the order of its declaration.
pub fn keys() -> impl Iterator<Item = Key> {
    SETTINGS.iter().map(Key::Setting).chain(parameters().map(Key::Parameter))
}

impl Key {
    /// The key of this name.
    pub fn find(name: &str) -> Option<Self> {
        keys().find(|key| key.name() == name)
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Setting(info) => info.name,
            Self::Parameter(info) => info.key,
        }
    }

    /// Unit of its numbers; "1" for a pure number.
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

    /// The value when nothing is said; `None` for what rig.toml states.
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

    /// What it does.
    pub const fn doc(self) -> &'static str {
        match self {
            Self::Setting(info) => info.doc,
            Self::Parameter(info) => info.doc,
        }
    }

    /// Its value in a device image.
    pub fn value(self, description: &Description<f32>, settings: &Settings) -> Option<f32> {
        match self {
            Self::Setting(info) => settings.get(info.name),
            Self::Parameter(info) => description.parameter(info.key),
        }
    }

    /// Whether a value may be set.
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
