//! Decodes frames into the quantities of each tick.

use cathforce_bus::master::{Collector, FrameOutcome, Master, Reading};
use cathforce_bus::{
    Accepted, Counter, Counters, Direction, Encoder, Haptic, Id, Insertion, Process, Protection,
    Rotation, Shape, Status, Tendons,
};
use cathforce_mechanics::MAX_TENDONS;
use serde::Serialize;

use crate::format::dropout::{Dropout, DropoutCause};
use crate::format::frame::BusFrame;

/// The quantities of one tick. A field that no frame of this tick carried is `None`.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct TickEstimate {
    /// Time of the tick's first frame \[ns\].
    #[serde(skip)]
    pub at_ns: u64,
    /// Ticks since the recording began.
    pub tick: u64,
    /// Last insertion sent to the device \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub insertion_m: Option<f32>,
    /// Last rotation sent to the device \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_rad: Option<f32>,
    /// Code of the mode.
    pub mode: u8,
    /// Code of the fault, 0 is none.
    pub fault: u8,
    /// The model did not resolve this tick; its forces cannot be trusted.
    pub unresolved: bool,
    /// The haptic output was limited.
    pub limited: bool,
    /// On the operator's linear axis \[N\].
    pub haptic_force_n: f32,
    /// On the operator's rotary axis \[N·m\].
    pub haptic_torque_n_m: f32,
    /// Total contact force on the vessel, vessel frame \[N\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f32; 3]>,
    /// Axial force behind the guide \[N\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_force_n: Option<f32>,
    /// Torque behind the guide \[N·m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_torque_n_m: Option<f32>,
    /// Whether a frame of this tick carried the band, even as unknown.
    #[serde(skip)]
    pub has_band: bool,
    /// Half width of the band in which nine of ten true forces lie, x, y, z \[N\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_half_width_n: Option<[f32; 3]>,
    /// The same of the force behind the guide \[N\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_force_half_width_n: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoder_age_ticks: Option<u8>,
    /// Moment on the vessel about the entry, vessel frame \[N·m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moment_n_m: Option<[f32; 3]>,
    /// The guidewire's drive, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guidewire: Option<GuidewireEstimate>,
    /// Last displacements of the tendons' drives sent to the device, in the order of the tendons \[m\].
    #[serde(skip_serializing_if = "has_no_tendon")]
    pub tendons_m: TendonReadings,
    /// Tensions of the tendons at their drives \[N\]; not on the bus, known only from a replay.
    #[serde(skip)]
    pub tendon_tensions_n: TendonReadings,
    /// Rolling hash over every output of every tick so far.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digest: Option<u32>,
    /// Largest contact force at a node \[N\]; not on the bus, known only from a replay.
    #[serde(skip)]
    pub peak_contact_force_n: Option<f32>,
    /// The node that carries it, 0 is the tip.
    #[serde(skip)]
    pub peak_node: Option<u16>,
    /// Tip, from the entry, vessel frame \[m\].
    #[serde(skip)]
    pub tip_from_entry_m: Option<[f32; 3]>,
}

impl TickEstimate {
    /// Adds the content of a frame that belongs to this tick.
    fn add(&mut self, process: Process) {
        match process {
            Process::Contact(contact) => self.force_n = Some(contact.force.map(|x| x.n())),
            Process::Tick(frame) => self.digest = Some(frame.digest),
            Process::Drive(drive) => {
                self.drive_force_n = Some(drive.force.n());
                self.drive_torque_n_m = Some(drive.torque.n_m());
                self.encoder_age_ticks = Some(drive.encoder_age_ticks);
            }
            Process::GuidewireDrive(drive) => {
                let wire = self.guidewire.get_or_insert_default();
                wire.drive_force_n = Some(drive.force.n());
                wire.drive_torque_n_m = Some(drive.torque.n_m());
                wire.encoder_age_ticks = Some(drive.encoder_age_ticks);
                wire.felt = Some(drive.felt);
            }
            Process::Band(band) => {
                self.has_band = true;
                self.force_half_width_n = band.force.map(|xyz| xyz.map(|n| n.n()));
                self.drive_force_half_width_n = band.drive_force.map(|n| n.n());
            }
            Process::Moment(total) => self.moment_n_m = Some(total.moment.map(|x| x.n_m())),
            _ => {}
        }
    }
}

/// A number for each tendon; `None` for one that is not there.
pub type TendonReadings = [Option<f32>; MAX_TENDONS];

fn has_no_tendon(readings: &TendonReadings) -> bool {
    readings.iter().all(Option::is_none)
}

/// Puts the displacements of a frame to those of the other tendons.
pub(crate) fn note_tendons(tendons_m: &mut TendonReadings, frame: &Tendons) {
    let places = tendons_m.iter_mut().skip(2 * usize::from(frame.pair));
    for (place, displacement) in places.zip(frame.displacements) {
        *place = Some(displacement.m());
    }
}

/// The quantities of the guidewire's drive in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct GuidewireEstimate {
    /// Last insertion sent to the device \[m\].
    pub insertion_m: f32,
    /// Last rotation sent to the device \[rad\].
    pub rotation_rad: f32,
    /// Axial force behind the guide \[N\].
    #[serde(rename = "drive_fx_N", skip_serializing_if = "Option::is_none")]
    pub drive_force_n: Option<f32>,
    /// Torque behind the guide \[N·m\].
    #[serde(rename = "drive_torque_N_m", skip_serializing_if = "Option::is_none")]
    pub drive_torque_n_m: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoder_age_ticks: Option<u8>,
    /// Whether the operator feels this load and not the catheter's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub felt: Option<bool>,
}

impl GuidewireEstimate {
    /// From a frame of its encoder.
    pub(crate) fn at(encoder: Encoder) -> Self {
        Self {
            insertion_m: encoder.insertion.m(),
            rotation_rad: encoder.rotation.rad(),
            ..Self::default()
        }
    }
}

/// The last position and force of one node.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct NodeEstimate {
    /// 0 is the tip.
    pub node: u8,
    /// From the entry, vessel frame \[m\].
    pub position_m: [f32; 3],
    /// Contact force on the vessel, vessel frame \[N\].
    pub force_n: [f32; 3],
}

/// One pass of the device over all nodes, from tip to guide.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NodePass {
    /// Time of the last node \[ns\].
    #[serde(skip)]
    pub at_ns: u64,
    pub nodes: Vec<NodeEstimate>,
}

/// What a frame completed.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Completed {
    pub tick: Option<TickEstimate>,
    pub nodes: Option<NodePass>,
    /// Set if the frame could not be used, or if frames before it are missing.
    pub missed: Option<Dropout>,
}

/// Collects frames into ticks. A tick begins with its HAPTIC frame.
#[derive(Debug, Default)]
pub struct Decoder {
    protection: Protection,
    counters: Counters,
    ticks: u64,
    open: Option<TickEstimate>,
    master: Collector,
    encoder: Option<Encoder>,
    guidewire: Option<Encoder>,
    tendons_m: TendonReadings,
    pass: Vec<NodeEstimate>,
    pass_at_ns: u64,
}

/// A position from the master's own frames, encoded like ours.
pub(crate) fn coded(reading: Reading) -> Encoder {
    Encoder {
        insertion: Insertion::from_m(reading.insertion_m.into()),
        rotation: Rotation::from_rad(reading.rotation_rad.into()),
    }
}

impl Decoder {
    /// A decoder for a bus on which a master may have frames of its own.
    pub fn new(master: Master) -> Self {
        Self { master: Collector::new(master), ..Self::default() }
    }

    /// Counters of the process frames so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Takes the next frame; returns what it completed.
    pub fn push(&mut self, frame: &BusFrame) -> Completed {
        self.take(frame).unwrap_or_default()
    }

    /// The tick that no further frame can complete.
    pub fn finish(&mut self) -> Option<TickEstimate> {
        self.open.take()
    }

    fn take(&mut self, frame: &BusFrame) -> Option<Completed> {
        if frame.direction == Direction::ToDevice && self.master.master().has(frame.frame.id()) {
            return self.take_foreign(frame);
        }
        let id = Id::from_raw(frame.frame.id())?;
        let service = matches!(id, Id::ServiceRequest | Id::ServiceResponse);
        if service || id.is_from_host() != (frame.direction == Direction::ToDevice) {
            return None;
        }
        let missed = |cause, frames| {
            let id = Some(frame.frame.id());
            Some(Dropout { from_ns: frame.at_ns, to_ns: frame.at_ns, cause, id, frames })
        };
        let received = self.protection.receive(id, &frame.frame, &mut self.counters);
        let Accepted { process, status, lost } = match received {
            Ok(accepted) => accepted,
            Err(rejection) => {
                let missed = missed(DropoutCause::from(rejection), 1);
                return Some(Completed { missed, ..Completed::default() });
            }
        };
        let missed = if lost > 0 { missed(DropoutCause::Lost, u32::from(lost)) } else { None };
        Some(Completed { missed, ..self.take_process(frame.at_ns, process, status) })
    }

    /// Takes the content of an accepted frame; returns what it completed.
    fn take_process(&mut self, at_ns: u64, process: Process, status: Status) -> Completed {
        match process {
            Process::Encoder(encoder) => self.encoder = Some(encoder),
            Process::Guidewire(encoder) => self.guidewire = Some(encoder),
            Process::Tendons(frame) => note_tendons(&mut self.tendons_m, &frame),
            Process::Haptic(haptic) => {
                let tick = self.next_tick(at_ns, haptic, status);
                return Completed { tick: self.open.replace(tick), ..Completed::default() };
            }
            Process::Shape(shape) if self.open.is_some() => {
                return Completed { nodes: self.take_shape(at_ns, shape), ..Completed::default() };
            }
            Process::Force(force) => {
                if let Some(node) = self.pass.last_mut().filter(|n| n.node == force.node) {
                    node.force_n = force.force.map(|x| x.n());
                }
            }
            process => {
                if let Some(tick) = &mut self.open {
                    tick.add(process);
                }
            }
        }
        Completed::default()
    }

    /// The tick that begins with this frame.
    fn next_tick(&mut self, at_ns: u64, haptic: Haptic, status: Status) -> TickEstimate {
        let tick = self.ticks;
        self.ticks += 1;
        TickEstimate {
            at_ns,
            tick,
            insertion_m: self.encoder.map(|at| at.insertion.m()),
            rotation_rad: self.encoder.map(|at| at.rotation.rad()),
            guidewire: self.guidewire.map(GuidewireEstimate::at),
            tendons_m: self.tendons_m,
            mode: haptic.mode,
            fault: haptic.fault,
            unresolved: status.unresolved,
            limited: status.limited,
            haptic_force_n: haptic.force.n(),
            haptic_torque_n_m: haptic.torque.n_m(),
            ..TickEstimate::default()
        }
    }

    /// Adds a node to the current pass; returns the pass before if this node begins another.
    fn take_shape(&mut self, at_ns: u64, shape: Shape) -> Option<NodePass> {
        let position_m = shape.position.map(|x| x.m());
        let mut completed = None;
        if shape.node == 0 {
            if let Some(tick) = &mut self.open {
                tick.tip_from_entry_m = Some(position_m);
            }
            completed = self.start_pass();
        }
        self.pass.push(NodeEstimate { node: shape.node, position_m, force_n: [0.0; 3] });
        self.pass_at_ns = at_ns;
        completed
    }

    /// Takes a frame in the master's own layout.
    fn take_foreign(&mut self, frame: &BusFrame) -> Option<Completed> {
        if let FrameOutcome::Rejected(counter) = self.master.take(&frame.frame) {
            self.counters.count(counter);
            let (at_ns, id) = (frame.at_ns, Some(frame.frame.id()));
            let cause = DropoutCause::WrongLength;
            let missed = Some(Dropout { from_ns: at_ns, to_ns: at_ns, cause, id, frames: 1 });
            return Some(Completed { missed, ..Completed::default() });
        }
        self.counters.count(Counter::Accepted);
        self.encoder = self.master.catheter().map(coded).or(self.encoder);
        self.guidewire = self.master.guidewire().map(coded).or(self.guidewire);
        None
    }

    /// Ends the current pass and returns it if it has every node from the tip on.
    fn start_pass(&mut self) -> Option<NodePass> {
        let nodes = std::mem::take(&mut self.pass);
        let whole = nodes.iter().enumerate().all(|(i, n)| usize::from(n.node) == i);
        (whole && !nodes.is_empty()).then_some(NodePass { at_ns: self.pass_at_ns, nodes })
    }
}

/// Every tick and every pass over the nodes of a list of frames.
pub fn decode(frames: &[BusFrame], master: Master) -> (Vec<TickEstimate>, Vec<NodePass>) {
    let mut decoder = Decoder::new(master);
    let (mut ticks, mut passes) = (Vec::new(), Vec::new());
    for frame in frames {
        let Completed { tick, nodes, .. } = decoder.push(frame);
        ticks.extend(tick);
        passes.extend(nodes);
    }
    ticks.extend(decoder.finish());
    (ticks, passes)
}

#[cfg(test)]
mod tests {
    use cathforce_bus::{
        Contact, Drive, DriveTorque, Force, GuidewireDrive, Haptic, HapticForce, HapticTorque,
        NodeForce, Position, Sealer, Shape, Status,
    };

    use super::*;

    fn to_host(sealer: &mut Sealer, at_ns: u64, process: Process) -> BusFrame {
        let frame = sealer.seal(process, Status { unresolved: true, ..Status::default() });
        BusFrame { at_ns, direction: Direction::ToHost, frame }
    }

    fn haptic(mode: u8) -> Process {
        Process::Haptic(Haptic { force: HapticForce(2), torque: HapticTorque(3), mode, fault: 0 })
    }

    #[test]
    fn frames_become_ticks() {
        let (mut host, mut device) = (Sealer::default(), Sealer::default());
        let encoder = Process::Encoder(Encoder {
            insertion: Insertion::from_m(0.05),
            rotation: Rotation::from_rad(-1.0),
        });
        let encoder = host.seal(encoder, Status::default());
        let frames = [
            BusFrame { at_ns: 0, direction: Direction::ToDevice, frame: encoder },
            to_host(&mut device, 1, haptic(4)),
            to_host(&mut device, 2, Process::Contact(Contact { force: [Force(10); 3] })),
            to_host(&mut device, 3, haptic(5)),
            to_host(
                &mut device,
                4,
                Process::Drive(Drive {
                    force: Force(-7),
                    torque: DriveTorque(1),
                    limits: 0,
                    encoder_age_ticks: 2,
                }),
            ),
        ];
        let (ticks, _) = decode(&frames, Master::default());
        assert_eq!(ticks.len(), 2);
        assert_eq!((ticks[0].tick, ticks[0].at_ns, ticks[0].mode), (0, 1, 4));
        assert_eq!(ticks[0].insertion_m, Some(0.05));
        assert_eq!(ticks[0].force_n, Some([Force(10).n(); 3]));
        assert_eq!(ticks[0].drive_force_n, None, "belongs to the next tick");
        assert!(ticks[0].unresolved);
        assert_eq!(ticks[1].force_n, None);
        assert_eq!(ticks[1].drive_force_n, Some(Force(-7).n()));
    }

    #[test]
    fn a_guidewire_is_told_apart_from_its_catheter() {
        let (mut host, mut device) = (Sealer::default(), Sealer::default());
        let at = |mm: f64| Encoder {
            insertion: Insertion::from_m(1e-3 * mm),
            rotation: Rotation::from_rad(0.01 * mm),
        };
        let mut to_device = |process| {
            let frame = host.seal(process, Status::default());
            BusFrame { at_ns: 0, direction: Direction::ToDevice, frame }
        };
        let load = Process::GuidewireDrive(GuidewireDrive {
            force: Force(-7),
            torque: DriveTorque(3),
            encoder_age_ticks: 2,
            felt: true,
        });
        let frames = [
            to_device(Process::Encoder(at(50.0))),
            to_host(&mut device, 1, haptic(4)),
            to_device(Process::Guidewire(at(80.0))),
            to_host(&mut device, 2, haptic(4)),
            to_host(&mut device, 3, load),
        ];
        let (ticks, _) = decode(&frames, Master::default());
        assert_eq!(ticks[0].guidewire, None);
        assert_eq!(ticks[1].insertion_m, Some(0.05));
        let expected = GuidewireEstimate {
            drive_force_n: Some(Force(-7).n()),
            drive_torque_n_m: Some(DriveTorque(3).n_m()),
            encoder_age_ticks: Some(2),
            felt: Some(true),
            ..GuidewireEstimate::at(at(80.0))
        };
        assert_eq!(ticks[1].guidewire, Some(expected));
        assert_eq!(expected.insertion_m, 0.08);
        assert_eq!(ticks[1].drive_force_n, None, "the catheter's");
    }

    #[test]
    fn a_pass_over_the_nodes_is_whole_or_not_given() {
        let mut device = Sealer::default();
        let mut frames = vec![to_host(&mut device, 0, haptic(4))];
        for node in [1, 2, 0, 1, 2, 0] {
            let position = [Position(i16::from(node)); 3];
            let shape = Process::Shape(Shape { node, position });
            let force = Process::Force(NodeForce { node, force: [Force(5); 3] });
            frames.push(to_host(&mut device, 1, shape));
            frames.push(to_host(&mut device, 1, force));
        }
        let (_, passes) = decode(&frames, Master::default());
        assert_eq!(passes.len(), 1, "the first one began in the middle");
        assert_eq!(passes[0].nodes.len(), 3);
        assert_eq!(passes[0].nodes[2].position_m, [Position(2).m(); 3]);
        assert_eq!(passes[0].nodes[2].force_n, [Force(5).n(); 3]);
    }

    #[test]
    fn damaged_and_misdirected_frames_are_not_used() {
        let mut device = Sealer::default();
        let good = to_host(&mut device, 0, haptic(4));
        let mut wrong_way = good;
        wrong_way.direction = Direction::ToDevice;
        let mut bytes = good.frame.data().to_vec();
        bytes[0] ^= 1;
        let frame = cathforce_bus::Frame::new(good.frame.id(), &bytes).unwrap();
        let (ticks, _) = decode(&[wrong_way, BusFrame { frame, ..good }], Master::default());
        assert!(ticks.is_empty());
    }
}
