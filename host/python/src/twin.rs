//! One catheter: a rig and a state, in `f32` or in `f64`.

use std::sync::Arc;

use cathforce_control::{Command, Fault, HalfWidths, Inputs, Mode};
use cathforce_mechanics::{self as mechanics, MAX_LINKS, MAX_TENDONS, Outputs, Real};

use crate::rig::{Double, Single};
use crate::row::{Layout, Row};

/// Ticks within which a device must settle. No setting allows that many, so that it is the device that gives
/// up, with its fault.
const SETTLE_TICKS: usize = 70_000;

/// A rig in one of the two precisions.
#[derive(Clone)]
pub enum Rig {
    /// The tick of the device.
    Single(Arc<Single>),
    /// The model alone, for studies.
    Double(Arc<Double>),
}

/// A state in the precision of its rig.
#[derive(Clone)]
pub enum State {
    Single(Box<cathforce_control::State>),
    Double(Box<mechanics::State<f64, MAX_LINKS>>),
}

/// A catheter.
#[derive(Clone)]
pub struct Twin {
    pub rig: Rig,
    pub state: State,
    /// The drives' last positions.
    pub at: Row,
    /// It came to rest, so that from here on it follows the drives.
    follows: bool,
}

/// What a tick computed. Single precision is widened, which loses no bit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    pub contact: Outputs<f64>,
    pub tip_m: Option<[f64; 3]>,
    /// What only the device's tick has.
    pub device: Option<Device>,
}

#[derive(Clone, Copy, Debug)]
pub struct Device {
    pub mode: Mode,
    pub fault: Option<Fault>,
    /// The tick refused the position of a drive.
    pub refused: bool,
    pub limited: u8,
    pub haptic_force_n: f32,
    pub haptic_torque_n_m: f32,
    pub band: HalfWidths,
    pub digest: u32,
}

/// One node of the instrument.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    pub position_m: [f64; 3],
    /// Contact force on the vessel around it \[N\].
    pub force_n: [f64; 3],
}

impl Rig {
    pub fn layout(&self) -> Layout {
        fn of<T>(description: &mechanics::Description<T>) -> Layout {
            Layout {
                has_guidewire: description.guidewire.is_some(),
                tendons: description.tendons.len(),
            }
        }
        match self {
            Self::Single(rig) => of(rig.config().model.description()),
            Self::Double(rig) => of(rig.config().model.description()),
        }
    }

    /// The longest insertion that the links reach \[m\].
    pub fn reach_m(&self) -> f64 {
        match self {
            Self::Single(rig) => f64::from(rig.config().model.reach_m()),
            Self::Double(rig) => rig.config().model.reach_m(),
        }
    }

    /// Value of a setting of the device; `None` in double precision, or of another name.
    pub fn setting(&self, name: &str) -> Option<f32> {
        match self {
            Self::Single(rig) => rig.config().settings.get(name),
            Self::Double(_) => None,
        }
    }

    pub fn is_double(&self) -> bool {
        matches!(self, Self::Double(_))
    }

    /// The same rig with other parameters. `Err` names the one that is refused.
    pub fn with_parameters(&self, parameters: &[(String, f64)]) -> Result<Self, String> {
        fn set<T: Real>(
            description: &mechanics::Description<T>,
            parameters: &[(String, f64)],
        ) -> Result<mechanics::Description<T>, String> {
            let mut description = description.clone();
            for (key, value) in parameters {
                let refused = |error| format!("{key} = {value}: {error}");
                description.set_parameter(key, T::lit(*value)).map_err(refused)?;
            }
            Ok(description)
        }
        Ok(match self {
            Self::Single(rig) => {
                let description = set(rig.config().model.description(), parameters)?;
                Self::Single(Arc::new(rig.with_description(description)?))
            }
            Self::Double(rig) => {
                let description = set(rig.config().model.description(), parameters)?;
                Self::Double(Arc::new(rig.with_description(description)?))
            }
        })
    }

    pub fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Single(a), Self::Single(b)) => Arc::ptr_eq(a, b),
            (Self::Double(a), Self::Double(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl Outcome {
    /// `moved`: the encoders were not silent.
    pub fn of_device(
        found: &cathforce_control::Outputs,
        tip_m: Option<[f32; 3]>,
        moved: bool,
    ) -> Self {
        let ages = [found.encoder_age_ticks, found.guidewire_age_ticks];
        Self {
            contact: widened(&found.contact),
            tip_m: tip_m.map(|tip| tip.map(f64::from)),
            device: Some(Device {
                mode: found.mode,
                fault: found.fault,
                refused: moved && ages != [0; 2],
                limited: found.limited.bits(),
                haptic_force_n: found.force_n,
                haptic_torque_n_m: found.torque_n_m,
                band: found.band,
                digest: found.digest,
            }),
        }
    }
}

impl Twin {
    /// In the state directly after configuration.
    pub fn new(rig: Rig) -> Self {
        let state = match rig {
            Rig::Single(_) => State::Single(Box::default()),
            Rig::Double(_) => State::Double(Box::default()),
        };
        Self { rig, state, at: Row::default(), follows: false }
    }

    /// Back to the state directly after configuration.
    pub fn clear(&mut self) {
        match &mut self.state {
            State::Single(state) => state.reset(),
            State::Double(state) => state.reset(),
        }
        self.at = Row::default();
        self.follows = false;
    }

    /// Puts the instrument to where the drives are and lets it come to rest there. The device is then ready, or
    /// with `armed` its output is on. `Err`: why it is not.
    pub fn reset(&mut self, at: Row, armed: bool) -> Result<(), String> {
        self.clear();
        self.at = at;
        if let (Rig::Double(rig), State::Double(state)) = (&self.rig, &mut self.state) {
            let config = rig.config();
            while !mechanics::settle(&config.model, &config.lumen, state, at.drives()) {}
            self.follows = true;
            return Ok(());
        }
        let wanted = |mode| match armed {
            true => mode == Mode::Armed,
            false => mode == Mode::Ready,
        };
        let mut command = Some(Command::SelfTest);
        for _ in 0..SETTLE_TICKS {
            let Some(device) = self.tick(Some(&at), command).device else { return Ok(()) };
            if let Some(fault) = device.fault {
                return Err(fault.text().to_owned());
            }
            if wanted(device.mode) {
                self.follows = true;
                return Ok(());
            }
            command = (device.mode == Mode::Ready).then_some(Command::Arm);
        }
        Err("the instrument does not come to rest there".into())
    }

    /// One tick. `None` for `row`: the encoders are silent, or, in double precision, the drives rest.
    pub fn tick(&mut self, row: Option<&Row>, command: Option<Command>) -> Outcome {
        if let Some(row) = row {
            self.at = *row;
        }
        match (&self.rig, &mut self.state) {
            (Rig::Single(rig), State::Single(state)) => {
                let layout = self.rig.layout();
                let inputs = row.map_or_else(Inputs::default, |row| row.inputs(layout));
                let inputs = Inputs { command, ..inputs };
                let found = cathforce_control::step(rig.config(), state, &inputs);
                let tip_m = state.mechanics().node_position_m(0);
                Outcome::of_device(&found, tip_m, row.is_some())
            }
            (Rig::Double(rig), State::Double(state)) => {
                let config = rig.config();
                let contact =
                    mechanics::step(&config.model, &config.lumen, state, self.at.drives());
                Outcome { contact, tip_m: state.node_position_m(0), device: None }
            }
            // Both are made together, and `restore` keeps them so.
            _ => Outcome::default(),
        }
    }

    /// The device followed the drives and does so no longer: its forces are zero because it computes none.
    pub fn has_lost_the_drives(&self, outcome: &Outcome) -> bool {
        let idle = |device: Device| matches!(device.mode, Mode::Boot | Mode::Idle | Mode::Settling);
        self.follows && outcome.device.is_some_and(idle)
    }

    /// Every node inside the vessel, from the tip on.
    pub fn nodes(&self) -> Vec<Node> {
        fn of<T: Real>(state: &mechanics::State<T, MAX_LINKS>) -> Vec<Node> {
            let wide = |v: [T; 3]| v.map(|x| x.to_f64());
            let node = |j| {
                let position_m = wide(state.node_position_m(j)?);
                Some(Node { position_m, force_n: wide(state.node_force_n(j)?) })
            };
            (0..).map_while(node).collect()
        }
        match &self.state {
            State::Single(state) => of(state.mechanics()),
            State::Double(state) => of(state),
        }
    }

    /// Tensions of the driven tendons \[N\]: at the drive and at the anchor.
    pub fn tensions_n(&self) -> Vec<[f64; 2]> {
        let of = |k| match &self.state {
            State::Single(state) => {
                state.mechanics().tendon_tensions_n(k).map(|both| both.map(f64::from))
            }
            State::Double(state) => state.tendon_tensions_n(k),
        };
        (0..self.rig.layout().tendons.min(MAX_TENDONS)).filter_map(of).collect()
    }
}

fn widened(found: &Outputs<f32>) -> Outputs<f64> {
    let vector = |v: [f32; 3]| v.map(f64::from);
    Outputs {
        force_on_vessel_n: vector(found.force_on_vessel_n),
        moment_on_vessel_n_m: vector(found.moment_on_vessel_n_m),
        drive_force_n: f64::from(found.drive_force_n),
        drive_torque_n_m: f64::from(found.drive_torque_n_m),
        guidewire_force_n: f64::from(found.guidewire_force_n),
        guidewire_torque_n_m: f64::from(found.guidewire_torque_n_m),
        peak_contact_force_n: f64::from(found.peak_contact_force_n),
        peak_node: found.peak_node,
        links: found.links,
        unresolved: found.unresolved,
        lost: found.lost,
    }
}
