//! What the catalogue says of one effect.

use cathforce_mechanics::{Description, ParameterError, ParameterInfo, Real, parameters};
use serde::Serialize;

/// The plants that an effect can belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Plant {
    /// An instrument in a vessel.
    Catheter,
    /// One axis on its own: mass, force command, position.
    Drive,
    /// What carries a motion from a drive to where it is used.
    Transmission,
}

/// A measured channel, by its columns in a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Channel {
    /// `fx_N` `fy_N` `fz_N`
    #[serde(rename = "force")]
    Force,
    /// `drive_fx_N`
    #[serde(rename = "drive_force")]
    DriveForce,
    /// `tip_x_m` …
    #[serde(rename = "tip")]
    Tip,
    /// `p00_x_m` …
    #[serde(rename = "shape")]
    Shape,
    /// `drive_command_N` of a drive.
    #[serde(rename = "drive_command")]
    DriveCommand,
    /// `output_m` or `output_rad` of a transmission.
    #[serde(rename = "output")]
    Output,
}

/// The role of a parameter in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Fitted; starting values are absolute.
    Value,
    /// Fitted; starting values are multiples of the nominal value.
    TimesNominal,
    /// A coordinate of a point on the vessel's centre line; starting points lie along the tip's way.
    Place,
    /// Held at its default unless a user sets it.
    Held,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name in reports.
    pub name: &'static str,
    /// Key in settings.
    pub key: &'static str,
    /// Plausible size of its deviation from off or nominal (one standard deviation), in its unit.
    pub prior_scale: f64,
    pub role: Role,
    /// Values with which every start is combined. Used for frequencies and phases, where a fit converges
    /// only from nearby; empty for other parameters, whose values are in the starts.
    pub scan: &'static [f64],
}

/// One effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// `group.effect`.
    pub id: &'static str,
    pub plant: Plant,
    /// Description in a sentence.
    pub doc: &'static str,
    pub parameters: &'static [Parameter],
    /// Switched-on values, one for each parameter whose role is [`Role::Value`] or
    /// [`Role::TimesNominal`], in their order; those with a scan come last and are left out.
    pub start_values: &'static [&'static [f64]],
    /// Channels that it changes directly, the most informative one first.
    pub channels: &'static [Channel],
    /// Motion that a trial must contain to show it.
    pub excited_by: &'static str,
    /// Effects for which it is easily mistaken.
    pub confused_with: &'static [&'static str],
}

impl Parameter {
    /// Unit, off value and range.
    pub fn info(&self) -> &'static ParameterInfo {
        const NONE: ParameterInfo = ParameterInfo {
            key: "",
            unit: "1",
            off: None,
            min: 0.0,
            max: 0.0,
            whole: false,
            doc: "",
        };
        // A test checks that every key exists.
        parameters().find(|info| info.key == self.key).unwrap_or(&NONE)
    }

    /// Whether a fit may change it.
    pub fn is_fitted(&self) -> bool {
        self.role != Role::Held
    }

    /// Its value in a description if the effect is off.
    pub fn off<T: Real>(&self, nominal: &Description<T>) -> Option<T> {
        nominal.parameter(self.key)
    }
}

impl Effect {
    /// Values from which a fit starts, besides off: [`Self::start_values`] combined with all scanned
    /// values.
    pub fn starts(&self) -> Vec<Vec<f64>> {
        let starts = self.start_values.iter().map(|values| values.to_vec()).collect();
        let scans = self.parameters.iter().map(|p| p.scan).filter(|scan| !scan.is_empty());
        scans.fold(starts, |starts: Vec<Vec<f64>>, scan| {
            let with = |start: &Vec<f64>, value: f64| [start.as_slice(), &[value]].concat();
            starts.iter().flat_map(|start| scan.iter().map(|&v| with(start, v))).collect()
        })
    }

    /// Parameters and values of a start, in the order of [`Self::parameters`], without those of
    /// [`Role::Place`].
    pub fn start<T: Real>(
        &self,
        nominal: &Description<T>,
        start: &[f64],
    ) -> Vec<(&'static Parameter, T)> {
        let fitted = self
            .parameters
            .iter()
            .filter(|parameter| matches!(parameter.role, Role::Value | Role::TimesNominal));
        fitted
            .zip(start)
            .filter_map(|(parameter, &value)| {
                let value = match parameter.role {
                    Role::TimesNominal => parameter.off(nominal)? * T::lit(value),
                    _ => T::lit(value),
                };
                Some((parameter, value))
            })
            .collect()
    }

    /// Sets parameters of a description.
    pub fn apply<T: Real>(
        description: &mut Description<T>,
        values: &[(&'static Parameter, T)],
    ) -> Result<(), ParameterError> {
        values
            .iter()
            .try_for_each(|(parameter, value)| description.set_parameter(parameter.key, *value))
    }
}

pub const fn fitted(name: &'static str, key: &'static str, prior_scale: f64) -> Parameter {
    Parameter { name, key, prior_scale, role: Role::Value, scan: &[] }
}

/// Two phases a quarter of a turn apart, which span all others.
pub const PHASES_RAD: [f64; 2] = [0.0, 1.57];

pub const fn scanned(
    name: &'static str,
    key: &'static str,
    prior_scale: f64,
    scan: &'static [f64],
) -> Parameter {
    Parameter { name, key, prior_scale, role: Role::Value, scan }
}

pub const fn held(name: &'static str, key: &'static str, prior_scale: f64) -> Parameter {
    Parameter { name, key, prior_scale, role: Role::Held, scan: &[] }
}
