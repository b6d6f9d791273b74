//! Every command and every request in every state: its effect, and that it has no other.

mod support;

use cathforce_bus::service::{
    self, HostEndpoint, Load, MAX_REQUEST, Refusal, Request, Response, Status, crc32,
};
use cathforce_bus::{
    Command, Counters, Encoder, Frame, Id, Insertion, NextCounters, Process, Rotation, Sealer,
};
use cathforce_config::image;
use cathforce_control::{Config, Fault};
use cathforce_device::{Board, ControlLoop, Identity, Image, Service, copy_from};

const START_M: f64 = 0.012;
/// Fed while it is tried: the drag at the entry gives an output that has a way to zero \[m\].
const FEED_M: f64 = 2e-5;
const CAPACITY: usize = 70_000;

/// A board around the control loop; its configuration lives as long as the test.
#[derive(Clone)]
struct FakeBoard {
    control_loop: ControlLoop,
    config: Option<&'static Config<'static>>,
    image: Vec<u8>,
}

impl Board<Vec<u8>> for FakeBoard {
    fn is_armed(&mut self) -> bool {
        !self.control_loop.may_reconfigure()
    }
    fn status(&mut self) -> Status {
        self.control_loop.report(Load::default())
    }
    fn next_counters(&mut self) -> NextCounters {
        self.control_loop.next_counters()
    }
    fn activate(
        &mut self,
        image: Image<Vec<u8>>,
    ) -> Result<Option<Vec<u8>>, (Vec<u8>, Refusal<'static>)> {
        self.image = image.bytes().to_vec();
        let bytes: &'static [u8] = Box::leak(self.image.clone().into());
        self.config = Some(Box::leak(Box::new(image::decode(bytes).unwrap())));
        self.control_loop.restart(Default::default());
        Ok(Some(image.into_parts().0))
    }
    fn set_lock_step(&mut self, on: bool) -> Result<(), Refusal<'static>> {
        self.control_loop.set_lock_step(on).then_some(()).ok_or(Refusal::Armed)
    }
    fn reset_counters(&mut self) {
        self.control_loop.reset_counters();
    }
    fn read_image(&mut self, offset: usize, into: &mut [u8]) -> Option<usize> {
        self.config?;
        Some(copy_from(&self.image, offset, into))
    }
}

/// A device and its host.
struct Device {
    board: FakeBoard,
    service: Service<Vec<u8>>,
    insertion_m: f64,
    sealer: Sealer,
    sequence: u8,
}

/// The states in which commands differ. Ramps and faults are caused by missing encoder frames.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Unconfigured,
    Boot,
    Idle,
    Settling,
    Ready,
    Armed,
    RampToReady,
    RampToFault,
    Fault,
}

impl State {
    const ALL: [Self; 9] = [
        Self::Unconfigured,
        Self::Boot,
        Self::Idle,
        Self::Settling,
        Self::Ready,
        Self::Armed,
        Self::RampToReady,
        Self::RampToFault,
        Self::Fault,
    ];

    /// Output is on, so nothing may change (P17).
    fn is_live(self) -> bool {
        matches!(self, Self::Armed | Self::RampToReady | Self::RampToFault)
    }

    /// Where a command leads within two ticks, if it does anything.
    fn after(self, command: Command) -> Option<State> {
        let token = Fault::EncoderLost.clear_token();
        match (self, command) {
            (Self::Boot, Command::SelfTest) => Some(Self::Settling),
            (Self::Ready, Command::Arm) => Some(Self::Armed),
            (Self::Armed, Command::Disarm) => Some(Self::RampToReady),
            (Self::Fault, Command::ClearFault { token: given }) if given == token => {
                Some(Self::Boot)
            }
            _ => None,
        }
    }
}

impl Device {
    /// A device that was brought to a state by commands and frames.
    fn in_state(state: State) -> Self {
        let identity = Identity {
            firmware: "1.2.3",
            board: "fake",
            can_lock_step: true,
            max_image_len: CAPACITY as u32,
        };
        let board = FakeBoard { control_loop: ControlLoop::new(), config: None, image: Vec::new() };
        let service = Service::new(identity, vec![0; CAPACITY]);
        let mut device =
            Self { board, service, insertion_m: START_M, sealer: Sealer::default(), sequence: 0 };
        device.tick(true, None);
        if state != State::Unconfigured {
            let image = support::image_with_drag();
            device.begin(&image);
            assert_eq!(device.upload(&image), Ok(()));
            device.sealer = Sealer::default();
            device.tick(true, None);
        }
        let way: &[(Option<Command>, bool)] = match state {
            State::Unconfigured | State::Boot => &[],
            State::Idle => &[(Some(Command::SelfTest), false)],
            State::Settling | State::Ready => &[(Some(Command::SelfTest), true)],
            _ => &[(Some(Command::SelfTest), true), (Some(Command::Arm), true)],
        };
        for &(command, encoder) in way {
            if command == Some(Command::Arm) {
                device.ticks_until(true, State::Ready);
            }
            device.tick(encoder, command);
        }
        if device.state() == State::Armed {
            // Until there is a force that has a way to zero.
            (0..50).for_each(|_| device.tick(true, None));
        }
        match state {
            State::Settling | State::Ready => device.ticks_until(true, state),
            State::RampToReady => device.tick(true, Some(Command::Disarm)),
            State::RampToFault | State::Fault => device.ticks_until(false, state),
            _ => {}
        }
        assert_eq!(device.state(), state);
        device
    }

    fn state(&self) -> State {
        let mode = self.board.control_loop.mode_code();
        let fault = self.board.control_loop.report(Load::default()).fault;
        match (mode, fault) {
            (0, _) => State::Boot,
            (1, _) => State::Idle,
            (2, _) => State::Settling,
            (3, _) => State::Ready,
            (4, _) => State::Armed,
            (5, 0) => State::RampToReady,
            (5, _) => State::RampToFault,
            (6, _) => State::Fault,
            _ => State::Unconfigured,
        }
    }

    fn tick(&mut self, encoder: bool, command: Option<Command>) {
        let at = Encoder {
            insertion: Insertion::from_m(self.insertion_m),
            rotation: Rotation::from_rad(0.1),
        };
        self.insertion_m += FEED_M;
        let encoder = encoder.then_some(Process::Encoder(at));
        for process in encoder.into_iter().chain(command.map(Process::Command)) {
            self.board.control_loop.on_frame(&self.sealer.seal(process, Default::default()));
        }
        self.board.control_loop.tick(self.board.config, None);
    }

    fn ticks_until(&mut self, encoder: bool, state: State) {
        for _ in 0..10_000 {
            if self.state() == state {
                return;
            }
            self.tick(encoder, None);
        }
        panic!("never {state:?}, but {:?}", self.state());
    }

    /// The answer's refusal, if it is one.
    fn ask(&mut self, request: Request) -> Result<(), String> {
        self.sequence = self.sequence.wrapping_add(1);
        let bytes = service::seal::<_, MAX_REQUEST>(self.sequence, &request).unwrap();
        let mut host = HostEndpoint::new(Id::ServiceRequest.raw(), 0);
        host.send(&bytes).unwrap();
        loop {
            while let Some(frame) = host.next_frame(0) {
                self.service.on_frame(&frame, &mut self.board);
            }
            let frame: Frame = self.service.next_frame(0).expect("an answer");
            let Some(message) = host.receive(&frame, &mut Counters::default()) else { continue };
            return match service::open::<Response>(message).unwrap().1 {
                Response::Refused(refusal) => Err(format!("{refusal:?}")),
                _ => Ok(()),
            };
        }
    }

    fn begin(&mut self, image: &[u8]) {
        let begin = Request::BeginImage { len: image.len() as u32, crc32: crc32(image) };
        assert_eq!(self.ask(begin), Ok(()));
    }

    /// Sends the image that [`Device::begin`] has announced, and activates it.
    fn upload(&mut self, image: &[u8]) -> Result<(), String> {
        for (i, bytes) in image.chunks(service::MAX_CHUNK).enumerate() {
            let offset = (i * service::MAX_CHUNK) as u32;
            self.ask(Request::ImageChunk { offset, bytes })?;
        }
        self.ask(Request::Activate)
    }

    /// Hash of everything that determines the next ticks.
    fn digest_after_ticks(&self) -> u32 {
        let mut control_loop = self.board.control_loop.clone();
        for _ in 0..20 {
            control_loop.tick(self.board.config, None);
        }
        control_loop.report(Load::default()).digest
    }
}

/// A command that is not allowed in a state changes no bit of any output.
#[test]
fn p17_p18_every_command_in_every_state_does_what_the_table_says_and_nothing_else() {
    let right = Fault::EncoderLost.clear_token();
    let commands = [
        Command::SelfTest,
        Command::Arm,
        Command::Disarm,
        Command::ClearFault { token: right },
        Command::ClearFault { token: right ^ 1 },
    ];
    for state in State::ALL {
        for command in commands {
            let (mut asked, mut spared) = (Device::in_state(state), Device::in_state(state));
            // Before the encoders are heard there is no way past Idle.
            let encoder = !matches!(state, State::Idle | State::RampToFault | State::Fault);
            asked.tick(encoder, Some(command));
            spared.tick(encoder, None);
            match state.after(command) {
                None => {
                    assert_eq!(asked.state(), spared.state(), "{command:?} in {state:?}");
                    let after = [&asked, &spared].map(Device::digest_after_ticks);
                    assert_eq!(after[0], after[1], "{command:?} in {state:?} changed a bit");
                }
                Some(wanted) => {
                    if asked.state() != wanted {
                        asked.tick(encoder, None);
                    }
                    assert_eq!(asked.state(), wanted, "{command:?} in {state:?}");
                }
            }
        }
    }
}

/// While output is on, requests that would change something are refused, and questions are answered.
#[test]
fn p17_every_request_in_every_state_changes_nothing_while_output_is_on() {
    let image = support::image_with_drag();
    let requests = [
        (Request::Hello, false),
        (Request::GetStatus, false),
        (Request::ReadImage { offset: 0 }, false),
        (Request::ResetCounters, false),
        (Request::BeginImage { len: 4, crc32: 0 }, true),
        (Request::ImageChunk { offset: 0, bytes: &[1, 2, 3, 4] }, true),
        (Request::Activate, true),
        (Request::SetLockStep { on: true }, true),
        (Request::SetLockStep { on: false }, true),
    ];
    for state in State::ALL {
        for (request, changes) in requests {
            let (mut asked, spared) = (Device::in_state(state), Device::in_state(state));
            let answer = asked.ask(request);
            let is_refused = answer == Err("Armed".into());
            assert_eq!(is_refused, changes && state.is_live(), "{request:?} in {state:?}");
            assert_eq!(asked.state(), state, "{request:?}");
            if state.is_live() {
                assert!(!asked.board.control_loop.lock_step());
                let after = [&asked, &spared].map(Device::digest_after_ticks);
                assert_eq!(after[0], after[1], "{request:?} in {state:?} changed a bit");
            }
        }
        // What was begun while disarmed does not come to use while armed, nor half of it.
        if state != State::Ready {
            continue;
        }
        let mut device = Device::in_state(state);
        device.begin(&image);
        device.tick(true, Some(Command::Arm));
        assert_eq!(device.state(), State::Armed);
        assert_eq!(device.upload(&image), Err("Armed".into()));
        device.tick(true, Some(Command::Disarm));
        device.ticks_until(true, State::Ready);
        assert_eq!(device.upload(&image), Ok(()), "the upload goes on once it is disarmed");
        assert_eq!(device.board.control_loop.ticks(), 0);
    }
}
