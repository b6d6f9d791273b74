//! A rig whose only effect is the settings that a calibration fits.

use cathforce_effect_catalogue::all;
use cathforce_mechanics::{ParameterInfo, parameters};

use super::library::Library;
use super::plant::Catheter;
use crate::plant::{Effect, Parameter, Plant};

/// A setting to fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Key of a parameter of the model.
    pub key: &'static str,
    pub low: f64,
    pub high: f64,
    /// Standard deviation of the prior around what the rig states.
    pub scale: f64,
}

/// What is known of a setting before anything is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    pub info: &'static ParameterInfo,
    /// What rig.toml states, or where the effect is off.
    pub nominal: f64,
    /// Plausible deviation from that, of the catalogue; `None` of what no effect has.
    pub scale: Option<f64>,
    /// The effect that it belongs to.
    pub effect: Option<&'static cathforce_effect_catalogue::Effect>,
}

impl Catheter {
    /// What this rig and the catalogue know of a setting; `None` of what is no parameter of its model.
    pub fn known(&self, key: &str) -> Option<Known> {
        let info = parameters().find(|info| info.key == key)?;
        let nominal = self.nominal.parameter(key)?;
        let mut owned = all().flat_map(|effect| effect.parameters.iter().map(move |p| (effect, p)));
        let own = owned.find(|(_, p)| p.key == key);
        Some(Known {
            info,
            nominal,
            scale: own.map(|(_, p)| p.prior_scale),
            effect: own.map(|(effect, _)| effect),
        })
    }

    /// The same rig and trials with one effect, which is these settings.
    pub fn fitting(mut self, wanted: &[Wanted]) -> Self {
        let parameter = |own: &Wanted| {
            let known = self.known(own.key);
            Parameter {
                name: own.key,
                unit: known.map_or("1", |known| known.info.unit),
                low: own.low,
                high: own.high,
                off: known.map_or(own.low, |known| known.nominal),
                scale: own.scale,
            }
        };
        let effect = Effect {
            id: "settings",
            what: "the settings that are calibrated",
            parameters: wanted.iter().map(parameter).collect(),
            starts: Vec::new(),
            confused_with: &[],
        };
        let keys = vec![wanted.iter().map(|own| own.key).collect()];
        self.library = Library { effects: vec![effect], keys };
        debug_assert_eq!(self.effects().len(), 1);
        self
    }
}
