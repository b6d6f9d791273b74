//! Receives a sensor's packets in a thread of its own.

use std::net::UdpSocket;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::address::SensorAddress;
use super::collected::Collected;
use super::configuration::{Configuration, HTTP_PORT};
use super::error::SensorError;
use super::packet::{self, PACKET_BYTES};
use super::timing::Timing;
use crate::import::{AxisMap, ForceSample};

/// How long a sensor may take for its first packet.
const PATIENCE: Duration = Duration::from_secs(2);
/// After which the thread looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);
/// How far the rate may be from the one that is set in the sensor.
const SAME_RATE: f64 = 0.02;

/// What the sensor does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorOptions {
    /// Counts of one newton; `None` asks the sensor's web server.
    pub counts_per_n: Option<f64>,
    pub axes: AxisMap,
    /// Time at the trial's beginning whose mean force is subtracted \[s\].
    pub tare_s: f64,
}

/// A sensor that streams until it is dropped.
pub struct ForceSensor {
    address: SensorAddress,
    options: SensorOptions,
    configuration: Configuration,
    collected: Arc<Mutex<Collected>>,
    /// Time 0 of the arrivals.
    began: Instant,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The forces of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SensedForces {
    /// By the time of the trial, vessel frame.
    pub samples: Vec<ForceSample>,
    /// What was understood: packets, rate, unit, time.
    pub understood: Vec<String>,
    /// What is missing or was left out.
    pub remarks: Vec<String>,
}

impl ForceSensor {
    /// Starts the stream and waits for its first packet.
    pub fn start(address: &SensorAddress, options: SensorOptions) -> Result<Self, SensorError> {
        let configuration = match options.counts_per_n {
            Some(counts_per_n) => Configuration::given(counts_per_n),
            None => Configuration::ask(address, HTTP_PORT)?,
        };
        let failed = |e: std::io::Error| {
            let fix = "check the address and the network";
            SensorError::new(format!("{address}: {e}"), fix)
        };
        let at = address.at(address.port)?;
        let any = if at.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(any).map_err(failed)?;
        // Packets of anybody else are not received.
        socket.connect(at).map_err(failed)?;
        socket.set_read_timeout(Some(LOOK)).map_err(failed)?;
        socket.send(&packet::start()).map_err(failed)?;
        let (collected, stop) = (Arc::default(), Arc::new(AtomicBool::new(false)));
        let began = Instant::now();
        let (shared, ended) = (Arc::clone(&collected), Arc::clone(&stop));
        let thread = std::thread::spawn(move || receive(&socket, &shared, began, &ended));
        let (address, thread) = (address.clone(), Some(thread));
        let sensor = Self { address, options, configuration, collected, began, stop, thread };
        while lock(&sensor.collected).arrived() == 0 {
            if began.elapsed() > PATIENCE {
                let problem = format!("{}: no packet came in {PATIENCE:?}", sensor.address);
                let fix = "check the address, that RDT is enabled on the sensor's page comm.htm, and that no \
                           firewall stops UDP";
                return Err(SensorError::new(problem, fix));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(sensor)
    }

    /// The unit of its forces, in words.
    pub fn unit(&self) -> &str {
        &self.configuration.text
    }

    /// The forces from the start of a trial on until now.
    pub fn forces(&self, trial_began: Instant) -> Result<SensedForces, SensorError> {
        let collected = lock(&self.collected).clone();
        let arrivals = collected.taken.iter().map(|taken| (taken.number, taken.at_s));
        let timing = Timing::of(&arrivals.collect::<Vec<_>>());
        let start_s = trial_began.saturating_duration_since(self.began).as_secs_f64();
        let samples = collected.taken.iter().map(|taken| {
            let at_s = timing.map_or(taken.at_s, |timing| timing.at_s(taken.number));
            let counts = taken.counts.map(f64::from);
            ForceSample {
                t_s: at_s - start_s,
                force_n: self.options.axes.apply(counts.map(|x| x * self.configuration.newtons)),
            }
        });
        let mut samples = samples.filter(|sample| sample.t_s >= 0.0).collect::<Vec<_>>();
        let mut remarks = collected.remarks();
        let Some(first) = samples.first() else {
            let said = if remarks.is_empty() { "it is silent".into() } else { remarks.join("; ") };
            let problem = format!("{}: no force was measured in the trial: {said}", self.address);
            return Err(SensorError::new(problem, "look at the sensor's own page, and its cable"));
        };
        let clock = self.clock(timing.as_ref(), first.t_s, &mut remarks);
        let understood = vec![format!("{} forces, {clock}; {}", samples.len(), self.unit())];
        self.tare(&mut samples)?;
        Ok(SensedForces { samples, understood, remarks })
    }

    /// How the forces are timed, in words.
    fn clock(&self, timing: Option<&Timing>, first_s: f64, remarks: &mut Vec<String>) -> String {
        let Some(timing) = timing else {
            return "timed by their arrival, because they are too few for a rate".into();
        };
        let rate_hz = timing.rate_hz();
        if let Some(set_hz) = self.configuration.rate_hz
            && (rate_hz / set_hz - 1.0).abs() > SAME_RATE
        {
            remarks.push(format!(
                "the sensor sends {rate_hz:.1} packets a second, and {set_hz} are set in it"
            ));
        }
        format!(
            "timed by their numbers and this computer's clock: {rate_hz:.2} Hz, the first {:.1} ms after the \
             trial's beginning; nine of ten packets came within {:.2} ms of the fastest, the last within \
             {:.2} ms",
            1e3 * first_s,
            1e3 * timing.most_s,
            1e3 * timing.latest_s
        )
    }

    fn tare(&self, samples: &mut [ForceSample]) -> Result<(), SensorError> {
        let tare_s = self.options.tare_s;
        let still = samples.partition_point(|sample| sample.t_s < tare_s);
        if tare_s == 0.0 {
            return Ok(());
        }
        if still == 0 || still == samples.len() {
            let problem = format!(
                "{}: the trial has no force within the tare, or none after it",
                self.address
            );
            return Err(SensorError::new(
                problem,
                "give --tare only the seconds in which nothing touched",
            ));
        }
        let mean: [f64; 3] = std::array::from_fn(|k| {
            samples[..still].iter().map(|one| one.force_n[k]).sum::<f64>() / still as f64
        });
        for sample in samples {
            sample.force_n.iter_mut().zip(mean).for_each(|(force_n, mean)| *force_n -= mean);
        }
        Ok(())
    }
}

impl Drop for ForceSensor {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It panics only where this program does.
            let _ = thread.join();
        }
    }
}

fn receive(socket: &UdpSocket, collected: &Mutex<Collected>, began: Instant, stop: &AtomicBool) {
    // One byte more tells a longer packet from one that fits.
    let mut bytes = [0; PACKET_BYTES + 1];
    while !stop.load(Ordering::Relaxed) {
        // An error is a silence, or the word of a host that nobody listens there yet.
        let Ok(length) = socket.recv(&mut bytes) else { continue };
        let at_s = began.elapsed().as_secs_f64();
        lock(collected).take(&bytes[..length], at_s);
    }
    // A sensor that does not hear it is silenced by its own restart.
    let _ = socket.send(&packet::stop());
}

/// Ignores poisoning: a panic elsewhere must not lose the forces.
fn lock(collected: &Mutex<Collected>) -> MutexGuard<'_, Collected> {
    collected.lock().unwrap_or_else(PoisonError::into_inner)
}
