//! What a bus does to the board: bus-off (P19), and a flood while it runs free (P10, P20). And a tick that
//! takes longer than its time (P09).

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cathforce_bundle::ImageOptions;
use cathforce_bus::service::{
    self, HostEndpoint, Load, MAX_REQUEST, Request, SavedState, Status as Report, crc32,
};
use cathforce_bus::{Command, Counter, Frame, Id, Process, Sealer, Status};
use cathforce_config::Settings;
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::lab::Lab;
use cathforce_hil_tests::{Bench, Drive, Rig, encoder, image_with, small_image};
use cathforce_link::{Client, ClientError, Link, LinkError};

/// A short insertion, so that settling ends soon.
const START: Drive = Drive { insertion_m: 0.012, rotation_rad: 0.0 };

fn mode<R: Rig>(bench: &mut Bench<R>) -> Option<Mode> {
    let report = bench.report();
    Mode::from_codes(report.mode, report.fault)
}

/// The controller of the emulated board is an SLCAN adapter on its UART, which states its error state as
/// Linux reads it. The service's answers are the lab's window: they go on.
#[test]
fn p19_bus_off_on_the_board_switches_off_comes_back_seldom_and_arms_nothing() {
    /// A ramp, a time-out, and a few more.
    const SWITCHED_OFF_TICKS: u16 = 26;
    const STEP: u16 = 10;
    let mut bench = Bench::<Lab>::armed(small_image(), START);
    assert!(bench.link_mut().outputs_are_on());
    bench.link_mut().debugger.go_on();
    let (began, sent) = (bench.report().tick, bench.link_mut().openings());
    bench.link_mut().send_bytes(b"sb256256\r");
    bench.grant_ticks(SWITCHED_OFF_TICKS);
    assert_eq!(mode(&mut bench), Some(Mode::Fault { cause: Fault::BusOff }));
    assert!(!bench.link_mut().outputs_are_on());
    bench.link_mut().debugger.go_on();
    let mut attempts = Vec::new();
    for _ in 0..80 {
        bench.grant_ticks(STEP);
        let at = bench.report().tick - began;
        let openings = bench.link_mut().openings() - sent;
        attempts.extend((attempts.len()..openings as usize).map(|_| at));
    }
    println!("figure P19: started again before ticks {attempts:?} after bus-off");
    // After 100, 200 and 400 ticks more; seen at the end of a step.
    let seen = |due: u32| due..=due + u32::from(2 * STEP);
    let due = [100, 300, 700].map(seen);
    assert!(attempts.len() == 3 && due.iter().zip(&attempts).all(|(due, at)| due.contains(at)));
    let unsent = bench.report().counters.get(Counter::BusOff);
    assert!(unsent >= 2 * 800, "{unsent} frames were held back");

    // The bus is back. That alone does nothing, nor does any command but the one that clears the fault.
    bench.link_mut().send_bytes(b"sa000000\r");
    let latched = Some(Mode::Fault { cause: Fault::BusOff });
    let command = |bench: &mut Bench<Lab>, command| {
        let frames = [Process::Command(command), encoder(START)].map(|frame| bench.seal(frame));
        for frame in frames {
            bench.link_mut().send(&frame).expect("sent");
        }
        bench.grant_ticks(1);
        mode(bench)
    };
    for tried in [Command::Arm, Command::SelfTest, Command::Disarm] {
        assert_eq!(command(&mut bench, tried), latched, "{tried:?}");
    }
    let token = Fault::BusOff.clear_token();
    assert_eq!(command(&mut bench, Command::ClearFault { token }), Some(Mode::Boot));
    assert_eq!(command(&mut bench, Command::Arm), Some(Mode::Boot));
    assert_eq!(bench.link_mut().openings() - sent, 3, "it goes on starting a bus that is there");
}

/// The tick's timer is set to half of what a tick takes, from outside.
#[test]
fn p09_two_ticks_in_a_row_that_overrun_are_counted_and_cut() {
    /// Reload value of the tick timer, which counts 20 instructions.
    const TIMER_RELOAD: u32 = 0x4000_0008;
    const INSTRUCTIONS_A_COUNT: u32 = 20;
    let mut bench = Bench::<Lab>::armed(small_image(), START);
    bench.reset_counters();
    bench.play([vec![encoder(START)], vec![encoder(START)]]);
    let instructions = bench.report().load.worst_instructions;
    let lab = bench.link_mut();
    assert!(lab.outputs_are_on());
    lab.debugger.set_peripheral(TIMER_RELOAD, instructions / INSTRUCTIONS_A_COUNT / 2);
    lab.debugger.go_on();
    bench.grant_ticks(8);
    let report = bench.report();
    println!(
        "{instructions} instructions: {} overruns, {} missed ticks",
        report.load.overruns, report.load.missed_ticks
    );
    assert_eq!(
        Mode::from_codes(report.mode, report.fault),
        Some(Mode::Fault { cause: Fault::Overrun })
    );
    // Two overruns cut; a tick in a fault is short enough.
    assert!((2..=4).contains(&report.load.overruns), "{:?}", report.load);
    assert!(report.load.missed_ticks >= report.load.overruns);
    assert!(!bench.link_mut().outputs_are_on());
}

/// Frames of 8 bytes on a bus of 1 Mbit/s in a tick, at 111 bits each.
const FULL_BUS: u32 = 1000 / 111;
/// Long for a busy computer, on which the board takes seconds for what takes it milliseconds.
const PATIENCE: Duration = Duration::from_secs(600);
/// Promise P10.
const LATEST_NS: u32 = 2000;

fn check_load(load: &Load) {
    assert!(load.latest_start_ns <= LATEST_NS && load.missed_ticks == 0, "{load:?}");
}

/// The status of a board that may be starved for longer than the client waits for an answer.
fn patient_status(client: &mut Client<Flooded>, until: Instant) -> Report {
    loop {
        match client.status() {
            Ok(status) => return status,
            Err(why) => assert!(Instant::now() < until, "{why:?}"),
        }
    }
}

/// Brings the board, which hears samples, to a mode by a command.
fn reach(client: &mut Client<Flooded>, until: Instant, command: Command, wanted: Mode) {
    loop {
        client.command(command).expect("sent");
        let status = patient_status(client, until);
        if Mode::from_codes(status.mode, status.fault) == Some(wanted) {
            break;
        }
        assert!(Instant::now() < until, "{status:?}");
    }
}

/// As many foreign frames as fill a bus, beside those of master and device, for every tick that is heard. The
/// board runs free: frames come at any time within a tick.
///
/// The flooded board is asked nothing, because its tasks starve on a computer that is slow; the worst cases are read
/// after each round. A computer that is busy for milliseconds also takes samples away from the board, which then
/// ramps down: such a round is checked all the same, and another one is played for the armed ticks.
#[test]
fn p10_p20_a_full_bus_delays_no_tick_of_an_armed_board_that_runs_free() {
    const TICKS: u32 = 250;
    const ARMED_ROUNDS: u32 = 4;
    const MOST_ROUNDS: u32 = 40;
    let mut client = Client::connect(Flooded::new(<Lab as Rig>::boot())).expect("a board");
    client.upload_image(small_image(), |_| ControlFlow::Continue(())).expect("taken");
    let lab = &mut client.link_mut().lab;
    lab.keep_awake();
    lab.debugger.go_on();
    client.set_lock_step(false).expect("nothing is armed");
    client.link_mut().samples = true;
    let until = Instant::now() + PATIENCE;
    reach(&mut client, until, Command::SelfTest, Mode::Ready);
    reach(&mut client, until, Command::Arm, Mode::Armed);
    client.reset_counters().expect("an answer");
    client.link_mut().foreign = 0;
    let (mut armed_rounds, mut rounds, mut worst) = (0, 0, Load::default());
    while armed_rounds < ARMED_ROUNDS {
        assert!(
            rounds < MOST_ROUNDS,
            "this computer is too busy: {armed_rounds} of {rounds} rounds armed"
        );
        client.link_mut().flood(TICKS, until);
        rounds += 1;
        let status = patient_status(&mut client, until);
        check_load(&status.load);
        worst = status.load;
        let counted = status.counters.get(Counter::Foreign);
        let sent = client.link().foreign;
        assert!(counted == sent, "round {rounds}: {counted} foreign frames counted of {sent}");
        match Mode::from_codes(status.mode, status.fault) {
            Some(Mode::Armed) => armed_rounds += 1,
            Some(Mode::Fault { cause }) => {
                let token = cause.clear_token();
                reach(&mut client, until, Command::ClearFault { token }, Mode::Boot);
                reach(&mut client, until, Command::SelfTest, Mode::Ready);
                reach(&mut client, until, Command::Arm, Mode::Armed);
            }
            _ => reach(&mut client, until, Command::Arm, Mode::Armed),
        }
    }
    let foreign = client.link().foreign;
    // A tick that begins within a count of the timer has no lateness; of a thousand some meet a task that masks
    // them.
    assert!(worst.latest_start_ns > 0, "the lateness is measured: {worst:?}");
    println!("figure P10: latest start {} ns on a full bus", worst.latest_start_ns);
    println!(
        "figure P20: {foreign} foreign frames in {} ticks, {} of them armed, of {} instructions, {} missed",
        rounds * TICKS,
        armed_rounds * TICKS,
        worst.worst_instructions,
        worst.missed_ticks
    );
}

/// Sends a request of one frame, and waits for no answer.
fn request(lab: &mut Lab, sequence: u8, request: Request) {
    let request = service::seal::<_, MAX_REQUEST>(sequence, &request).expect("it fits");
    let mut endpoint = HostEndpoint::new(Id::ServiceRequest.raw(), 0);
    endpoint.send(&request).expect("nothing is under way");
    lab.send(&endpoint.next_frame(0).expect("a single frame")).expect("sent");
    lab.flush().expect("sent");
}

/// The image in use is saved, and another one is checked and put to use, while the board runs free. They are sent
/// before: while the processor is awake, the emulated UART is slow.
#[test]
fn p10_neither_saving_an_image_nor_putting_one_to_use_delays_a_tick() {
    let mut client = Client::connect(<Lab as Rig>::boot()).expect("a board");
    client.upload_image(small_image(), |_| ControlFlow::Continue(())).expect("taken");
    let settings = Settings { force_gain: 0.5, ..Settings::default() };
    let image = &image_with(&ImageOptions { cell_m: 2e-3, settings, ..ImageOptions::default() });
    // The second one arrives as a whole, and waits.
    let stopped = client.upload_image(image, |sent| match sent == image.len() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    });
    assert!(matches!(stopped, Err(ClientError::Stopped)), "{stopped:?}");
    client.link_mut().keep_awake();
    client.link_mut().debugger.go_on();
    client.set_lock_step(false).expect("nothing is armed");
    client.reset_counters().expect("an answer");
    let figure = |client: &mut Client<Lab>, what: &str| {
        let status = client.status().expect("an answer");
        check_load(&status.load);
        println!(
            "figure P10: {what}: latest start {} ns, {} missed, at tick {}",
            status.load.latest_start_ns, status.load.missed_ticks, status.tick
        );
    };
    let until = Instant::now() + PATIENCE;
    while client.status().expect("an answer").tick == 0 {
        assert!(Instant::now() < until, "no tick");
    }
    request(client.link_mut(), 200, Request::SaveImage);
    let saved = |client: &mut Client<Lab>| client.saved().expect("an answer").expect("a flash");
    while saved(&mut client).state != SavedState::Good {
        assert!(Instant::now() < until, "it is not saved");
    }
    figure(&mut client, "an image is saved");
    // What the exchange delays is the tick behind it: the load is zeroed in it.
    request(client.link_mut(), 201, Request::Activate);
    let has_run = |status: Report| status.image_crc32 == crc32(image) && status.tick > 1;
    while !has_run(client.status().expect("an answer")) {
        assert!(Instant::now() < until, "it is not in use");
    }
    figure(&mut client, "an image is put to use");
}

/// A link that sends a sample for every tick heard, and has a second talker on its bus, which fills it.
struct Flooded {
    lab: Lab,
    sealer: Sealer,
    samples: bool,
    floods: bool,
    foreign: u32,
    ticks: u32,
}

impl Flooded {
    fn new(lab: Lab) -> Self {
        let sealer = Sealer::default();
        Self { lab, sealer, samples: false, floods: false, foreign: 0, ticks: 0 }
    }

    /// Fills the bus in so many ticks.
    fn flood(&mut self, ticks: u32, until: Instant) {
        (self.floods, self.ticks) = (true, 0);
        while self.ticks < ticks {
            self.receive(Duration::from_secs(1)).expect("the board runs");
            assert!(Instant::now() < until, "{} ticks", self.ticks);
        }
        self.floods = false;
    }

    /// What the bus brings in a tick.
    fn fill(&mut self) -> Result<(), LinkError> {
        self.ticks += 1;
        let sample = self.sealer.seal(encoder(START), Status::default());
        self.lab.send(&sample)?;
        for n in 0..if self.floods { FULL_BUS } else { 0 } {
            let id = 0x7F0 + n % 8;
            let foreign = Frame::new(id, &[n as u8; 8]).expect("a frame");
            self.lab.send(&foreign)?;
            self.foreign += 1;
        }
        self.lab.flush()
    }
}

impl Link for Flooded {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.lab.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.lab.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let frame = self.lab.receive(timeout)?;
        if self.samples && frame.is_some_and(|frame| Id::from_raw(frame.id()) == Some(Id::Haptic)) {
            self.fill()?;
        }
        Ok(frame)
    }

    fn name(&self) -> &str {
        self.lab.name()
    }
}
