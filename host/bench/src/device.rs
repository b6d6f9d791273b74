//! Cost of a tick on the emulated board, in instructions.

use anyhow::{Context, ensure};
use cathforce_bundle::{Bundle, ImageOptions, SolverDefaults, device_image};
use cathforce_bus::{Command, Encoder, Insertion, Rotation};
use cathforce_control::Mode;
use cathforce_link::qemu::Qemu;
use cathforce_link::{Client, Step};
use cathforce_mechanics::State;
use serde::Serialize;

/// The bundle that comes with the project, and its deepest trial.
const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
const TRIAL: u32 = 2;
/// Links that the deepest insertion needs; the last one enters well before the end.
const LINKS: f64 = 63.5;
/// Ticks at the end, with every link in use, whose instructions are counted singly.
const SINGLE_TICKS: usize = 300;
/// Stroke of the drive in these ticks, within the base link \[m\].
const STROKE_M: f64 = 0.4e-3;
/// Ticks that self-test, settling and arming may take.
const ARMING_TICKS: usize = 20_000;

/// Cost of a tick on the emulated board.
#[derive(Debug, Serialize)]
pub struct Device {
    /// Over all ticks until the deepest insertion, including the beginning of a run, supervision and
    /// frames.
    pub worst_instructions_one_solve: u32,
    pub worst_instructions_two_solves: u32,
    /// Largest relative deviation from the mean over ticks with all links in use, one solve \[1\].
    pub jitter: f64,
    /// Size of the model's state on a 64-bit host, a few bytes more than on the device.
    pub state_bytes: usize,
    /// Largest stack of a tick with all links in use, below the timer's interrupt.
    pub tick_stack_bytes: u32,
}

/// Result of one run.
struct Run {
    worst_instructions: u32,
    single: Vec<u32>,
    tick_stack_bytes: u32,
}

/// Runs the example on the emulated board: the firmware that `CATHFORCE_FIRMWARE` names.
pub fn measure() -> anyhow::Result<Device> {
    let bundle = Bundle::open(EXAMPLE)?;
    let one = run(&bundle, 1).context("one solve")?;
    let two = run(&bundle, 2).context("two solves")?;
    let mean = one.single.iter().copied().map(f64::from).sum::<f64>() / one.single.len() as f64;
    let deviations = one.single.iter().map(|&count| (f64::from(count) - mean).abs() / mean);
    Ok(Device {
        worst_instructions_one_solve: one.worst_instructions,
        worst_instructions_two_solves: two.worst_instructions,
        jitter: deviations.fold(0.0, f64::max),
        state_bytes: size_of::<State<f64>>() / 2,
        tick_stack_bytes: one.tick_stack_bytes.max(two.tick_stack_bytes),
    })
}

fn run(bundle: &Bundle, solves: u8) -> anyhow::Result<Run> {
    let trial = bundle.trial(TRIAL).context("the example has lost its trial")?;
    let insertion_m = &trial.catheter().context("not a catheter's trial")?.insertion_m;
    let deepest_m = insertion_m.iter().copied().fold(0.0, f64::max);
    let solver = SolverDefaults { solves, ..SolverDefaults::default() };
    let options = ImageOptions {
        link_length_m: Some(solver.link_length_over(deepest_m, LINKS)),
        solver,
        ..ImageOptions::default()
    };
    let (image, _) = device_image(bundle, &options)?;
    let mut client = Client::connect(Qemu::boot(None)?)?;
    client.set_lock_step(true)?;
    client.upload_image(&image, |_| std::ops::ControlFlow::Continue(()))?;

    let at = |tick: usize| {
        let sample = trial.encoder_at(trial.t_s[0] + 1e-3 * tick as f64);
        sample.map(|at| encoder(at.insertion_m, at.rotation_rad)).context("not a catheter's trial")
    };
    let still = at(0)?;
    reach(&mut client, Mode::Ready, Step { command: Some(Command::SelfTest), ..still })?;
    reach(&mut client, Mode::Armed, Step { command: Some(Command::Arm), ..still })?;
    let deepest = insertion_m.iter().position(|&x| x >= deepest_m).unwrap_or_default();
    let ticks = (1e3 * (trial.t_s[deepest] - trial.t_s[0])).floor() as usize;
    for tick in 0..=ticks {
        armed_tick(&mut client, at(tick)?)?;
    }
    let mut worst_instructions = client.status()?.load.worst_instructions;

    // Counters are reset around each tick, which gives its own instructions and stack.
    let here = trial.encoder_at(trial.t_s[0] + 1e-3 * ticks as f64).context("no encoder")?;
    let (mut single, mut tick_stack_bytes) = (Vec::with_capacity(SINGLE_TICKS), 0);
    for tick in 0..SINGLE_TICKS {
        let back = 1.0 - (2.0 * tick as f64 / SINGLE_TICKS as f64 - 1.0).abs();
        client.reset_counters()?;
        armed_tick(&mut client, encoder(here.insertion_m - STROKE_M * back, here.rotation_rad))?;
        let load = client.status()?.load;
        ensure!(load.worst_instructions > 0, "the board counts no instructions");
        single.push(load.worst_instructions);
        tick_stack_bytes = tick_stack_bytes.max(load.tick_stack_bytes);
    }
    worst_instructions = single.iter().copied().fold(worst_instructions, u32::max);
    Ok(Run { worst_instructions, single, tick_stack_bytes })
}

/// Plays one tick; fails if the device is not armed, because it would then do less.
fn armed_tick(client: &mut Client<Qemu>, step: Step) -> anyhow::Result<()> {
    let haptic = client.run_tick(step)?.haptic;
    let mode = Mode::from_codes(haptic.mode, haptic.fault);
    ensure!(mode == Some(Mode::Armed), "the device left Armed: {mode:?}");
    Ok(())
}

/// Repeats a command, with the drive at rest, until the device is in `wanted`.
fn reach(client: &mut Client<Qemu>, wanted: Mode, step: Step) -> anyhow::Result<()> {
    let still = Step { command: None, ..step };
    for tick in 0..ARMING_TICKS {
        let report = client.run_tick(if tick % 50 == 0 { step } else { still })?;
        if Mode::from_codes(report.haptic.mode, report.haptic.fault) == Some(wanted) {
            return Ok(());
        }
    }
    anyhow::bail!("the device is not {wanted:?} after {ARMING_TICKS} ticks")
}

fn encoder(insertion_m: f64, rotation_rad: f64) -> Step {
    let insertion = Insertion::from_m(insertion_m);
    let rotation = Rotation::from_rad(rotation_rad);
    Step { encoder: Some(Encoder { insertion, rotation }), ..Step::default() }
}
