//! Arguments of `cathforce link`, `doctor` and `fault`.

use cathforce_bus::Placement;
use cathforce_control::Fault;
use cathforce_link::ADDRESSES;
use cathforce_link::interface::{BIT_RATE, QUEUE_FRAMES, RESTART_MS, Setup};
use clap::{Args, Subcommand};

#[derive(Debug, Args)]
pub struct LinkArguments {
    #[command(subcommand)]
    pub action: LinkAction,
}

#[derive(Debug, Subcommand)]
pub enum LinkAction {
    /// List the CAN interfaces and serial ports of this computer with their addresses for --link.
    List,
    /// Set a CAN interface and bring it up; a missing interface named vcan… is created.
    Up(LinkUpArguments),
    /// Take a CAN interface down.
    Down(LinkDownArguments),
    /// Be a device on this link, in this process, to try the other commands or a master without a
    /// board.
    Serve(LinkServeArguments),
    /// Carry the frames of two links to each other, for example to lend the CAN adapter of this computer to
    /// another one.
    Bridge(LinkBridgeArguments),
}

#[derive(Debug, Args)]
pub struct LinkUpArguments {
    /// Name of the interface, for example can0.
    pub interface: String,
    /// Bit rate in bits per second.
    #[arg(long, default_value_t = BIT_RATE, value_parser = clap::value_parser!(u32).range(10_000..=1_000_000))]
    bit_rate: u32,
    /// Number of frames that may wait to be sent.
    #[arg(long, default_value_t = QUEUE_FRAMES, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    queue: u32,
    /// Restart a controller this many milliseconds after it went bus-off; 0 never restarts it.
    #[arg(long, default_value_t = RESTART_MS)]
    restart_ms: u32,
}

impl LinkUpArguments {
    pub fn setup(&self) -> Setup {
        let Self { bit_rate, queue, restart_ms, .. } = *self;
        Setup { bit_rate, queue_frames: queue, restart_ms }
    }
}

#[derive(Debug, Args)]
pub struct LinkDownArguments {
    /// Name of the interface, for example can0.
    pub interface: String,
}

#[derive(Debug, Args)]
pub struct LinkServeArguments {
    /// The bus: slcan:listen:PORT is one that several programs on this computer can join with
    /// slcan:tcp:127.0.0.1:PORT; socketcan:vcan0 is Linux' own.
    #[arg(value_parser = address)]
    pub link: String,
    /// Start with a clock that stands still until the host grants ticks.
    #[arg(long)]
    pub lock_step: bool,
}

#[derive(Debug, Args)]
pub struct LinkBridgeArguments {
    /// One bus, for example socketcan:can0.
    #[arg(value_parser = address)]
    pub first: String,
    /// The other one, for example slcan:listen:0.0.0.0:5555, which others join with slcan:tcp:HOST:5555.
    #[arg(value_parser = address)]
    pub second: String,
}

#[derive(Debug, Args)]
pub struct DoctorArguments {
    /// Check this link and the device behind it, instead of what this computer offers.
    #[arg(long, value_parser = address)]
    pub link: Option<String>,
    /// Ask the device also where a node of CANopen on its bus may take our frames for its own.
    #[arg(long, requires = "link")]
    pub ask_anyway: bool,
}

#[derive(Debug, Args)]
pub struct FaultArguments {
    #[command(subcommand)]
    pub action: FaultAction,
}

#[derive(Debug, Subcommand)]
pub enum FaultAction {
    /// List all faults, or show the one that a device has.
    List(FaultListArguments),
    /// Explain a fault: its cause, the device's reaction and what to do next.
    Explain(FaultExplainArguments),
    /// Clear the fault of a device.
    Clear(FaultClearArguments),
}

#[derive(Debug, Args)]
pub struct FaultListArguments {
    /// Ask the device behind this link.
    #[arg(long, value_parser = address)]
    pub link: Option<String>,
}

#[derive(Debug, Args)]
pub struct FaultExplainArguments {
    /// Name or code of the fault, for example EncoderLost.
    #[arg(value_parser = fault)]
    pub fault: Fault,
}

#[derive(Debug, Args)]
pub struct FaultClearArguments {
    /// Name or code of the fault; the device keeps any other fault.
    #[arg(value_parser = fault)]
    pub fault: Fault,
    /// Link of the device.
    #[arg(long, value_parser = address)]
    pub link: String,
}

/// The address of a link, checked as far as its carrier; opening it checks the rest.
///
/// The forms that people type instead are answered with the one that they mean.
pub fn address(text: &str) -> Result<String, String> {
    const CARRIERS: [&str; 4] = ["socketcan", "slcan", "qemu", "sim"];
    let kind = text.split([':', ',']).next().unwrap_or_default();
    if CARRIERS.contains(&kind) {
        return Ok(text.to_owned());
    }
    let rest = text.strip_prefix(kind).unwrap_or_default();
    let is_interface = |name: &str| {
        let number = name.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        matches!(name.strip_suffix(number), Some("can" | "vcan" | "slcan"))
    };
    let meant = match kind {
        "can" => Some(format!("socketcan{rest}")),
        "tcp" => Some(format!("slcan:{text}")),
        _ if is_interface(text) => Some(format!("socketcan:{text}")),
        _ if text.starts_with("/dev/") || text.starts_with("COM") => Some(format!("slcan:{text}")),
        _ => cathforce_bundle::nearest(kind, &CARRIERS).map(|near| format!("{near}{rest}")),
    };
    let hint = meant.map_or(String::new(), |meant| format!("did you mean `{meant}`? "));
    Err(format!("it begins with no known carrier; {hint}give one of {}", ADDRESSES.join(", ")))
}

/// The base of moved identifiers.
pub fn id_base(text: &str) -> Result<Placement, String> {
    Placement::read(text)
        .ok_or_else(|| "give a number from 0 to 0x3FFFF, the upper 18 of 29 bits".to_owned())
}

/// A fault by its name, in capitals or not, or by its code.
fn fault(text: &str) -> Result<Fault, String> {
    let by_code = text.parse::<u8>().ok().and_then(Fault::from_code);
    let by_name = || Fault::ALL.iter().copied().find(|f| f.name().eq_ignore_ascii_case(text));
    by_code.or_else(by_name).ok_or_else(|| {
        let names = Fault::ALL.iter().map(|fault| fault.name()).collect::<Vec<_>>();
        super::names::unknown("fault", text, &names, "cathforce fault list")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_without_its_carrier_is_answered_with_the_right_form() {
        for right in ["sim", "qemu", "qemu:a.elf", "socketcan:can0", "slcan:listen:3333"] {
            assert_eq!(address(right).as_deref(), Ok(right));
        }
        for (wrong, meant) in [
            ("can0", "`socketcan:can0`"),
            ("vcan1", "`socketcan:vcan1`"),
            ("can:can0", "`socketcan:can0`"),
            ("sockectan:can0", "`socketcan:can0`"),
            ("/dev/ttyACM0", "`slcan:/dev/ttyACM0`"),
            ("tcp:localhost:1", "`slcan:tcp:localhost:1`"),
            ("quemu", "`qemu`"),
        ] {
            let said = address(wrong).unwrap_err();
            assert!(said.contains(&format!("did you mean {meant}?")), "{wrong}: {said}");
        }
        let said = address("carrier-pigeon").unwrap_err();
        assert!(!said.contains("did you mean") && said.contains("socketcan:can0"), "{said}");
    }

    #[test]
    fn a_fault_is_known_by_name_and_code_and_a_slip_names_its_neighbour() {
        assert_eq!(fault("encoderlost"), Ok(Fault::EncoderLost));
        assert_eq!(fault("33"), Ok(Fault::BusOff));
        let error = fault("EncodrLost").unwrap_err();
        assert!(error.contains("did you mean `EncoderLost`?"), "{error}");
        assert!(fault("0").unwrap_err().contains("fault list"));
    }
}
