//! The web front end for commands: how it is served, and a run or a diagnosis that is shown while it lasts.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

use cathforce_bus::{Direction, Frame};
use cathforce_control::Fault;
use cathforce_dash::{DashError, Diagnosing, Feed, Options, Source, feed, serve};
use cathforce_gap::BestSoFar;
use cathforce_gap::report::Diagnosis;
use cathforce_gap::wording::so_far;

use crate::commands::fault;
use crate::commands::gap::watched::Onlooker;
use crate::failure::{Code, Failure};
use crate::log::{Watch, Watcher};
use crate::session::interrupt_flag;
use crate::ui::Ui;

/// After the end of a run, for browsers to draw it.
const LAST_PICTURE: Duration = Duration::from_millis(200);
/// From one look at the flag of Ctrl-C to the next.
const LOOK: Duration = Duration::from_millis(50);

/// Shows a run in a browser while it lasts. `name`: of its device.
pub fn while_it_runs(
    ui: &Ui,
    listen: SocketAddr,
    name: &str,
    run: impl FnOnce(&Watch) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let (feed, source) = feed();
    let source = Source::Run { name: name.to_owned(), source };
    while_served(ui, listen, source, "run", || {
        let watch: Watch = Arc::new(feed);
        let ended = run(&watch);
        drop(watch);
        std::thread::sleep(LAST_PICTURE);
        ended
    })
}

/// Shows a diagnosis in a browser while it runs, and its answer until Ctrl-C. `name`: of its source.
pub fn while_diagnosing(
    ui: &Ui,
    listen: SocketAddr,
    name: &str,
    diagnose: impl FnOnce(&dyn Onlooker) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let diagnosing = Diagnosing::default();
    let source = Source::Diagnosing { name: name.to_owned(), diagnosing: diagnosing.clone() };
    while_served(ui, listen, source, "diagnosis", || {
        let interrupted = interrupt_flag()?;
        let ended = diagnose(&diagnosing);
        // Without an answer there is nothing to be looked at.
        if !diagnosing.is_over() {
            return ended;
        }
        // The first Ctrl-C cut the search, the next one ends the page.
        interrupted.store(false, Ordering::Relaxed);
        ui.say("the page shows the answer until Ctrl-C");
        while !interrupted.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
        }
        ended
    })
}

/// Serves a source while `run` does something. `what`: what can be watched.
fn while_served(
    ui: &Ui,
    listen: SocketAddr,
    source: Source,
    what: &str,
    run: impl FnOnce() -> Result<(), Failure>,
) -> Result<(), Failure> {
    warn_of_the_network(ui, listen);
    let stop = &AtomicBool::new(false);
    let (told, address) = channel();
    std::thread::scope(|scope| {
        // A server that cannot begin lets go of its end of the channel.
        let serve = move || {
            serve(source, options(listen, Vec::new()), stop, |started| {
                // Whoever asked waits for it.
                let _ = told.send(started.address);
            })
        };
        let server = scope.spawn(serve);
        let Ok(address) = address.recv() else {
            let ended = server.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            return Err(ended.map_or_else(Failure::from, |()| {
                Failure::new(Code::Failed, format!("the web server ended before the {what} began"))
            }));
        };
        ui.say(format_args!("watch the {what} at http://{address}/"));
        let ended = run();
        stop.store(true, Ordering::Relaxed);
        let served = server.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        ended.and(served.map_err(Failure::from))
    })
}

impl Onlooker for Diagnosing {
    fn begins(&self, expected: u64, budget: Option<Duration>) {
        self.begins(expected, budget);
    }

    fn simulated(&self, simulations: u64) {
        self.simulated(simulations);
    }

    fn found(&self, best: &BestSoFar) {
        let sentences: Vec<String> = best.effects.iter().map(so_far).collect();
        self.found(&sentences, best.closes, best.sets);
    }

    fn ends(&self, answer: &Diagnosis) -> Result<(), Failure> {
        let json = serde_json::to_value(answer);
        let json =
            json.map_err(|e| Failure::new(Code::Failed, format!("cannot write JSON: {e}")))?;
        self.ends(json);
        Ok(())
    }
}

impl Watcher for Feed {
    fn begins(&self, image: &[u8], lock_step: bool) {
        self.begins(image, lock_step);
    }

    fn frame(&self, direction: Direction, frame: &Frame) {
        self.frame(direction, frame);
    }
}

/// How it is served. `names`: by which browsers may ask, beside `localhost`.
pub fn options(listen: SocketAddr, names: Vec<String>) -> Options {
    Options {
        listen,
        names,
        token_folder: token_folder(),
        fault_pages: fault_pages(),
        foxglove: None,
    }
}

/// Name and text of the page of each fault.
pub fn fault_pages() -> Vec<(&'static str, &'static str)> {
    Fault::ALL.iter().map(|&fault| (fault.name(), fault::page(fault))).collect()
}

/// Warns where others of the network can reach it.
pub fn warn_of_the_network(ui: &Ui, listen: SocketAddr) {
    if !listen.ip().is_loopback() {
        ui.warn("every computer of the network can watch, and HTTP is not encrypted");
    }
}

/// A folder of this user alone where there is one; the file can be read by nobody else in any case.
fn token_folder() -> PathBuf {
    std::env::var_os("XDG_RUNTIME_DIR")
        .map(PathBuf::from)
        .filter(|folder| folder.is_dir())
        .unwrap_or_else(std::env::temp_dir)
}

impl From<DashError> for Failure {
    fn from(error: DashError) -> Self {
        let code = match error {
            DashError::Vessel(_) => Code::Input,
            DashError::WithoutFoxglove
            | DashError::WithoutRos2
            | DashError::NothingForFoxglove
            | DashError::NothingToSave => Code::Usage,
            DashError::Listen { .. }
            | DashError::Foxglove { .. }
            | DashError::Ros2 { .. }
            | DashError::Token { .. }
            | DashError::Served(_) => Code::Failed,
        };
        Self::new(code, error.to_string())
    }
}
