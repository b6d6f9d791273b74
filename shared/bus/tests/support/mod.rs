//! Intended values of every process frame by name, for comparison with other parsers.

use cathforce_bus::{BandWidth, Command, Id, MAX_ID, Process};

/// Every identifier that the DBC describes.
pub fn process_ids() -> impl Iterator<Item = Id> {
    let service = |id: &Id| matches!(id, Id::ServiceRequest | Id::ServiceResponse);
    (0..=MAX_ID).filter_map(Id::from_raw).filter(move |id| !service(id))
}

/// Intended values of a frame by name.
pub fn meant(process: &Process) -> Vec<(&'static str, f64)> {
    let xyz = |[x, y, z]: [f32; 3]| vec![("X", x.into()), ("Y", y.into()), ("Z", z.into())];
    match *process {
        Process::Sync(p) => vec![("Grant", p.grant.into()), ("HostTick", p.host_tick.into())],
        Process::Encoder(p) | Process::Guidewire(p) => {
            vec![("Insertion", p.insertion.m().into()), ("Rotation", p.rotation.rad().into())]
        }
        Process::Tendons(p) => {
            let [first, second] = p.displacements.map(|x| x.m().into());
            vec![("First", first), ("Second", second)]
        }
        Process::Command(p) => {
            let (code, token) = match p {
                Command::SelfTest => (1, 0),
                Command::Arm => (2, 0),
                Command::Disarm => (3, 0),
                Command::ClearFault { token } => (4, token),
            };
            vec![("Code", code.into()), ("Token", token.into())]
        }
        Process::Haptic(p) => vec![
            ("Force", p.force.n().into()),
            ("Torque", p.torque.n_m().into()),
            ("Mode", p.mode.into()),
            ("Fault", p.fault.into()),
        ],
        Process::Contact(p) => xyz(p.force.map(|f| f.n())),
        Process::Tick(p) => vec![("Tick", p.tick.into()), ("Digest", p.digest.into())],
        Process::Drive(p) => vec![
            ("Force", p.force.n().into()),
            ("Torque", p.torque.n_m().into()),
            ("Limits", p.limits.into()),
            ("EncoderAge", p.encoder_age_ticks.into()),
        ],
        Process::GuidewireDrive(p) => vec![
            ("Force", p.force.n().into()),
            ("Torque", p.torque.n_m().into()),
            ("EncoderAge", p.encoder_age_ticks.into()),
            ("Felt", u8::from(p.felt).into()),
        ],
        Process::Moment(p) => xyz(p.moment.map(|m| m.n_m())),
        Process::Band(p) => {
            // What is not known is the highest code.
            let unknown = 4095.0 * f64::from(BandWidth::UNIT_N);
            let [x, y, z] = p.force.map_or([unknown; 3], |xyz| xyz.map(|n| n.n().into()));
            let drive = p.drive_force.map_or(unknown, |n| n.n().into());
            vec![("X", x), ("Y", y), ("Z", z), ("Drive", drive)]
        }
        Process::Heartbeat(p) => vec![
            ("Mode", p.mode.into()),
            ("Fault", p.fault.into()),
            ("Resets", p.resets.into()),
            ("MissedTicks", p.missed_ticks.into()),
            ("RejectedFrames", p.rejected_frames.into()),
        ],
        Process::Shape(p) => xyz(p.position.map(|x| x.m())),
        Process::Force(p) => xyz(p.force.map(|f| f.n())),
    }
}
