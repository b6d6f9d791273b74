//! The topics of a recording as topics of ROS 2.

use cathforce_recording::{TopicError, TopicMessage, Topics};
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Name, Node, Publisher};
use serde::ser::{Serialize, SerializeTuple as _, Serializer};

/// Packages that every installation of ROS 2 has, and the one of CRTK. Messages of others, which only a recording
/// needs, stay there.
const PACKAGES: [&str; 4] = ["crtk_msgs", "geometry_msgs", "sensor_msgs", "tf2_msgs"];
/// Messages that wait for a subscriber that does not keep up; what comes while so many wait is lost to it.
const DEPTH: usize = 10;
/// The encapsulation before every message in CDR. It is that of little-endian CDR, which DDS writes itself.
const HEAD: usize = 4;
/// Transforms that do not change, which ROS keeps for those who come later.
const TRANSFORMS: &str = "tf2_msgs";

/// Makes messages and publishes them.
pub struct Outlet {
    topics: Topics,
    /// By topic; `None` for one that is not published.
    publishers: Vec<Option<Publisher<Encoded>>>,
    /// Its publishers live as long as it does.
    _node: Node,
}

impl Outlet {
    pub fn new(mut node: Node) -> Result<Self, String> {
        let topics = Topics::default();
        let mut publishers = Vec::new();
        for topic in topics.all() {
            let (package, kind) = topic.message_type.split_once("/msg/").unwrap_or_default();
            let publisher = match PACKAGES.contains(&package) {
                true => Some(publisher(&mut node, topic.name, package, kind)?),
                false => None,
            };
            publishers.push(publisher);
        }
        Ok(Self { topics, publishers, _node: node })
    }
}

fn publisher(
    node: &mut Node,
    name: &str,
    package: &str,
    kind: &str,
) -> Result<Publisher<Encoded>, String> {
    let quality = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .history(History::KeepLast { depth: DEPTH })
        .durability(match package {
            TRANSFORMS => Durability::TransientLocal,
            _ => Durability::Volatile,
        });
    let failed = |error: &dyn std::fmt::Debug| format!("{name}: {error:?}");
    let own = Name::parse(name).map_err(|error| failed(&error))?;
    let topic = node.create_topic(&own, MessageTypeName::new(package, kind), &quality);
    let topic = topic.map_err(|error| failed(&error))?;
    node.create_publisher(&topic, None).map_err(|error| failed(&error))
}

impl crate::stamped::Outlet for Outlet {
    fn topics(&mut self) -> &mut Topics {
        &mut self.topics
    }

    fn send(&mut self, messages: Result<Vec<TopicMessage>, TopicError>) {
        // Every message has fields that its encoding can hold; one that it could not hold is left out.
        for message in messages.unwrap_or_default() {
            if let Some(Some(publisher)) = self.publishers.get(message.topic) {
                // A subscriber that does not keep up misses it.
                let _ = publisher.publish(Encoded(message.bytes));
            }
        }
    }
}

/// A message in CDR, which is published as it is.
struct Encoded(Vec<u8>);

impl Serialize for Encoded {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let body = self.0.get(HEAD..).unwrap_or_default();
        let mut bytes = serializer.serialize_tuple(body.len())?;
        for byte in body {
            bytes.serialize_element(byte)?;
        }
        bytes.end()
    }
}
