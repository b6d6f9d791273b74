//! What the server says of its source, and what it does with it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use cathforce_config::image::decode_head;
use cathforce_control::Fault;
use serde_json::{Value, json};
use tokio::sync::oneshot;

use crate::diagnosing::Diagnosing;
use crate::live::{Action, Pilot, Wanted};
use crate::settings::Changes;
use crate::{diagnosis, recording, settings, tips};

/// Longest time that a change may take: a device settles to a long insertion for a minute.
const PATIENCE: Duration = Duration::from_secs(90);

/// The image that a device has, and the scene that it makes as JSON.
type Scene = (Arc<Vec<u8>>, Arc<str>);

/// What is shown, ready to be asked.
pub enum Shown {
    Link {
        name: String,
        pilot: Pilot,
        scene: Mutex<Option<Scene>>,
    },
    /// Its answer is not known yet.
    Diagnosing {
        name: String,
        diagnosing: Diagnosing,
    },
    /// Everything is known beforehand.
    Still {
        kind: &'static str,
        name: String,
        state: Value,
        data: Arc<str>,
        scene: Option<Arc<str>>,
    },
}

/// Why a question has no answer.
#[derive(Debug)]
pub enum Unanswered {
    /// There is no such thing with this source, or not yet.
    Absent(String),
    /// It was understood and refused, or the device refused.
    Refused(String),
}

impl Shown {
    pub fn of_recording(
        name: String,
        recording: &cathforce_recording::Recording,
        analysis: &cathforce_recording::Analysis,
    ) -> Result<Self, String> {
        Ok(Self::Still {
            kind: "recording",
            name,
            state: recording::state(analysis),
            data: recording::data(recording, analysis).to_string().into(),
            scene: Some(recording::scene(&recording.image)?.to_string().into()),
        })
    }

    pub fn of_diagnosis(name: String, answer: &Value) -> Self {
        Self::Still {
            kind: "diagnosis",
            name,
            state: diagnosis::state(answer),
            data: answer.to_string().into(),
            scene: None,
        }
    }

    /// What this server shows.
    pub fn source(&self) -> Value {
        let (kind, name) = match self {
            Self::Link { name, .. } => ("link", name),
            Self::Diagnosing { name, diagnosing } if diagnosing.is_over() => ("diagnosis", name),
            Self::Diagnosing { name, .. } => ("diagnosing", name),
            Self::Still { kind, name, .. } => (*kind, name),
        };
        let can_change = matches!(self, Self::Link { pilot, .. } if pilot.actions.is_some());
        let version = env!("CARGO_PKG_VERSION");
        let can_record = matches!(self, Self::Link { pilot, .. } if pilot.can_record);
        json!({
            "kind": kind,
            "name": name,
            "can_change": can_change,
            "can_record": can_record,
            "version": version,
        })
    }

    /// How it is now, in short.
    pub fn state(&self) -> Value {
        match self {
            Self::Still { state, .. } => state.clone(),
            Self::Diagnosing { diagnosing, .. } => diagnosing.json(),
            Self::Link { pilot, .. } => {
                let mut state = pilot.pictures.borrow().state.clone();
                let now_ms = 1e3 * pilot.started.elapsed().as_secs_f64();
                let sample_ms = state["sample_ms"].as_f64().or(state["heard_ms"].as_f64());
                if state.is_null() {
                    state = json!({ "source": "link", "mode": null, "tick": null, "forces": null });
                }
                state["age_ms"] = json!(sample_ms.map(|at_ms| (now_ms - at_ms).max(0.0)));
                state
            }
        }
    }

    /// All of a recording or of a diagnosis.
    pub fn data(&self) -> Result<Arc<str>, Unanswered> {
        match self {
            Self::Still { data, .. } => Ok(Arc::clone(data)),
            Self::Diagnosing { diagnosing, .. } => diagnosing
                .data()
                .ok_or_else(|| Unanswered::Absent("the diagnosis is not done yet".into())),
            Self::Link { pilot, .. } => Ok(pilot.history.json().to_string().into()),
        }
    }

    /// The vessel. Takes a second for a large one.
    pub fn scene(&self) -> Result<Arc<str>, Unanswered> {
        match self {
            Self::Still { scene: Some(scene), .. } => Ok(Arc::clone(scene)),
            Self::Still { .. } | Self::Diagnosing { .. } => {
                Err(Unanswered::Absent("a diagnosis has no vessel".into()))
            }
            Self::Link { pilot, scene, .. } => {
                let image = pilot.image.get().ok_or_else(not_configured)?;
                let mut cached = scene.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some((_, scene)) = cached.as_ref().filter(|(of, _)| Arc::ptr_eq(of, &image))
                {
                    return Ok(Arc::clone(scene));
                }
                let made = recording::scene(&image).map_err(Unanswered::Refused)?;
                let made: Arc<str> = made.to_string().into();
                *cached = Some((image, Arc::clone(&made)));
                Ok(made)
            }
        }
    }

    /// The settings that the device uses.
    pub fn settings(&self) -> Result<Value, Unanswered> {
        let Self::Link { pilot, .. } = self else {
            return Err(Unanswered::Absent("settings belong to a device".into()));
        };
        let image = pilot.image.get().ok_or_else(not_configured)?;
        let head = decode_head(&image).map_err(|e| Unanswered::Refused(e.to_string()))?;
        Ok(settings::list(&head))
    }

    /// Tips of common catheters and the one that the device has.
    pub fn tips(&self) -> Result<Value, Unanswered> {
        let Self::Link { pilot, .. } = self else {
            return Err(Unanswered::Absent("a tip belongs to a device".into()));
        };
        let image = pilot.image.get().ok_or_else(not_configured)?;
        let head = decode_head(&image).map_err(|e| Unanswered::Refused(e.to_string()))?;
        Ok(tips::list(&head))
    }

    /// Does what somebody with the token asks for.
    pub async fn act(&self, asked: &Value) -> Result<Value, Unanswered> {
        let Self::Link { pilot: Pilot { actions: Some(actions), .. }, .. } = self else {
            return Err(Unanswered::Absent("there is nothing to change here".into()));
        };
        let wanted = wanted(asked).map_err(Unanswered::Refused)?;
        let (reply, answer) = oneshot::channel();
        let gone = || Unanswered::Refused("the link to the device is lost".into());
        actions.send(Action { wanted, reply }).map_err(|_| gone())?;
        match tokio::time::timeout(PATIENCE, answer).await {
            Ok(Ok(answer)) => answer.map_err(Unanswered::Refused),
            Ok(Err(_)) => Err(gone()),
            Err(_) => Err(Unanswered::Refused("the device took too long".into())),
        }
    }
}

fn not_configured() -> Unanswered {
    Unanswered::Absent("the device is not configured, or has not been asked yet".into())
}

/// A request in JSON.
fn wanted(asked: &Value) -> Result<Wanted, String> {
    let what = asked["do"].as_str().unwrap_or_default();
    match what {
        "arm" => Ok(Wanted::Arm),
        "disarm" => Ok(Wanted::Disarm),
        "self_test" => Ok(Wanted::SelfTest),
        "play" => Ok(Wanted::Play(true)),
        "pause" => Ok(Wanted::Play(false)),
        "record" => Ok(Wanted::Record(true)),
        "stop_recording" => Ok(Wanted::Record(false)),
        "acknowledge" => {
            let name = asked["fault"].as_str().unwrap_or_default();
            let fault = Fault::ALL.iter().find(|fault| fault.name() == name);
            fault
                .map(|fault| Wanted::Acknowledge(*fault))
                .ok_or_else(|| format!("there is no fault `{name}`"))
        }
        "apply" => {
            let numbers = match &asked["changes"] {
                Value::Null => Ok(BTreeMap::new()),
                given => serde_json::from_value::<BTreeMap<String, f32>>(given.clone()),
            };
            let settings =
                numbers.map_err(|_| "`changes` must be numbers by the names of settings")?;
            let tip = asked["tip"].as_str().map(str::to_owned);
            let changes = Changes { settings, tip };
            match changes.len() {
                0 => {
                    Err("`changes` must be numbers by the names of settings, or `tip` a name"
                        .into())
                }
                _ => Ok(Wanted::Apply(changes)),
            }
        }
        _ => Err(format!(
            "`do` is `{what}`; give arm, disarm, self_test, play, pause, record, stop_recording, acknowledge or \
             apply"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_understood_or_refused_with_what_is_wrong() {
        assert_eq!(wanted(&json!({ "do": "arm" })), Ok(Wanted::Arm));
        let fault = json!({ "do": "acknowledge", "fault": "BusOff" });
        assert_eq!(wanted(&fault), Ok(Wanted::Acknowledge(Fault::BusOff)));
        let apply = json!({ "do": "apply", "changes": { "force_gain": 0.5 } });
        let settings = [("force_gain".to_owned(), 0.5)].into();
        assert_eq!(wanted(&apply), Ok(Wanted::Apply(Changes { settings, tip: None })));
        let tip = json!({ "do": "apply", "tip": "hook" });
        let changes = Changes { tip: Some("hook".into()), ..Changes::default() };
        assert_eq!(wanted(&tip), Ok(Wanted::Apply(changes)));
        for (bad, said) in [
            (json!({}), "give arm"),
            (json!({ "do": "acknowledge", "fault": "Nope" }), "`Nope`"),
            (json!({ "do": "apply", "changes": { "force_gain": "much" } }), "must be numbers"),
            (json!({ "do": "apply", "changes": {} }), "must be numbers"),
        ] {
            assert!(wanted(&bad).unwrap_err().contains(said), "{bad}");
        }
    }
}
