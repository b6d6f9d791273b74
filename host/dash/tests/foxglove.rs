//! `cathforce dash --foxglove`, as a client of Foxglove's protocol sees it.

#![cfg(unix)]

#[path = "support/program.rs"]
mod program;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use program::{Dash, cathforce, example, text};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

const FORCE: &str = "/catheter/estimated/spatial/measured_cf";
const SHAPE: &str = "/catheter/estimated/shape";
const STATE: &str = "/catheter/operating_state";
const SENSOR: &str = "/phantom/spatial/measured_cf";
const TRANSFORMS: &str = "/tf_static";
/// How long anything may take: other tests run beside.
const PATIENCE: Duration = Duration::from_secs(120);

/// A program that speaks Foxglove's protocol and nothing else.
struct Client {
    socket: WebSocket<TcpStream>,
    /// Number and schema of each channel, by its topic.
    channels: BTreeMap<String, (u64, Value)>,
    server: Value,
}

/// What the server sent.
#[derive(Debug)]
enum Heard {
    Message {
        topic: String,
        at_ns: u64,
        bytes: Vec<u8>,
    },
    /// Status of the playback: 0 plays, 1 stands, 3 has ended.
    Playback {
        status: u8,
        did_seek: bool,
    },
}

impl Client {
    fn connect(address: &str) -> Self {
        let mut request = address.into_client_request().unwrap();
        let protocol = HeaderValue::from_static("foxglove.sdk.v1");
        request.headers_mut().insert("Sec-WebSocket-Protocol", protocol);
        let stream = TcpStream::connect(address.trim_start_matches("ws://")).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, answer) = tungstenite::client(request, stream).unwrap();
        assert_eq!(answer.headers()["Sec-WebSocket-Protocol"], "foxglove.sdk.v1");
        let mut client = Self { socket, channels: BTreeMap::new(), server: Value::Null };
        while client.server.is_null() || client.channels.is_empty() {
            let Message::Text(text) = client.socket.read().unwrap() else { continue };
            let said: Value = serde_json::from_str(&text).unwrap();
            match said["op"].as_str().unwrap() {
                "serverInfo" => client.server = said,
                "advertise" => {
                    for channel in said["channels"].as_array().unwrap() {
                        let topic = channel["topic"].as_str().unwrap().to_owned();
                        let id = channel["id"].as_u64().unwrap();
                        client.channels.insert(topic, (id, channel.clone()));
                    }
                }
                _ => {}
            }
        }
        client
    }

    /// Subscribes to topics; the number of a subscription is that of its channel.
    fn subscribe(&mut self, topics: &[&str]) {
        let to = |topic: &&str| {
            let id = self.channels[*topic].0;
            json!({ "id": id, "channelId": id })
        };
        let all = topics.iter().map(to).collect::<Vec<_>>();
        let ask = json!({ "op": "subscribe", "subscriptions": all });
        self.socket.send(Message::text(ask.to_string())).unwrap();
    }

    /// Asks a recording to play or to stop, at a speed, from a time.
    fn play(&mut self, play: bool, speed: f32, from_ns: Option<u64>) {
        let mut bytes = vec![3, u8::from(!play)];
        bytes.extend(speed.to_le_bytes());
        bytes.push(u8::from(from_ns.is_some()));
        bytes.extend(from_ns.unwrap_or(0).to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes.push(b'r');
        self.socket.send(Message::binary(bytes)).unwrap();
    }

    fn hear(&mut self) -> Heard {
        loop {
            let Message::Binary(bytes) = self.socket.read().unwrap() else { continue };
            let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
            match bytes[0] {
                1 => {
                    let id = u64::from(u32::from_le_bytes(bytes[1..5].try_into().unwrap()));
                    let known = self.channels.iter().find(|(_, (channel, _))| *channel == id);
                    let topic = known.unwrap().0.clone();
                    let bytes = bytes[13..].to_vec();
                    return Heard::Message { topic, at_ns: number(5), bytes };
                }
                5 => {
                    let (status, did_seek) = (bytes[1], bytes[14] != 0);
                    return Heard::Playback { status, did_seek };
                }
                _ => {}
            }
        }
    }

    /// Topics with the type, schema and encodings of their messages.
    fn described(&self) -> BTreeSet<[String; 5]> {
        let of = |(topic, (_, channel)): (&String, &(u64, Value))| {
            let text = |key: &str| channel[key].as_str().unwrap().to_owned();
            let [kind, schema] = ["schemaName", "schema"].map(text);
            [topic.clone(), kind, schema, text("schemaEncoding"), text("encoding")]
        };
        self.channels.iter().map(of).collect()
    }
}

/// The same of a recording.
fn described(summary: &mcap::Summary) -> BTreeSet<[String; 5]> {
    let of = |channel: &std::sync::Arc<mcap::Channel<'_>>| {
        let schema = channel.schema.as_ref().unwrap();
        let text = std::str::from_utf8(&schema.data).unwrap().to_owned();
        let (kind, encoding) = (schema.name.clone(), schema.encoding.clone());
        [channel.topic.clone(), kind, text, encoding, channel.message_encoding.clone()]
    };
    summary.channels.values().map(of).collect()
}

/// A trial of the example on a device in process, recorded once for these tests.
fn recorded(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("run.mcap");
    let example = example();
    let out = cathforce(["run", "--link", "sim", text(&example), "--out", text(&path)]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    path
}

/// x, y, z of a `WrenchStamped`: behind the header, which is filled up to a multiple of 8.
fn force(bytes: &[u8]) -> [f64; 3] {
    let at = bytes.len() - 48;
    std::array::from_fn(|k| f64::from_le_bytes(bytes[at + 8 * k..][..8].try_into().unwrap()))
}

/// A device that plays a trial is served with forces, shape, state and the sensor's values.
#[test]
fn a_device_that_runs_is_served() {
    let example = example();
    let dash =
        Dash::start(&["sim", "--bundle", text(&example), "--play", "--foxglove=127.0.0.1:0"]);
    let mut client = Client::connect(dash.foxglove.as_ref().unwrap());
    assert_eq!(client.server["name"], "cathforce: sim");
    // A client can only watch.
    assert_eq!(client.server["capabilities"], json!([]));
    client.subscribe(&[FORCE, SHAPE, STATE, SENSOR, TRANSFORMS]);
    let until = Instant::now() + PATIENCE;
    let mut seen = BTreeSet::new();
    let mut largest_n = 0.0_f64;
    let mut before_ns = 0;
    while seen.len() < 5 || largest_n < 1e-3 {
        assert!(Instant::now() < until, "{seen:?}, {largest_n} N");
        let Heard::Message { topic, at_ns, bytes } = client.hear() else { continue };
        if topic == FORCE {
            assert!(at_ns >= before_ns, "{at_ns} after {before_ns}");
            before_ns = at_ns;
            let size_n = force(&bytes).iter().map(|x| x * x).sum::<f64>().sqrt();
            largest_n = largest_n.max(size_n);
        }
        seen.insert(topic);
    }
    dash.end();
}

/// A recording is served with its own topics, schemas and messages, at the time and speed asked for.
#[test]
fn a_recording_is_served_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = recorded(folder.path());
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let layout = folder.path().join("layout.json");
    let dash =
        Dash::start(&[text(&path), "--foxglove=127.0.0.1:0", "--foxglove-layout", text(&layout)]);
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/layouts/foxglove.json");
    assert_eq!(fs::read(layout).unwrap(), fs::read(shipped).unwrap());
    let mut client = Client::connect(dash.foxglove.as_ref().unwrap());
    assert_eq!(client.described(), described(&summary));
    let capabilities = client.server["capabilities"].to_string();
    assert!(capabilities.contains("playbackControl"), "{}", client.server);

    let recorded = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let recorded = recorded.filter(|message| message.channel.topic == FORCE);
    let recorded = recorded.map(|message| (message.log_time, message.data.into_owned()));
    let recorded = recorded.collect::<Vec<_>>();
    let (begin_ns, middle_ns) = (recorded[0].0, recorded[recorded.len() / 2].0);
    for from_ns in [begin_ns, middle_ns] {
        client.play(false, 20.0, Some(from_ns));
        while !matches!(client.hear(), Heard::Playback { status: 1, did_seek: true, .. }) {}
        client.subscribe(&[FORCE]);
        client.play(true, 20.0, None);
        let mut served = Vec::new();
        loop {
            match client.hear() {
                Heard::Message { topic, at_ns, bytes } if topic == FORCE => {
                    served.push((at_ns, bytes));
                }
                Heard::Playback { status: 3, .. } => break,
                _ => {}
            }
        }
        // The last messages may follow the end. A tick is complete when the next one begins, so the last one
        // is in the file alone.
        let expected = recorded.iter().filter(|(at_ns, _)| *at_ns >= from_ns).collect::<Vec<_>>();
        while served.len() + 1 < expected.len() {
            let Heard::Message { at_ns, bytes, .. } = client.hear() else { continue };
            served.push((at_ns, bytes));
        }
        assert!(served.len() > 100);
        for (k, (served, expected)) in served.iter().zip(&expected).enumerate() {
            assert_eq!(served, *expected, "message {k}");
        }
    }
    dash.end();
}

#[test]
fn a_diagnosis_has_nothing_for_foxglove() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("diagnosis.json");
    fs::write(&path, "{\"format\": \"gap-diagnosis/2\", \"verdict\": \"no_gap\"}").unwrap();
    let out = cathforce(["dash", text(&path), "--foxglove=127.0.0.1:0"]);
    assert_eq!(out.status.code(), Some(2));
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(said.contains("no topics for Foxglove") && said.contains("omit --foxglove"), "{said}");
}
