//! A diagnosis as something to be acted on: read from its JSON, checked, turned into settings.

use std::collections::BTreeMap;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_config::{BAND_ROWS, Band, BandRow};
use cathforce_effect_catalogue::{Channel, Effect, Plant};
use cathforce_gap::report::{Diagnosis, FORMAT, Verdict};
use serde::Deserialize;

use super::source::Source;
use crate::failure::{Code, Failure};
use crate::settings::band::count;

/// What of a diagnosis is needed to act on it.
#[derive(Debug, Deserialize)]
pub struct Explanation {
    format: String,
    bundle: String,
    pub verdict: Verdict,
    pub effects: Vec<Named>,
    #[serde(default)]
    pub confusable: Vec<Vec<String>>,
    #[serde(default)]
    pub gap: Promised,
    #[serde(default)]
    band: Option<cathforce_gap::Band>,
    reproduce: Origin,
}

#[derive(Debug, Deserialize)]
pub struct Named {
    pub id: String,
    parameters: BTreeMap<String, Estimate>,
    /// Of an answer from before it was written.
    shrink: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Estimate {
    value: f64,
    low: f64,
    high: f64,
}

impl Named {
    /// The estimate of a parameter.
    pub fn value(&self, parameter: &str) -> Option<f64> {
        self.parameters.get(parameter).map(|own| own.value)
    }
}

/// Figures over all held-out trials of the diagnosis.
#[derive(Debug, Default, Deserialize)]
pub struct Promised {
    #[serde(rename = "force_rms_N")]
    pub force_rms_n: Option<Figures>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Figures {
    pub before: f64,
    pub after: f64,
    pub floor: f64,
}

#[derive(Debug, Deserialize)]
struct Origin {
    bundle_sha256: String,
    #[serde(default)]
    held_back: Vec<u32>,
}

/// One fitted parameter as a setting.
#[derive(Clone, Debug)]
pub struct Fitted {
    pub key: &'static str,
    pub value: f32,
    /// 90 % interval.
    pub low: f64,
    pub high: f64,
    pub effect: &'static Effect,
}

impl Explanation {
    /// From the JSON that `cathforce gap diagnose --json` writes.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let refuse = |error: &dyn std::fmt::Display| {
            Failure::input(format!(
                "{}: no answer of a diagnosis: {error}\n  fix: make it with `cathforce gap \
                 diagnose BUNDLE --json FILE`",
                path.display()
            ))
        };
        let text = std::fs::read_to_string(path)
            .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
        let read: Self = serde_json::from_str(&text).map_err(|e| refuse(&e))?;
        if read.format != FORMAT {
            return Err(refuse(&format!("its format is `{}`, not `{FORMAT}`", read.format)));
        }
        Ok(read)
    }

    /// From an answer of this program.
    pub fn of(diagnosis: &Diagnosis) -> Result<Self, Failure> {
        serde_json::to_value(diagnosis)
            .and_then(serde_json::from_value)
            .map_err(|e| Failure::new(Code::Failed, format!("cannot read the diagnosis: {e}")))
    }

    /// Refuses a diagnosis of another rig.
    pub fn check_rig(&self, bundle: &Bundle) -> Result<(), Failure> {
        if self.bundle == bundle.rig.name {
            return Ok(());
        }
        Err(Failure::input(format!(
            "the diagnosis is of the rig `{}`, {} holds `{}`\n  fix: give the bundle that was \
             diagnosed, or diagnose this one",
            self.bundle,
            bundle.path.display(),
            bundle.rig.name
        )))
    }

    /// Whether it was made from exactly these files.
    pub fn is_of(&self, hash: &str) -> bool {
        hash == self.reproduce.bundle_sha256
    }

    /// Refuses a diagnosis of other files.
    pub fn check_source(&self, source: &Source) -> Result<(), Failure> {
        let bundle = &source.bundle;
        self.check_rig(bundle)?;
        if self.is_of(&source.hash()?) {
            return Ok(());
        }
        Err(Failure::input(format!(
            "{}: its files are not those that were diagnosed (SHA-256 {})\n  fix: give the bundle \
             that was diagnosed, or diagnose it again",
            bundle.path.display(),
            self.reproduce.bundle_sha256
        )))
    }

    /// Whether the diagnosis was made without this trial of its bundle.
    pub fn held_back(&self, trial: u32) -> bool {
        self.reproduce.held_back.contains(&trial)
    }

    /// How far the forces may be off, as a device takes it; `None` where the diagnosis does not say.
    pub fn band(&self) -> Result<Option<Band>, Failure> {
        let Some(band) = &self.band else { return Ok(None) };
        let wrong = || Failure::input(format!("the diagnosis' band has not {BAND_ROWS} rows"));
        let rows = |rows: &[cathforce_gap::Row]| -> Result<[BandRow; BAND_ROWS], Failure> {
            let counts: Vec<BandRow> =
                rows.iter().map(|row| row.map(|n| count(n.unwrap_or(f64::NAN)))).collect();
            counts.try_into().map_err(|_| wrong())
        };
        let (feed, withdrawal) = (rows(&band.feed)?, rows(&band.withdrawal)?);
        let (from_m, step_m) = (band.from_m as f32, band.step_m as f32);
        Ok(Some(Band { from_m, step_m, feed, withdrawal }))
    }

    /// What the diagnosis counted of its band, on samples whose trial was held out.
    pub fn coverage(&self) -> Option<cathforce_gap::Coverage> {
        self.band.as_ref().map(|band| band.coverage)
    }

    /// Whether it names no effect, so that its band is that of the rig as rig.toml states it.
    pub fn is_nominal(&self) -> bool {
        matches!(self.verdict, Verdict::NoGap | Verdict::Unknown)
    }

    /// Every fitted parameter as a setting; refuses what no device can be told.
    pub fn fitted(&self) -> Result<Vec<Fitted>, Failure> {
        self.check_verdict()?;
        let all = self.parameters()?;
        if !all.is_empty() && all.iter().all(|own| is_measurement(own.effect)) {
            return Err(Failure::new(Code::Failed, only_measurement(&all)));
        }
        Ok(all)
    }

    /// Share of the held-out gap above the floor that the effects close together.
    pub fn shrink(&self) -> Option<f64> {
        let shrinks = self.effects.iter().map(|named| named.shrink);
        let sum = shrinks.sum::<Option<f64>>()?;
        (!self.effects.is_empty()).then_some(sum)
    }

    /// Every fitted parameter of the effects that are named, whatever the verdict.
    pub fn parameters(&self) -> Result<Vec<Fitted>, Failure> {
        let mut all = Vec::new();
        for Named { id, parameters, .. } in &self.effects {
            let broken = |what: String| Failure::input(format!("the diagnosis names {what}"));
            let effect = Effect::find(id).ok_or_else(|| {
                broken(format!("`{id}`, which `cathforce gap effects` does not list"))
            })?;
            if effect.plant == Plant::Transmission {
                let message = format!(
                    "{id} is of a transmission: the catheter's model has no such setting\n  fix: `cathforce gap \
                     compensate` writes the input for each desired output"
                );
                return Err(Failure::new(Code::Failed, message));
            }
            if effect.plant != Plant::Catheter {
                let message = format!(
                    "{id} is friction of an axis without an instrument: the catheter's model has \
                     no such setting\n  fix: compensate it in the drive's own controller"
                );
                return Err(Failure::new(Code::Failed, message));
            }
            for (name, estimate) in parameters {
                let parameter = effect.parameters.iter().find(|p| p.name == name);
                let parameter = parameter.ok_or_else(|| {
                    broken(format!("`{name}` of {id}, which `cathforce gap effects` does not list"))
                })?;
                let Estimate { value, low, high } = *estimate;
                all.push(Fitted { key: parameter.key, value: value as f32, low, high, effect });
            }
        }
        Ok(all)
    }

    fn check_verdict(&self) -> Result<(), Failure> {
        let message = match self.verdict {
            Verdict::Named | Verdict::Partial => return Ok(()),
            Verdict::NoGap => {
                "the verdict is `no_gap`: the model as rig.toml states it already explains the \
                 data to the floor, so nothing is switched on\n  fix: `--band-only` still tells the \
                 device how far its forces may be off"
            }
            Verdict::Inconclusive => {
                "the verdict is `inconclusive`: nothing was found, and this data would hardly have \
                 shown it, so nothing is switched on\n  fix: `cathforce gap protocol` writes a motion \
                 that shows more; `--band-only` tells the device how far its forces may be off"
            }
            Verdict::Unknown => {
                "the verdict is `unknown`: no effect explains the gap well enough, or the data \
                 carry no verdict, so nothing is switched on\n  fix: see the diagnosis' remarks and \
                 where the gap lies, record what they ask for; `--effect ID` fits an effect that \
                 you know to be there, `--band-only` tells the device how far its forces may be off"
            }
        };
        Err(Failure::new(Code::Failed, message))
    }
}

/// Whether an effect changes only what the force sensor is expected to read.
pub fn is_measurement(effect: &Effect) -> bool {
    effect.id.starts_with("sensor.") && effect.channels == [Channel::Force]
}

fn only_measurement(all: &[Fitted]) -> String {
    let ids: std::collections::BTreeSet<&str> = all.iter().map(|own| own.effect.id).collect();
    let ids: Vec<&str> = ids.into_iter().collect();
    let sets: Vec<String> =
        all.iter().map(|own| format!("--set {}={}", own.key, own.value)).collect();
    format!(
        "{} lies in the force sensor, not in what the device computes: no setting of the device \
         makes its forces better\n  fix: zero, calibrate or align the sensor and record again; to \
         compare with this sensor as it is: {}",
        ids.join(" and "),
        sets.join(" ")
    )
}
