//! `cathforce dash --ros2`, as another participant of ROS 2 sees it.

#![cfg(unix)]

#[path = "support/program.rs"]
mod program;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use program::{Dash, example, text};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile,
    Subscription,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// How long anything may take: other tests run beside.
const PATIENCE: Duration = Duration::from_secs(120);
/// From one message of the robot to the next.
const EVERY: Duration = Duration::from_millis(5);

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Header {
    seconds: i32,
    nanoseconds: u32,
    frame: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

#[derive(Debug, Deserialize)]
struct WrenchStamped {
    header: Header,
    force: [f64; 3],
    torque: [f64; 3],
}

#[derive(Debug, Deserialize)]
struct OperatingState {
    #[allow(dead_code)]
    header: Header,
    state: String,
    #[allow(dead_code)]
    is_homed: bool,
    #[allow(dead_code)]
    is_busy: bool,
}

#[derive(Debug, Deserialize)]
#[allow(dead_code)]
struct PointField {
    name: String,
    offset: u32,
    datatype: u8,
    count: u32,
}

#[derive(Debug, Deserialize)]
#[allow(dead_code)]
struct PointCloud2 {
    header: Header,
    height: u32,
    width: u32,
    fields: Vec<PointField>,
    is_bigendian: bool,
    point_step: u32,
    row_step: u32,
    data: Vec<u8>,
    is_dense: bool,
}

/// Another participant, in a process of its own.
struct Peer(Node);

impl Peer {
    fn join(domain: u16) -> Self {
        let context = Context::with_options(ContextOptions::new().domain_id(domain)).unwrap();
        let name = NodeName::new("/", "robot").unwrap();
        Self(context.new_node(name, NodeOptions::new()).unwrap())
    }

    fn hears<M: 'static>(&mut self, topic: &str, package: &str, kind: &str) -> Subscription<M> {
        // As `ros2 topic echo` asks: reliable, and nothing from before.
        let quality = QosProfile::publisher_default();
        let kind = MessageTypeName::new(package, kind);
        let topic = self.0.create_topic(&Name::parse(topic).unwrap(), kind, &quality).unwrap();
        self.0.create_subscription(&topic, None).unwrap()
    }
}

/// Waits for a message that is as it should be.
#[track_caller]
fn wait<M: DeserializeOwned + std::fmt::Debug + 'static>(
    from: &Subscription<M>,
    is: impl Fn(&M) -> bool,
) -> M {
    let (deadline, mut last) = (Instant::now() + PATIENCE, None);
    while Instant::now() < deadline {
        match from.take().unwrap() {
            Some((message, _)) if is(&message) => return message,
            Some((message, _)) => last = Some(message),
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    panic!("the last of them was {last:?}");
}

/// A robot's joints move the catheter, and what it feels is heard; when the robot falls silent, the device gives
/// out no force.
#[test]
fn a_robot_of_ros_moves_the_catheter_and_feels_the_vessel() {
    // Other tests of this computer have other domains.
    let domain = 100 + (std::process::id() % 100) as u16;
    let mut peer = Peer::join(domain);
    let wrench: Subscription<WrenchStamped> =
        peer.hears("/catheter/estimated/spatial/measured_cf", "geometry_msgs", "WrenchStamped");
    let shape: Subscription<PointCloud2> =
        peer.hears("/catheter/estimated/shape", "sensor_msgs", "PointCloud2");
    let state: Subscription<OperatingState> =
        peer.hears("/catheter/operating_state", "crtk_msgs", "OperatingState");
    let joints: Subscription<JointState> =
        peer.hears("/catheter/measured_js", "sensor_msgs", "JointState");

    // The robot stands 60 mm inside, with a joint that is of no interest.
    let insertion_um = Arc::new(AtomicU64::new(60_000));
    let is_silent = Arc::new(AtomicBool::new(false));
    let quality = QosProfile::publisher_default();
    let kind = MessageTypeName::new("sensor_msgs", "JointState");
    let topic =
        peer.0.create_topic(&Name::parse("/robot/joint_states").unwrap(), kind, &quality).unwrap();
    let robot = peer.0.create_publisher::<JointState>(&topic, None).unwrap();
    let (at, silent) = (Arc::clone(&insertion_um), Arc::clone(&is_silent));
    let moving = std::thread::spawn(move || {
        while !silent.load(Ordering::Relaxed) {
            let insertion_m = 1e-6 * at.load(Ordering::Relaxed) as f64;
            let name = ["elbow", "slide", "spin"].map(str::to_owned).to_vec();
            let position = vec![1.0, insertion_m, 0.25];
            // Nobody may hear it yet.
            let _ = robot.publish(JointState { name, position, ..JointState::default() });
            std::thread::sleep(EVERY);
        }
    });

    let (ros2, bundle) = (format!("--ros2={domain}"), example());
    let dash = Dash::start(&[
        "sim",
        "--bundle",
        text(&bundle),
        "--play",
        &ros2,
        "--ros2-joints",
        "/robot/joint_states",
        "--insertion-joint",
        "slide",
        "--rotation-joint",
        "spin",
    ]);
    wait(&state, |own| own.state == "ENABLED");
    let heard = wait(&joints, |own| own.position.len() == 2);
    assert!((heard.position[0] - 0.06).abs() < 1e-6 && (heard.position[1] - 0.25).abs() < 1e-4);
    // 10 mm further at 10 mm/s: the tip meets the wall.
    for step in 0..200 {
        insertion_um.store(60_000 + 50 * step, Ordering::Relaxed);
        std::thread::sleep(EVERY);
    }
    wait(&joints, |own| own.position.first().is_some_and(|m| *m > 0.0698));
    let felt = wait(&wrench, |own| own.force.iter().any(|n| n.abs() > 1e-3));
    assert_eq!(felt.header.frame, "entry");
    assert!(felt.force.iter().chain(&felt.torque).all(|value| value.is_finite()), "{felt:?}");
    let cloud = wait(&shape, |own| own.width > 30);
    assert_eq!(cloud.data.len(), (cloud.row_step * cloud.height) as usize);
    assert_eq!(cloud.fields[0].name, "x");
    // What the page says is what was published.
    assert_eq!(dash.get("/api/state")["mode"], "armed");

    is_silent.store(true, Ordering::Relaxed);
    moving.join().unwrap();
    wait(&state, |own| own.state == "FAULT");
    // The page says so with its next picture.
    let deadline = Instant::now() + PATIENCE;
    while dash.get("/api/state")["mode"] != "fault" {
        assert!(Instant::now() < deadline, "{}", dash.get("/api/state"));
    }
    dash.end();
}

#[test]
fn what_ros_does_not_have_is_refused() {
    let fails = |arguments: &[&str], word: &str| {
        let output = program::command().arg("dash").args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(word), "{arguments:?}: {said}");
    };
    let bundle = example();
    fails(&["sim", "--ros2=300"], "0 to 232");
    fails(&["sim", "--ros2-joints", "/joint_states"], "--insertion-joint");
    fails(
        &["sim", "--ros2", "--bundle", text(&bundle), "--insertion-joint", "slide"],
        "--ros2-joints",
    );
    fails(&[text(&bundle.join("rig.toml")), "--ros2"], "--ros2 is for a link");
}
