//! Decoded quantities as messages for other tools.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use cathforce_control::Mode;
use mcap::McapError;

use super::tick::{NodePass, TickEstimate};
use crate::format::layout;
use crate::format::messages::{
    CanFrame, DropoutMessage, ENTRY, Header, Joints, MeasuredRow, Message, OPERATOR,
    OperatingState, PointCloud2, Status, TfMessage, VESSEL, WrenchStamped, to_cdr,
};
use crate::format::trial::Measured;

/// Numbers of the channels in the file.
pub(crate) struct Channels {
    pub to_device: u16,
    pub to_host: u16,
    pub dropouts: u16,
    pub transforms: u16,
    measured: u16,
    status: u16,
    drive: u16,
    drive_load: u16,
    force: u16,
    shape: u16,
    state: u16,
    wire: u16,
    wire_load: u16,
    tendons: u16,
    operator: u16,
    sensor: u16,
}

impl Channels {
    /// Adds every channel by `add`, which gets the topic, the type of its messages and the schema of that
    /// type, and gives the channel's number.
    pub(crate) fn add<E>(
        mut add: impl FnMut(&'static str, &'static str, String) -> Result<u16, E>,
    ) -> Result<Self, E> {
        let mut add_of = |topic, (name, schema)| add(topic, name, schema);
        Ok(Self {
            to_device: add_of(layout::TO_DEVICE, kind::<CanFrame>())?,
            to_host: add_of(layout::TO_HOST, kind::<CanFrame>())?,
            dropouts: add_of(layout::DROPOUTS, kind::<DropoutMessage>())?,
            transforms: add_of(layout::TRANSFORMS, kind::<TfMessage>())?,
            measured: add_of(layout::MEASURED, kind::<MeasuredRow>())?,
            status: add_of(layout::STATUS, kind::<Status>())?,
            drive: add_of(layout::DRIVE, kind::<Joints<'_>>())?,
            drive_load: add_of(layout::DRIVE_LOAD, kind::<Joints<'_>>())?,
            force: add_of(layout::FORCE, kind::<WrenchStamped>())?,
            shape: add_of(layout::SHAPE, kind::<PointCloud2>())?,
            state: add_of(layout::STATE, kind::<OperatingState>())?,
            wire: add_of(layout::WIRE, kind::<Joints<'_>>())?,
            wire_load: add_of(layout::WIRE_LOAD, kind::<Joints<'_>>())?,
            tendons: add_of(layout::TENDONS, kind::<Joints<'_>>())?,
            operator: add_of(layout::OPERATOR, kind::<WrenchStamped>())?,
            sensor: add_of(layout::SENSOR, kind::<WrenchStamped>())?,
        })
    }

    /// Adds every channel to a file.
    pub(crate) fn add_to<W: Write + Seek>(writer: &mut mcap::Writer<W>) -> Result<Self, McapError> {
        Self::add(|topic, name, schema| {
            let schema = writer.add_schema(name, layout::SCHEMA_ENCODING, schema.as_bytes())?;
            writer.add_channel(schema, topic, layout::MESSAGE_ENCODING, &BTreeMap::new())
        })
    }
}

/// Name and schema of a type of messages.
fn kind<M: Message>() -> (&'static str, String) {
    (M::NAME, M::schema())
}

/// Channel, time \[ns\] and bytes of each message.
pub(crate) type Published = Result<Vec<(u16, u64, Vec<u8>)>, cdr_encoding::Error>;

/// Turns decoded quantities into messages.
#[derive(Default)]
pub(crate) struct Publisher {
    /// The last moment. It arrives in one of several ticks and is published with every force.
    moment_n_m: [f32; 3],
    mode: Option<u8>,
}

impl Publisher {
    /// The next tick says its mode, changed or not.
    pub(crate) fn say_mode_again(&mut self) {
        self.mode = None;
    }

    /// Remembers of a tick that is not published what later ones need.
    pub(crate) fn pass_over(&mut self, tick: &TickEstimate) {
        self.moment_n_m = tick.moment_n_m.unwrap_or(self.moment_n_m);
    }

    pub(crate) fn tick(&mut self, tick: &TickEstimate, to: &Channels) -> Published {
        let at_ns = tick.at_ns;
        let mut out = Vec::new();
        let header = |frame| Header::new(at_ns, frame);
        let mut put = |channel, bytes| out.push((channel, at_ns, bytes));
        let status = Status {
            header: header(""),
            tick: tick.tick,
            mode: tick.mode,
            fault: tick.fault,
            unresolved: tick.unresolved,
            limited: tick.limited,
        };
        put(to.status, to_cdr(&status)?);
        if self.mode.replace(tick.mode) != Some(tick.mode) {
            put(to.state, to_cdr(&operating_state(header(""), tick))?);
        }
        let x = |x: f32| [f64::from(x), 0.0, 0.0];
        let (force, torque) = (x(tick.haptic_force_n), x(tick.haptic_torque_n_m));
        put(to.operator, to_cdr(&WrenchStamped { header: header(OPERATOR), force, torque })?);
        if let Some((insertion_m, rotation_rad)) = tick.insertion_m.zip(tick.rotation_rad) {
            let at = [insertion_m, rotation_rad].map(f64::from);
            put(to.drive, to_cdr(&Joints::new(header(""), &at, &[]))?);
            if let Some((force_n, torque_n_m)) = tick.drive_force_n.zip(tick.drive_torque_n_m) {
                let load = [force_n, torque_n_m].map(f64::from);
                put(to.drive_load, to_cdr(&Joints::new(header(""), &at, &load))?);
            }
        }
        if let Some(wire) = tick.guidewire {
            let at = [wire.insertion_m, wire.rotation_rad].map(f64::from);
            put(to.wire, to_cdr(&Joints::new(header(""), &at, &[]))?);
            if let Some((force_n, torque_n_m)) = wire.drive_force_n.zip(wire.drive_torque_n_m) {
                let load = [force_n, torque_n_m].map(f64::from);
                put(to.wire_load, to_cdr(&Joints::new(header(""), &at, &load))?);
            }
        }
        let tendons_m: Vec<f64> = tick.tendons_m.iter().flatten().copied().map(f64::from).collect();
        if !tendons_m.is_empty() {
            put(to.tendons, to_cdr(&Joints::tendons(header(""), &tendons_m))?);
        }
        self.moment_n_m = tick.moment_n_m.unwrap_or(self.moment_n_m);
        if let Some(force_n) = tick.force_n {
            let [force, torque] = [force_n, self.moment_n_m].map(|v| v.map(f64::from));
            put(to.force, to_cdr(&WrenchStamped { header: header(ENTRY), force, torque })?);
        }
        Ok(out)
    }

    pub(crate) fn shape(&self, pass: &NodePass, to: &Channels) -> Published {
        let points = pass.nodes.iter().map(|node| {
            let ([x, y, z], [fx, fy, fz]) = (node.position_m, node.force_n);
            let size = f64::from(fx).hypot(f64::from(fy)).hypot(f64::from(fz));
            [x, y, z, size as f32, fx, fy, fz]
        });
        let cloud = PointCloud2::new(Header::new(pass.at_ns, ENTRY), points);
        Ok(vec![(to.shape, pass.at_ns, to_cdr(&cloud)?)])
    }

    pub(crate) fn measured(
        &self,
        at_ns: u64,
        row: &Measured,
        shape_m: &[[f64; 3]],
        to: &Channels,
    ) -> Published {
        let header = |frame| Header::new(at_ns, frame);
        let wire = row.guidewire;
        let message = MeasuredRow {
            header: header(""),
            t_s: row.t_s,
            insertion_m: row.insertion_m,
            rotation_rad: row.rotation_rad,
            force_n: row.force_n.into_iter().flatten().collect(),
            drive_force_n: row.drive_force_n.into_iter().collect(),
            tip_m: row.tip_m.into_iter().flatten().collect(),
            shape_m: shape_m.iter().flatten().copied().collect(),
            guidewire: wire.into_iter().flat_map(|w| [w.insertion_m, w.rotation_rad]).collect(),
            guidewire_force_n: wire.and_then(|wire| wire.drive_force_n).into_iter().collect(),
            tendons_m: row.tendons_m.into_iter().flatten().collect(),
        };
        let mut out = vec![(to.measured, at_ns, to_cdr(&message)?)];
        if let Some(force) = row.force_n {
            let wrench = WrenchStamped { header: header(VESSEL), force, torque: [0.0; 3] };
            out.push((to.sensor, at_ns, to_cdr(&wrench)?));
        }
        Ok(out)
    }
}

fn operating_state(header: Header, tick: &TickEstimate) -> OperatingState {
    let mode = Mode::from_codes(tick.mode, tick.fault);
    let (state, is_homed, is_busy) = match mode {
        Some(Mode::Armed) => ("ENABLED", true, false),
        Some(Mode::Ramp { .. }) => ("PAUSED", true, true),
        Some(Mode::Fault { .. }) => ("FAULT", false, false),
        Some(Mode::Ready) => ("DISABLED", true, false),
        Some(Mode::Settling) => ("DISABLED", false, true),
        Some(Mode::Boot | Mode::Idle) | None => ("DISABLED", false, false),
    };
    OperatingState { header, state, is_homed, is_busy }
}
