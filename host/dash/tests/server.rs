//! The server over TCP: who may watch, who may change, and what it says.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_dash::{Diagnosing, LinkSource, MOST_VIEWERS, Options, Source, Started, feed, serve};
use cathforce_link::{Client, Sim, Step};
use serde_json::{Value, json};

/// A server in this process.
struct Server {
    started: Started,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    fn of(source: Source) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (told, started) = channel();
        let ended = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let options = Options {
                listen: "127.0.0.1:0".parse().unwrap(),
                names: vec!["lab.example".into()],
                token_folder: std::env::temp_dir(),
                foxglove: None,
                fault_pages: vec![("EncoderLost", "# EncoderLost\n\n<b>text</b>")],
            };
            serve(source, options, &ended, |started| told.send(started.clone()).unwrap()).unwrap();
        });
        Self { started: started.recv().unwrap(), stop, thread: Some(thread) }
    }

    /// A device in this process, which nobody has configured.
    fn of_link() -> Self {
        let link = Box::new(Sim::new());
        let source = LinkSource {
            link,
            master: Default::default(),
            drive: None,
            watch_only: false,
            listeners: Vec::new(),
        };
        Self::of(Source::Link { name: "sim <script>".into(), source: Box::new(source) })
    }

    fn address(&self) -> SocketAddr {
        self.started.address
    }

    fn token_file(&self) -> PathBuf {
        self.started.token_file.clone().unwrap()
    }

    /// Status and body of an answer to a request with these lines instead of the usual ones.
    fn ask(&self, request: &str, lines: &[&str], body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(self.address()).unwrap();
        let host = format!("Host: {}", self.address());
        let own = lines.iter().any(|line| line.starts_with("Host:"));
        let mut text = format!("{request} HTTP/1.1\r\nConnection: close\r\n");
        for line in lines.iter().copied().chain((!own).then_some(&host[..])) {
            text += &format!("{line}\r\n");
        }
        text += &format!(
            "Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(text.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
        (status, answer)
    }

    fn json(&self, path: &str) -> Value {
        let (status, answer) = self.ask(&format!("GET {path}"), &[], "");
        assert_eq!(status, 200, "{answer}");
        serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap()
    }

    /// The status of the answer to somebody who asks for a picture every time that there is one.
    fn viewer(&self) -> Result<tungstenite::WebSocket<TcpStream>, u16> {
        let stream = TcpStream::connect(self.address()).unwrap();
        let url = format!("ws://{}/ws", self.address());
        match tungstenite::client(url, stream) {
            Ok((socket, _)) => Ok(socket),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking());
        }
    }
}

#[test]
fn whoever_has_no_token_watches_and_changes_nothing() {
    let server = Server::of_link();
    assert_eq!(server.json("/api/source")["can_change"], true);
    let arm = json!({ "do": "arm" }).to_string();
    for lines in [&[][..], &["Authorization: Bearer 0123456789abcdef0123456789abcdef"]] {
        let (status, answer) = server.ask("POST /api/do", lines, &arm);
        assert_eq!(status, 401, "{answer}");
        assert!(answer.contains("changes need the token"), "{answer}");
    }
    let token = std::fs::read_to_string(server.token_file()).unwrap();
    let right = format!("Authorization: Bearer {}", token.trim());
    assert_eq!(server.ask("POST /api/token", &[&right], "{}").0, 200);
    // It is understood, and the device says why not.
    let (status, answer) = server.ask("POST /api/do", &[&right], &arm);
    assert_eq!(status, 409, "{answer}");
    let (status, answer) = server.ask("POST /api/do", &[&right], "{\"do\": \"explode\"}");
    assert!(status == 409 && answer.contains("give arm, disarm"), "{answer}");
}

#[cfg(unix)]
#[test]
fn the_file_with_the_token_is_its_owners_and_is_gone_at_the_end() {
    use std::os::unix::fs::PermissionsExt as _;
    let server = Server::of_link();
    let path = server.token_file();
    assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    assert_eq!(std::fs::read_to_string(&path).unwrap().trim().len(), 32);
    drop(server);
    assert!(!path.exists());
}

#[test]
fn other_hosts_and_other_origins_are_refused() {
    let server = Server::of_link();
    let port = server.address().port();
    for host in ["evil.example", "127.0.0.1.evil.example", "10.1.2.3"] {
        let host = format!("Host: {host}:{port}");
        for path in ["/", "/api/state", "/main.js", "/ws"] {
            let (status, answer) = server.ask(&format!("GET {path}"), &[&host], "");
            assert_eq!(status, 421, "{host} {path}: {answer}");
        }
    }
    assert_eq!(server.ask("GET /api/state", &["Host: 127.0.0.1:1"], "").0, 421);
    for name in ["localhost", "lab.example"] {
        assert_eq!(server.ask("GET /", &[&format!("Host: {name}:{port}")], "").0, 200, "{name}");
    }
    let token = std::fs::read_to_string(server.token_file()).unwrap();
    let right = format!("Authorization: Bearer {}", token.trim());
    for origin in ["Origin: http://evil.example", "Origin: null", "Origin: http://127.0.0.1:1"] {
        for request in ["GET /api/state", "GET /ws", "POST /api/do"] {
            let (status, answer) = server.ask(request, &[origin, &right], "{\"do\": \"arm\"}");
            assert_eq!(status, 403, "{origin} {request}: {answer}");
        }
    }
    let own = format!("Origin: http://{}", server.address());
    assert_eq!(server.ask("GET /api/state", &[&own], "").0, 200);
}

#[test]
fn names_are_data_and_nothing_may_be_loaded_from_elsewhere() {
    let server = Server::of_link();
    assert_eq!(server.json("/api/source")["name"], "sim <script>");
    assert_eq!(server.json("/api/faults")["EncoderLost"], "# EncoderLost\n\n<b>text</b>");
    let (status, page) = server.ask("GET /", &[], "");
    assert_eq!(status, 200);
    assert!(!page.contains("sim <script>"), "no name is written into the page");
    let page = page.to_lowercase();
    for header in ["content-security-policy: default-src 'none'", "x-content-type-options: nosniff"]
    {
        assert!(page.contains(header), "{header} in {page}");
    }
    for path in ["/main.js", "/style.css", "/vendor/uPlot.esm.js", "/vendor/uPlot.LICENSE"] {
        assert_eq!(server.ask(&format!("GET {path}"), &[], "").0, 200, "{path}");
    }
    for path in ["/../Cargo.toml", "/web/main.js", "/api/nothing"] {
        assert_eq!(server.ask(&format!("GET {path}"), &[], "").0, 404, "{path}");
    }
}

#[test]
fn the_state_of_a_device_has_mode_tick_age_and_forces() {
    let server = Server::of_link();
    let mut viewer = server.viewer().unwrap();
    let mut picture = json!(null);
    while picture["tick"].as_u64().is_none_or(|tick| tick < 50) {
        let message = viewer.read().unwrap().into_text().unwrap();
        picture = serde_json::from_str(&message).unwrap();
        viewer.send("drawn".into()).unwrap();
    }
    assert_eq!(picture["mode"], "not configured");
    let state = server.json("/api/state");
    assert_eq!((&state["source"], &state["mode"]), (&json!("link"), &json!("not configured")));
    assert!(state["tick"].as_u64().unwrap() >= 50, "{state}");
    assert!(state["age_ms"].as_f64().unwrap() >= 0.0, "{state}");
    assert!(state["forces"].as_object().unwrap().contains_key("fx_N"), "{state}");
    let (status, answer) = server.ask("GET /api/settings", &[], "");
    assert!(status == 404 && answer.contains("not configured"), "{answer}");
    viewer.send("clock 12.5".into()).unwrap();
    loop {
        let message = viewer.read().unwrap().into_text().unwrap();
        let message: Value = serde_json::from_str(&message).unwrap();
        if message["clock"] == "12.5" {
            assert!(message["server_ms"].as_f64().unwrap() > 0.0);
            break;
        }
        viewer.send("drawn".into()).unwrap();
    }
}

/// Number of the next picture that a viewer gets.
fn number(viewer: &mut tungstenite::WebSocket<TcpStream>) -> u64 {
    let message = viewer.read().unwrap().into_text().unwrap();
    serde_json::from_str::<Value>(&message).unwrap()["sequence"].as_u64().unwrap()
}

/// A viewer that draws nothing gets two pictures and no more; the next one that it gets is the newest.
#[test]
fn a_slow_viewer_gets_the_newest_and_no_queue() {
    let server = Server::of_link();
    let mut viewer = server.viewer().unwrap();
    let [first, second] = [(); 2].map(|()| number(&mut viewer));
    assert!(second > first);
    // Others draw on meanwhile.
    let mut other = server.viewer().unwrap();
    let mut newest = 0;
    while newest < second + 30 {
        newest = number(&mut other);
        other.send("drawn".into()).unwrap();
    }
    viewer.send("drawn".into()).unwrap();
    let third = number(&mut viewer);
    assert!(third >= newest, "{third} is older than {newest}");
}

#[test]
fn so_many_may_watch_at_once_and_a_place_that_is_left_is_free() {
    let server = Server::of_link();
    let mut viewers = (0..MOST_VIEWERS).map(|_| server.viewer().unwrap()).collect::<Vec<_>>();
    for viewer in &mut viewers {
        assert!(viewer.read().unwrap().is_text());
    }
    assert_eq!(server.viewer().err(), Some(503));
    let mut left = viewers.pop().unwrap();
    left.close(None).unwrap();
    // The server answers the closing before it frees the place.
    while left.read().is_ok() {}
    while server.viewer().is_err() {
        std::thread::yield_now();
    }
}

#[test]
fn a_diagnosis_is_shown_and_has_nothing_to_change() {
    let answer = json!({
        "format": "gap-diagnosis/2", "verdict": "named", "bundle": "<img src=x>",
        "sentence": "The wall is softer.", "gap": { "force_rms_N": { "before": 0.06 } },
    });
    let server = Server::of(Source::Diagnosis { name: "d.json".into(), answer: answer.clone() });
    assert_eq!(server.json("/api/data"), answer);
    let state = server.json("/api/state");
    assert_eq!((&state["mode"], &state["tick"]), (&json!("diagnosis"), &json!(null)));
    assert_eq!(state["force_rms_N"]["before"], 0.06);
    assert_eq!(server.json("/api/source")["can_change"], false);
    assert!(server.started.token_file.is_none());
    assert_eq!(server.ask("POST /api/do", &["Authorization: Bearer "], "{}").0, 401);
    assert_eq!(server.ask("GET /api/scene", &[], "").0, 404);
}

#[test]
fn a_diagnosis_that_runs_says_how_far_it_is_and_then_answers() {
    let run = Diagnosing::default();
    let server = Server::of(Source::Diagnosing { name: "rig".into(), diagnosing: run.clone() });
    assert_eq!(server.json("/api/source")["kind"], "diagnosing");
    assert_eq!(server.ask("GET /api/data", &[], "").0, 404);
    run.begins(100, None);
    run.simulated(50);
    run.found(&["<b>The wall is softer.</b>".into()], 0.8, 12);
    let state = server.json("/api/state");
    assert_eq!((&state["mode"], &state["simulations"]), (&json!("diagnosing"), &json!(50)));
    assert!(state["seconds_left"].is_number() && state["best"]["closes"] == 0.8, "{state}");
    run.ends(json!({ "format": "gap-diagnosis/2", "verdict": "named" }));
    assert_eq!(server.json("/api/source")["kind"], "diagnosis");
    assert_eq!(server.json("/api/data")["verdict"], "named");
    assert_eq!(server.json("/api/state")["verdict"], "named");
}

/// A run shows its frames, and whoever watches changes nothing, not even with a token: there is none.
#[test]
fn a_run_is_watched_until_it_ends() {
    let (feed, source) = feed();
    let server = Server::of(Source::Run { name: "sim".into(), source });
    assert!(server.started.token_file.is_none());
    assert_eq!(server.json("/api/source")["can_change"], false);
    assert_eq!(server.ask("POST /api/do", &["Authorization: Bearer "], "{\"do\": \"arm\"}").0, 401);
    let mut client = Client::connect(Sim::new()).unwrap();
    client.set_lock_step(true).unwrap();
    let tapped = feed.clone();
    client.set_tap(Some(Box::new(move |direction, frame, _| tapped.frame(direction, frame))));
    for _ in 0..50 {
        client.run_tick(Step::default()).unwrap();
    }
    let until = |is: &dyn Fn(&Value) -> bool| {
        let deadline = Instant::now() + Duration::from_secs(60);
        loop {
            let state = server.json("/api/state");
            if is(&state) {
                return state;
            }
            assert!(Instant::now() < deadline, "{state}");
        }
    };
    let state = until(&|state| state["tick"].as_u64().is_some_and(|tick| tick >= 49));
    assert_eq!((&state["mode"], &state["lost"]), (&json!("not configured"), &json!(null)));
    drop((client, feed));
    until(&|state| state["lost"] == "the run has ended");
}
