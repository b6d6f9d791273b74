//! The joints of a robot, which move the drives of the device.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use futures_util::StreamExt as _;
use ros2_client::{MessageTypeName, Name, Node, QosProfile, Subscription};
use serde::Deserialize;

use crate::joint_names::JointNames;

/// A position holds for so long after its message: one and a half times as long as a robot takes to the next one
/// that publishes ten times a second. Then no encoder is sent, and the device ramps its output down.
const HOLDS: Duration = Duration::from_millis(150);

/// The last positions that the robot published.
#[derive(Clone)]
pub struct Joints(Arc<Mutex<Option<Heard>>>);

struct Heard {
    at: Instant,
    insertion_m: f64,
    rotation_rad: f64,
}

impl Joints {
    pub(super) fn follow(node: &mut Node, names: JointNames) -> Result<Self, String> {
        let failed = |error: &dyn std::fmt::Debug| format!("{error:?}");
        let name = Name::parse(&names.topic).map_err(|error| failed(&error))?;
        let quality = QosProfile::subscription_default();
        let kind = MessageTypeName::new("sensor_msgs", "JointState");
        let topic = node.create_topic(&name, kind, &quality).map_err(|error| failed(&error))?;
        let heard: Subscription<JointState> =
            node.create_subscription(&topic, None).map_err(|error| failed(&error))?;
        let joints = Self(Arc::default());
        let own = joints.clone();
        let runtime = tokio::runtime::Builder::new_current_thread().build();
        let runtime = runtime.map_err(|error| failed(&error))?;
        // It waits for messages until the program ends.
        std::thread::spawn(move || {
            runtime.block_on(heard.async_stream().for_each(|message| {
                // What is no such message says nothing of joints.
                if let Ok((state, _)) = message {
                    own.hear(&names, &state);
                }
                std::future::ready(())
            }));
        });
        Ok(joints)
    }

    /// Insertion \[m\] and rotation \[rad\] by the last message; `None` where it is too old, or none has come.
    pub fn now(&self) -> Option<(f64, f64)> {
        let heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let heard = heard.as_ref().filter(|heard| heard.at.elapsed() < HOLDS)?;
        Some((heard.insertion_m, heard.rotation_rad))
    }

    /// A message that lacks one of the joints, as robots publish of their other parts, changes nothing.
    fn hear(&self, names: &JointNames, state: &JointState) {
        let of = |name: &str| {
            let at = state.name.iter().position(|own| own == name)?;
            state.position.get(at).copied().filter(|value| value.is_finite())
        };
        let rotation = names.rotation.as_ref().map_or(Some(0.0), |name| of(name));
        if let (Some(insertion_m), Some(rotation_rad)) = (of(&names.insertion), rotation) {
            let heard = Heard { at: Instant::now(), insertion_m, rotation_rad };
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(heard);
        }
    }
}

/// `sensor_msgs/JointState`.
#[derive(Debug, Default, Deserialize)]
struct JointState {
    #[allow(dead_code, reason = "what is used follows it")]
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    #[allow(dead_code, reason = "a message is read to its end")]
    velocity: Vec<f64>,
    #[allow(dead_code, reason = "a message is read to its end")]
    effort: Vec<f64>,
}

/// `std_msgs/Header`.
#[derive(Debug, Default, Deserialize)]
#[allow(dead_code, reason = "positions are taken as they come")]
struct Header {
    seconds: i32,
    nanoseconds: u32,
    frame: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_come_by_the_names_of_joints_and_hold_for_a_moment() {
        let joints = Joints(Arc::default());
        assert_eq!(joints.now(), None);
        let names = JointNames {
            topic: "/joint_states".into(),
            insertion: "slide".into(),
            rotation: Some("spin".into()),
        };
        let state = |names: &[&str], position: &[f64]| JointState {
            name: names.iter().map(|name| (*name).to_owned()).collect(),
            position: position.to_vec(),
            ..JointState::default()
        };
        joints.hear(&names, &state(&["elbow", "spin", "slide"], &[9.0, 0.5, 0.02]));
        assert_eq!(joints.now(), Some((0.02, 0.5)));
        // Neither another part of the robot, nor a broken message.
        joints.hear(&names, &state(&["elbow"], &[9.0]));
        joints.hear(&names, &state(&["slide", "spin"], &[0.03]));
        joints.hear(&names, &state(&["slide", "spin"], &[f64::NAN, 0.0]));
        assert_eq!(joints.now(), Some((0.02, 0.5)));
        if let Some(heard) = joints.0.lock().unwrap().as_mut() {
            heard.at -= HOLDS;
        }
        assert_eq!(joints.now(), None);
    }
}
