//! `cathforce dash` in a real browser: every view with data of the emulated board, a recording and a
//! diagnosis, on a wide screen and on a phone, light and dark.

#![cfg(unix)]

#[path = "support/program.rs"]
mod program;
mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use program::{Dash, cathforce, example, program, text};
use serde_json::json;
use support::Browser;

#[track_caller]
fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` in: {said}");
    }
}

/// Wide and narrow, light and dark.
const SHAPES: [(u32, u32, bool, &str); 4] = [
    (1400, 1000, false, "wide-light"),
    (1400, 1000, true, "wide-dark"),
    (390, 844, false, "narrow-light"),
    (390, 844, true, "narrow-dark"),
];

/// Where pictures of the pages are kept: `target/dash`.
fn pictures() -> PathBuf {
    let built = program().parent().and_then(Path::parent).unwrap().to_owned();
    let folder = built.join("dash");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Keeps a picture of a view in every shape, and checks what must hold in each.
fn look(browser: &mut Browser, view: &str) {
    for (width, height, dark, name) in SHAPES {
        browser.shape(width, height, dark);
        // Two pictures later everything has its new size.
        browser.value("new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)))");
        browser.value("new Promise((r) => setTimeout(r, 300))");
        let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= u64::from(width), "{view} {name}: {wide} pixels wide");
        browser.picture(&pictures().join(format!("{view}-{name}.png")));
        if browser.value("typeof axe") == "undefined" {
            browser.value(&format!("{AXE}; 0"));
        }
        let faults = browser.value(CHECK);
        assert_eq!(faults, json!([]), "{view} {name}");
    }
    browser.shape(1400, 1000, false);
}

/// axe-core by Deque, 4.14.1 of npm, licence MPL-2.0 (`vendor/axe.LICENSE`).
const AXE: &str = include_str!("vendor/axe.min.js");
/// What is wrong for people who read with other means, by the rules of WCAG 2.2 up to level AA.
const CHECK: &str = r#"(async () => {
  const rules = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"];
  const found = await axe.run(document, { runOnly: rules, resultTypes: ["violations"] });
  const where = (rule) => rule.nodes.map((node) => node.html.slice(0, 120)).join(" | ");
  return found.violations.map((rule) => `${rule.id}: ${rule.help}: ${where(rule)}`);
})()"#;

/// The link of the emulated board where the suite has built its firmware, else the device in the process.
fn board() -> &'static str {
    match std::env::var_os("CATHFORCE_FIRMWARE") {
        Some(_) => "qemu",
        None => "sim",
    }
}

/// A trial whose drive jumps by 8 mm at 1.2 s: a broken encoder.
fn bundle_with_a_jump(folder: &Path) -> PathBuf {
    let bundle = folder.join("bundle");
    let copied = Command::new("cp").args(["-r", text(&example()), text(&bundle)]).status().unwrap();
    assert!(copied.success());
    let path = bundle.join("trials/000.csv");
    let csv = fs::read_to_string(&path).unwrap();
    let mut lines = csv.lines();
    let head = lines.next().unwrap().to_owned();
    let columns = head.split(',').collect::<Vec<_>>();
    let at = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    let (time, insertion) = (at("t_s"), at("insertion_m"));
    let mut jumped = vec![head.clone()];
    let mut start_s = None;
    for line in lines {
        let mut cells = line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let t_s: f64 = cells[time].parse().unwrap();
        if t_s - *start_s.get_or_insert(t_s) > 1.2 {
            let m: f64 = cells[insertion].parse().unwrap();
            cells[insertion] = format!("{}", m + 0.008);
        }
        jumped.push(cells.join(","));
    }
    fs::write(&path, jumped.join("\n") + "\n").unwrap();
    bundle
}

#[test]
fn a_device_is_watched_changed_and_its_fault_acknowledged() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = bundle_with_a_jump(folder.path());
    let dash = Dash::start(&[board(), "--bundle", text(&bundle)]);
    let mut browser = Browser::start();
    browser.shape(1400, 1000, false);
    browser.open(&dash.address);

    // Watching needs no token.
    browser.wait("cathforce.frame.mode === 'ready' && cathforce.frame.shape.at.length > 30");
    browser.wait("cathforce.views.tracking.vessel !== undefined");
    assert_eq!(browser.value("cathforce.frame.armed"), false);
    let state = dash.get("/api/state");
    assert_eq!((&state["source"], &state["mode"]), (&json!("link"), &json!("ready")));
    assert!(state["tick"].as_u64().unwrap() > 0 && state["forces"]["fx_N"].is_number(), "{state}");
    assert!(state["age_ms"].is_number(), "{state}");

    // Arming needs it.
    browser.click("#arm");
    browser.fill("#token-field", "wrong");
    browser.click("dialog button[type=submit]");
    browser.wait("document.querySelector('dialog .bad').textContent.includes('not the token')");
    assert_eq!(dash.get("/api/state")["mode"], "ready");
    let token = dash.token();
    browser.fill("#token-field", &token);
    browser.click("dialog button[type=submit]");
    browser.wait("cathforce.frame.armed");

    // An armed device takes no settings.
    browser.click("#tab-settings");
    browser.fill("#search", "force_gain");
    browser.fill("#set-force_gain", "0.75");
    browser.click("#apply");
    browser.wait("document.getElementById('said').textContent.includes('disarm it first')");
    browser.click("#arm");
    browser.wait("cathforce.frame.mode === 'ready'");
    look(&mut browser, "settings");
    browser.click("#apply");
    browser.wait("document.getElementById('settings-state').textContent.includes('read back from the device')");
    let settings = dash.get("/api/settings");
    let found = settings.as_array().unwrap().iter().find(|entry| entry["name"] == "force_gain");
    assert_eq!(found.unwrap()["value"], 0.75);
    assert_eq!(found.unwrap()["modified"], true);
    // A tip is chosen by its drawing.
    browser.click("#tip-hook");
    browser.click("#apply");
    browser.wait("document.getElementById('settings-state').textContent.includes('One setting was applied and read back')");
    assert_eq!(dash.get("/api/tips")["in_use"], "hook");
    browser.wait("document.getElementById('tip-hook').checked");
    // A value out of range is never staged.
    browser.fill("#set-force_gain", "1e9");
    browser.wait("document.getElementById('settings-state').textContent.includes('is outside')");
    assert_eq!(browser.value("document.getElementById('apply')"), json!(null));

    // The trial moves the catheter, and its jump is a fault.
    browser.wait("cathforce.frame.mode === 'ready'");
    browser.click("#tab-tracking");
    browser.click("#play-trial");
    browser.wait("cathforce.frame.playing.t_s > 0.6 && cathforce.frame.twin.agreed > 100");
    assert_eq!(browser.value("cathforce.frame.lock_step ? cathforce.frame.twin.differed : 0"), 0);
    look(&mut browser, "tracking");
    browser.wait("cathforce.frame.faults.some((f) => f.name === 'EncoderJump')");
    browser.click("#tab-forces");
    browser.wait("cathforce.views.forces.charts[0].plot.data[0].length > 20");
    browser.click("#peak-hold");
    look(&mut browser, "forces");
    browser.click("#tab-timing");
    browser.wait("document.querySelectorAll('#waterfall rect').length >= 4");
    assert!(browser.text("#age-summary").contains("99th percentile"));
    look(&mut browser, "timing");
    browser.click("#tab-faults");
    let card = browser.text("#fault-list");
    for word in ["EncoderJump", "the device has it now", "first at", "once", "Cause:", "Next:"] {
        assert!(card.contains(word), "{word} in {card}");
    }
    look(&mut browser, "faults");
    browser.click("#fault-list button");
    browser.wait("cathforce.frame.faults.length === 0 && cathforce.frame.mode === 'ready'");
    assert!(browser.text("#fault-list").contains("No fault waits"));

    // The tabs by keyboard.
    browser.value("document.getElementById('tab-faults').focus()");
    browser.key("Home");
    browser.wait("document.activeElement.id === 'tab-tracking' && !document.getElementById('panel-tracking').hidden");
    // The wrong token and the change of an armed device were refused on purpose.
    let meant = |own: &&String| !["/api/token", "/api/do"].iter().any(|path| own.contains(path));
    let complaints: Vec<&String> = browser.complaints.iter().filter(meant).collect();
    assert!(complaints.is_empty(), "the page complained: {complaints:?}");
    drop(browser);
    dash.end();
}

#[test]
fn a_recording_is_scrubbed_marked_and_filmed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("<b>run.mcap");
    let recorded = cathforce([
        "simulate",
        text(&example()),
        "--duration",
        "2",
        "--out",
        text(&file),
        "--quiet",
    ]);
    assert!(recorded.status.success(), "{}", String::from_utf8_lossy(&recorded.stderr));
    let dash = Dash::start(&[text(&file)]);
    let state = dash.get("/api/state");
    assert_eq!(state["source"], "recording");
    assert!(state["tick"].is_number() && state["forces"]["norm_N"].is_number(), "{state}");
    assert!(dash.token_file.is_none(), "there is nothing to change");

    let mut browser = Browser::start();
    browser.shape(1400, 1000, false);
    browser.open(&dash.address);
    assert!(browser.text("#source-name").contains("<b>run.mcap"), "a name is text");
    assert_eq!(browser.value("document.querySelector('#source-name b')"), json!(null));
    browser.wait("cathforce.views.tracking.vessel !== undefined");
    browser.fill("#scrub", "1.5");
    browser
        .wait("Math.abs(cathforce.frame.t - 1.5) < 1e-6 && cathforce.frame.shape.at.length > 30");
    let before = browser.value("cathforce.frame.insertion_m").as_f64().unwrap();
    look(&mut browser, "replay-tracking");
    browser.click("#tab-forces");
    browser.wait("cathforce.views.forces.charts[3].plot.data[0].length > 500");
    assert_eq!(browser.value("cathforce.recording.hasMeasured"), true);
    look(&mut browser, "replay-forces");
    browser.fill("#scrub", "0.5");
    browser.wait("Math.abs(cathforce.frame.t - 0.5) < 1e-6 && cathforce.frame.mode === 'armed'");
    assert_ne!(browser.value("cathforce.frame.insertion_m").as_f64().unwrap(), before);
    browser.click("#tab-timing");
    browser.wait("document.getElementById('ticks').textContent.includes('missed ticks')");

    browser.click("#tab-replay");
    browser.fill("#mark-name", "<i>here</i>");
    browser.click("#mark");
    browser.wait("document.getElementById('marks').textContent.includes('<i>here</i>')");
    assert_eq!(browser.value("document.querySelector('#marks i')"), json!(null));
    browser.fill("#scrub", "1.9");
    browser.click("#marks li button");
    browser.wait("Math.abs(cathforce.t - 0.5) < 1e-6");
    browser.click("#png");
    browser.wait("cathforce.views.replay.saved?.type === 'image/png'");
    let bytes = browser.value("cathforce.views.replay.saved.size").as_u64().unwrap();
    assert!(bytes > 10_000, "a picture of {bytes} bytes shows nothing");
    browser.click("#film");
    browser.wait("cathforce.t > 0.8 && cathforce.views.replay.bytes > 1000");
    browser.click("#film");
    browser.wait("cathforce.views.replay.saved?.type === 'video/webm'");
    assert!(browser.value("cathforce.views.replay.saved.size").as_u64().unwrap() > 1000);
    look(&mut browser, "replay");
    assert_eq!(browser.complaints, Vec::<String>::new().as_slice(), "the page complained");
    drop(browser);
    dash.end();
}

#[test]
fn a_diagnosis_of_either_version_opens_with_its_answer() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("diagnosis.json");
    let cell = |arc_m: [f64; 2], gap_share: f64| {
        json!({ "channel": "fx_N", "phase": "sliding", "regime": "forward 13 mm/s", "arc_m": arc_m,
            "time_share": 0.22, "gap_share": gap_share, "gap_share_low": 0.9 * gap_share,
            "gap_share_high": 1.1 * gap_share, "note": "sign follows the direction <b>of</b> motion" })
    };
    let stiffness = json!({ "value": 1.42, "low": 1.34, "high": 1.5, "unit": "1" });
    let mut answer = json!({
        "format": "gap-diagnosis/1", "bundle": "tapered", "verdict": "named",
        "effects": [{ "id": "instrument.stiffness", "parameters": { "shaft_factor": stiffness },
            "confidence": 0.93, "shrink": 0.91, "material": true }],
        "confusable": [["instrument.stiffness", "wall.stiffness"]],
        "ranking": [{ "id": "instrument.stiffness", "shrink": 0.91 }, { "id": "wall.stiffness", "shrink": 0.7 }],
        "gap": { "force_rms_N": { "before": 0.0405, "after": 0.0127, "floor": 0.01 }, "shape_rms_m": null },
        "held_out": [0, 1], "where": [cell([0.031, 0.047], 0.4), cell([0.078, 0.094], 0.2)], "left": null,
        "next_experiment": { "segment": "reversal-20mm", "separates": ["instrument.stiffness", "wall.stiffness"] },
        "reproduce": { "command": "cathforce gap diagnose tapered", "version": "0.1.0", "bundle_sha256": "0a" },
        "remarks": ["no drive force was measured"],
    });
    fs::write(&file, answer.to_string()).unwrap();
    // The folder of a bundle stands for the diagnosis in it.
    let dash = Dash::start(&[text(folder.path())]);
    assert_eq!(dash.get("/api/state")["mode"], "diagnosis");
    let mut browser = Browser::start();
    browser.open(&dash.address);
    let said = browser.text("#sentence");
    assert!(
        said.contains("Stiffness of the catheter") && said.contains("40.5 mN to 12.7 mN"),
        "{said}"
    );
    let page = browser.text("#panels");
    for words in [
        "Where",
        "Which",
        "How far",
        "31 to 47 mm",
        "1.42 (1.34 to 1.5)",
        "sliding",
        "<b>of</b>",
        "These data do not tell apart: stiffness of the catheter and stiffness of the wall.",
        "cathforce gap protocol --segment reversal-20mm",
        "No drive force was measured.",
    ] {
        assert!(page.contains(words), "{words} in {page}");
    }
    look(&mut browser, "diagnosis");
    dash.end();

    answer["format"] = json!("gap-diagnosis/2");
    answer["sentence"] = json!("The catheter is 42 % stiffer along the shaft than rig.toml says.");
    answer["none_of_mine"] = json!(0.02);
    answer["effects"][0]["form"] = json!({ "name": "constant_factor", "probability": 0.8 });
    answer["detectable"] = json!([
        { "id": "contact.friction", "parameter": "friction_coefficient", "size": 0.05, "unit": "1" },
        { "id": "fluid.drag", "parameter": "factor", "size": null, "unit": "1" },
    ]);
    answer["series"] = json!([{
        "trial": 2, "channel": "fx_N", "unit": "N", "t_s": [0.0, 1.0, 2.0],
        "measured": [0.0, 0.1, 0.2], "nominal": [0.0, 0.05, 0.1], "corrected": [0.0, 0.09, 0.19],
    }]);
    fs::write(&file, answer.to_string()).unwrap();
    let dash = Dash::start(&[text(&file)]);
    browser.open(&dash.address);
    browser.wait("document.querySelectorAll('path.curve').length === 3");
    assert!(browser.text("#sentence").starts_with("The catheter is 42 % stiffer"));
    let page = browser.text("#panels");
    for words in [
        "form: constant factor (80 %)",
        "2 %",
        "never by these trials",
        "What these trials would have shown",
        "Trial 2, force on the vessel along x",
    ] {
        assert!(page.contains(words), "{words} in {page}");
    }
    assert_eq!(browser.complaints, Vec::<String>::new().as_slice(), "the page complained");
    drop(browser);
    dash.end();
}

#[test]
fn a_diagnosis_is_followed_while_it_runs_and_opens_with_its_answer() {
    let mut browser = Browser::start();
    browser.shape(1400, 1000, false);
    let dash = Dash::diagnosing(&[text(&example()), "--budget", "25s"]);
    browser.open(&dash.address);
    assert_eq!(dash.get("/api/state")["mode"], "diagnosing");
    browser.wait("document.getElementById('count').textContent.includes('simulations of trials')");
    browser.wait("document.getElementById('left').textContent.startsWith('About')");
    look(&mut browser, "diagnosing");
    browser.wait(
        "cathforce.source.kind === 'diagnosis' && document.getElementById('sentence') !== null",
    );
    let answer = dash.get("/api/data");
    // The budget ended the search before it was done, and the page says so.
    assert_eq!((&answer["format"], &answer["cut"]), (&json!("gap-diagnosis/2"), &json!(true)));
    assert!(browser.text("#d-answer").contains("A time budget ended the search"));
    assert_eq!(browser.text("#sentence"), answer["sentence"].as_str().unwrap());
    assert_eq!(browser.complaints, Vec::<String>::new().as_slice(), "the page complained");
    drop(browser);
    dash.end();
}

#[test]
fn a_recording_saved_as_a_page_is_scrubbed_without_a_server() {
    let folder = tempfile::tempdir().unwrap();
    let [file, page] = ["run.mcap", "run.html"].map(|name| folder.path().join(name));
    let bundle = example();
    let run = ["simulate", text(&bundle), "--duration", "2", "--out", text(&file), "--quiet"];
    assert!(cathforce(run).status.success());
    let saved = cathforce(["dash", text(&file), "--save", text(&page)]);
    assert!(saved.status.success(), "{}", String::from_utf8_lossy(&saved.stderr));
    fs::remove_file(&file).unwrap();
    let mut browser = Browser::start();
    browser.shape(1400, 1000, false);
    browser.open(&format!("file://{}", text(&page)));
    browser.wait("cathforce.views.tracking.vessel !== undefined");
    browser.fill("#scrub", "1.5");
    browser
        .wait("Math.abs(cathforce.frame.t - 1.5) < 1e-6 && cathforce.frame.shape.at.length > 30");
    browser.click("#tab-forces");
    browser.wait("cathforce.views.forces.charts[3].plot.data[0].length > 500");
    look(&mut browser, "saved-forces");
    browser.click("#tab-faults");
    browser.wait("document.getElementById('fault-list').textContent.length > 10");
    assert_eq!(browser.complaints, Vec::<String>::new().as_slice(), "the page complained");
    assert_fails(&cathforce(["dash", "sim", "--save", text(&page)]), 2, &["cannot be saved"]);
}

#[test]
fn what_is_no_source_is_refused_with_what_to_give() {
    let output = cathforce(["dash", "nowhere.mcap", "--listen", "127.0.0.1:0"]);
    assert_fails(&output, 2, &["`nowhere.mcap` is no file", "socketcan:can0"]);
    let folder = tempfile::tempdir().unwrap();
    let output = cathforce(["dash", text(folder.path()), "--listen", "127.0.0.1:0"]);
    assert_fails(&output, 3, &["no diagnosis of this bundle yet", "cathforce gap diagnose"]);
    let file = folder.path().join("other.json");
    fs::write(&file, "{}").unwrap();
    let output = cathforce(["dash", text(&file), "--listen", "127.0.0.1:0"]);
    assert_fails(&output, 3, &["no `format`", "cathforce gap diagnose BUNDLE --json"]);
    let output = cathforce(["dash", text(&file), "--watch-only", "--listen", "127.0.0.1:0"]);
    assert_fails(&output, 2, &["--watch-only is for a link"]);
}
