//! What `cathforce dash` costs, on request: `cargo nextest run -p cathforce-dash --test load --run-ignored only`.
//!
//! `CATHFORCE_PROGRAM` names the program, best a release build; `CATHFORCE_DASH_SECONDS` how long a device is
//! watched. The figures are printed; a limit is held where the machine has nothing else to do.

#![cfg(target_os = "linux")]

#[path = "support/program.rs"]
mod program;
mod support;

use std::fs;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use program::{Dash, cathforce, example, text};
use serde_json::Value;
use support::Browser;
use tungstenite::{Message, WebSocket};

/// Ticks of the kernel's clock of processor time in a second.
const CLOCK_HZ: f64 = 100.0;
/// A viewer draws sixty pictures a second.
const PICTURE: Duration = Duration::from_micros(16_667);
/// A recording's length \[s\], rows of its trial in a second, and moments that are looked at.
const LONG_S: u32 = 600;
const ROWS_HZ: u32 = 10;
const LOOKS: u32 = 60;

/// Processor time \[s\] and resident memory \[MiB\] of a process.
fn cost(process: u32) -> (f64, f64) {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    // The name of the program is in brackets and may hold anything.
    let fields: Vec<&str> = stat.rsplit_once(") ").unwrap().1.split(' ').collect();
    let time: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    let kib: f64 = resident.trim().trim_end_matches(" kB").parse().unwrap();
    (time / CLOCK_HZ, kib / 1024.0)
}

/// A viewer that draws every picture at once, and knows the server's clock.
struct Viewer {
    socket: WebSocket<TcpStream>,
    started: Instant,
    /// Of the server's clock before this one's \[ms\].
    offset_ms: f64,
}

impl Viewer {
    fn connect(dash: &Dash) -> Self {
        let host = dash.address.trim_start_matches("http://").trim_end_matches('/');
        let stream = TcpStream::connect(host).unwrap();
        let (socket, _) = tungstenite::client(format!("ws://{host}/ws"), stream).unwrap();
        let mut viewer = Self { socket, started: Instant::now(), offset_ms: f64::NAN };
        let mut best_ms = f64::INFINITY;
        for _ in 0..50 {
            let sent_ms = viewer.now_ms();
            viewer.socket.send("clock 0".into()).unwrap();
            let server_ms = loop {
                let said = viewer.next();
                if let Some(server_ms) = said["server_ms"].as_f64().filter(|_| said["clock"] == "0")
                {
                    break server_ms;
                }
            };
            let now_ms = viewer.now_ms();
            if now_ms - sent_ms < best_ms {
                best_ms = now_ms - sent_ms;
                viewer.offset_ms = server_ms - 0.5 * (now_ms + sent_ms);
            }
        }
        viewer
    }

    fn now_ms(&self) -> f64 {
        1e3 * self.started.elapsed().as_secs_f64()
    }

    /// What the server sends next; a picture is acknowledged as drawn.
    fn next(&mut self) -> Value {
        loop {
            let Message::Text(said) = self.socket.read().unwrap() else { continue };
            let said: Value = serde_json::from_str(&said).unwrap();
            if said["clock"].is_null() {
                self.socket.send("drawn".into()).unwrap();
            }
            return said;
        }
    }

    /// How old the next picture is when it is here \[ms\]; `None` where it has no sample.
    fn age_ms(&mut self) -> Option<f64> {
        let sample_ms = self.next()["sample_ms"].as_f64()?;
        Some(self.now_ms() + self.offset_ms - sample_ms)
    }
}

#[test]
#[ignore = "takes a minute and a machine that has nothing else to do"]
fn a_device_is_watched_with_little_time_and_no_more_memory() {
    let seconds = std::env::var("CATHFORCE_DASH_SECONDS").map_or(60.0, |s| s.parse().unwrap());
    let bundle = example();
    let dash = Dash::start(&["sim", "--bundle", text(&bundle), "--play"]);
    let mut viewer = Viewer::connect(&dash);
    let mut watch = |for_s: f64| {
        let (begun, mut ages) = (Instant::now(), Vec::new());
        while begun.elapsed().as_secs_f64() < for_s {
            let due = Instant::now() + PICTURE;
            ages.extend(viewer.age_ms());
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        ages
    };
    // Its history is full after a while, and then its memory.
    watch(0.25 * seconds);
    let (begun, before) = (Instant::now(), cost(dash.id()));
    let mut ages = watch(0.75 * seconds);
    let after = cost(dash.id());
    let share = (after.0 - before.0) / begun.elapsed().as_secs_f64();
    ages.sort_by(f64::total_cmp);
    let at = |share: f64| ages[((ages.len() - 1) as f64 * share) as usize];
    println!(
        "{} pictures in {:.0} s: {:.1} % of a core with the device's own ticks; age {:.1} ms in the median, \
         {:.1} ms at 99 %; memory {:.1} MiB, then {:.1} MiB",
        ages.len(),
        begun.elapsed().as_secs_f64(),
        100.0 * share,
        at(0.5),
        at(0.99),
        before.1,
        after.1
    );
    assert!(share <= 0.25 && at(0.99) <= 50.0, "{share} of a core, {} ms at 99 %", at(0.99));
    assert!(after.1 < 1.05 * before.1 + 1.0, "{} MiB became {}", before.1, after.1);
    dash.end();
}

/// A bundle whose only trial is one slow insertion.
fn slow_insertion(folder: &Path) -> PathBuf {
    let bundle = folder.join("slow");
    fs::create_dir_all(bundle.join("trials")).unwrap();
    for name in ["rig.toml", "vessel.stl"] {
        fs::copy(example().join(name), bundle.join(name)).unwrap();
    }
    let rows = ROWS_HZ * LONG_S;
    let row = |k: u32| {
        let (t_s, share) = (f64::from(k) / f64::from(ROWS_HZ), f64::from(k) / f64::from(rows));
        format!("{t_s},{},0\n", 0.028 + 0.028 * share)
    };
    let rows =
        "t_s,insertion_m,rotation_rad\n".to_owned() + &(0..=rows).map(row).collect::<String>();
    fs::write(bundle.join("trials/000.csv"), rows).unwrap();
    bundle
}

#[test]
#[ignore = "makes a recording of ten minutes first"]
fn a_recording_of_ten_minutes_is_scrubbed_without_a_pause() {
    let folder = tempfile::tempdir().unwrap();
    let (bundle, file) = (slow_insertion(folder.path()), folder.path().join("long.mcap"));
    let recorded = cathforce(["simulate", text(&bundle), "--out", text(&file), "--quiet"]);
    assert!(recorded.status.success(), "{}", String::from_utf8_lossy(&recorded.stderr));
    let dash = Dash::start(&[text(&file)]);
    let mut browser = Browser::start();
    browser.shape(1400, 1000, false);
    browser.open(&dash.address);
    browser.wait("cathforce.views.tracking.vessel !== undefined");
    for view in ["tracking", "forces"] {
        browser.click(&format!("#tab-{view}"));
        // From setting the slider to the end of the picture that shows it.
        let script = format!(
            "(async () => {{
              const pauses = [], slider = document.getElementById('scrub');
              for (let i = 0; i < {LOOKS}; i++) {{
                const to = {LONG_S} * ((i * 0.381966) % 1);
                await new Promise((r) => requestAnimationFrame(r));
                const begun = performance.now();
                slider.value = String(to);
                slider.dispatchEvent(new Event('input'));
                await new Promise((r) => requestAnimationFrame(() => setTimeout(r)));
                if (Math.abs(cathforce.t - to) > 0.1) throw new Error(`${{cathforce.t}} is not ${{to}}`);
                pauses.push(performance.now() - begun);
              }}
              return pauses.sort((a, b) => a - b);
            }})()"
        );
        let pauses = browser.value(&script);
        let pauses: Vec<f64> = pauses.as_array().unwrap().iter().flat_map(Value::as_f64).collect();
        let (median, most) = (pauses[pauses.len() / 2], pauses[pauses.len() - 1]);
        println!("{view}: {median:.0} ms in the median, {most:.0} ms at most");
        assert!(most <= 100.0, "{view}: {most} ms");
    }
    dash.end();
}
