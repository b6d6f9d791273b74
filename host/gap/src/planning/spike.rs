//! Effects put into measured data: the request, the parameters that result, and the change of the data.

use cathforce_bundle::Bundle;

use crate::plant::{Effect, Point};

/// An effect and the parameters that are wanted of it; the others are moved by its first switch-on
/// start.
#[derive(Clone, Debug, PartialEq)]
pub struct Spike {
    /// Of `cathforce gap effects`.
    pub id: String,
    /// Names as reports have them, values in their units.
    pub parameters: Vec<(String, f64)>,
}

/// Why an effect cannot be put in.
#[derive(Debug, thiserror::Error)]
pub enum SpikeError {
    #[error("this rig cannot have {id}; it can have {known}")]
    Effect { id: String, known: String },
    #[error("{id} has no parameter `{name}`{hint}; it has {known}")]
    Parameter { id: String, name: String, hint: String, known: String },
    #[error(
        "{name} of {id} is {value} {unit}, and must be from {low} to {high}",
        unit = if *unit == "1" { "" } else { unit }
    )]
    Range { id: String, name: String, value: f64, unit: &'static str, low: f64, high: f64 },
    #[error("{0} is put in twice; fix: name it once, with all of its parameters")]
    Twice(&'static str),
    #[error("the device's model breaks down on trial {0:03} with this effect; make it smaller")]
    BreaksDown(u32),
}

/// A bundle with effects in its data.
#[derive(Clone, Debug)]
pub struct Spiked {
    pub bundle: Bundle,
    /// Every parameter that was put in: effect, name, value, unit.
    pub parameters: Parameters,
    pub changes: Changes,
}

/// Root mean square of what changed over all rows, as a vector; `None` where not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Changes {
    pub force_n: Option<f64>,
    pub drive_force_n: Option<f64>,
    pub tip_m: Option<f64>,
    pub shape_m: Option<f64>,
}

/// Parameters that were put in: effect, name, value, unit.
pub type Parameters = Vec<(&'static str, &'static str, f64, &'static str)>;

/// A point with effects beside those that are `present`, and the parameters of those that are put
/// in.
pub(crate) fn point(
    effects: &[Effect],
    present: &Point,
    spikes: &[Spike],
) -> Result<(Point, Parameters), SpikeError> {
    let mut point = present.clone();
    let mut parameters = Parameters::new();
    for spike in spikes {
        let at = effects.iter().position(|effect| effect.id == spike.id);
        let at = at.ok_or_else(|| SpikeError::Effect {
            id: spike.id.clone(),
            known: effects.iter().map(|effect| effect.id).collect::<Vec<_>>().join(", "),
        })?;
        if parameters.iter().any(|(id, ..)| *id == effects[at].id) {
            return Err(SpikeError::Twice(effects[at].id));
        }
        let values = values(&effects[at], spike, &present.effects[at])?;
        let named = effects[at].parameters.iter().zip(&values);
        parameters.extend(named.map(|(p, &value)| (effects[at].id, p.name, value, p.unit)));
        point.effects[at] = values;
    }
    Ok((point, parameters))
}

/// The values of all parameters of an effect, which has others already.
fn values(effect: &Effect, spike: &Spike, present: &[f64]) -> Result<Vec<f64>, SpikeError> {
    let mut values = present.to_vec();
    let starts = effect.starts.first().into_iter().flatten();
    for ((value, start), p) in values.iter_mut().zip(starts).zip(&effect.parameters) {
        *value = if *value == p.off { *start } else { *value + start - p.off };
    }
    for (name, value) in &spike.parameters {
        let at = effect.parameters.iter().position(|p| p.name == name);
        let at = at.ok_or_else(|| {
            let known: Vec<&str> = effect.parameters.iter().map(|p| p.name).collect();
            let near = cathforce_bundle::nearest(name, &known);
            SpikeError::Parameter {
                id: spike.id.clone(),
                name: name.clone(),
                hint: near.map_or(String::new(), |near| format!(", did you mean `{near}`?")),
                known: known.join(", "),
            }
        })?;
        let p = &effect.parameters[at];
        if !(p.low..=p.high).contains(value) {
            return Err(SpikeError::Range {
                id: spike.id.clone(),
                name: name.clone(),
                value: *value,
                unit: p.unit,
                low: p.low,
                high: p.high,
            });
        }
        values[at] = *value;
    }
    Ok(values)
}

/// Sum of squares and how many rows.
#[derive(Default)]
pub(crate) struct Sum(f64, usize);

impl Sum {
    pub(crate) fn add(&mut self, vector: &[f64]) {
        self.0 += vector.iter().map(|x| x * x).sum::<f64>();
        self.1 += 1;
    }

    pub(crate) fn rms(&self) -> Option<f64> {
        (self.1 > 0).then(|| (self.0 / self.1 as f64).sqrt())
    }
}
