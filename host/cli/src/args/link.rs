//! Arguments of `cathforce link`, `doctor` and `fault`.

use cathforce_control::Fault;
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
    /// Set a CAN interface and bring it up; one named vcan… is made if it is not there.
    Up(LinkUpArguments),
    /// Take a CAN interface down.
    Down(LinkDownArguments),
    /// Be a device on this link, in this process, to try the other commands or a master without a
    /// board.
    Serve(LinkServeArguments),
}

#[derive(Debug, Args)]
pub struct LinkUpArguments {
    /// Name of the interface, e.g. can0.
    pub interface: String,
    /// Bits a second.
    #[arg(long, default_value_t = BIT_RATE, value_parser = clap::value_parser!(u32).range(10_000..=1_000_000))]
    bit_rate: u32,
    /// Frames that may wait to be sent.
    #[arg(long, default_value_t = QUEUE_FRAMES, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    queue: u32,
    /// Milliseconds after which a controller that went bus-off begins again; 0 is never.
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
    /// Name of the interface, e.g. can0.
    pub interface: String,
}

#[derive(Debug, Args)]
pub struct LinkServeArguments {
    /// The bus: slcan:listen:PORT is one that several programs on this computer can join with
    /// slcan:tcp:127.0.0.1:PORT; socketcan:vcan0 is Linux' own.
    pub link: String,
    /// Begin with a clock that stands still until the host grants ticks.
    #[arg(long)]
    pub lock_step: bool,
}

#[derive(Debug, Args)]
pub struct DoctorArguments {
    /// Check this link and the device behind it, instead of what this computer offers.
    #[arg(long)]
    pub link: Option<String>,
}

#[derive(Debug, Args)]
pub struct FaultArguments {
    #[command(subcommand)]
    pub action: FaultAction,
}

#[derive(Debug, Subcommand)]
pub enum FaultAction {
    /// List the faults that a device can have, or the one that it has.
    List(FaultListArguments),
    /// Say what a fault means, what the device does and what to do next.
    Explain(FaultExplainArguments),
    /// Clear the fault of a device, by its name.
    Clear(FaultClearArguments),
}

#[derive(Debug, Args)]
pub struct FaultListArguments {
    /// Ask the device behind this link.
    #[arg(long)]
    pub link: Option<String>,
}

#[derive(Debug, Args)]
pub struct FaultExplainArguments {
    /// Name, e.g. EncoderLost, or code.
    #[arg(value_parser = fault)]
    pub fault: Fault,
}

#[derive(Debug, Args)]
pub struct FaultClearArguments {
    /// The fault that you have seen; another one is not cleared.
    #[arg(value_parser = fault)]
    pub fault: Fault,
    /// Where the device is.
    #[arg(long)]
    pub link: String,
}

/// By name in any letters, or by code.
fn fault(text: &str) -> Result<Fault, String> {
    let by_code = text.parse::<u8>().ok().and_then(Fault::from_code);
    let by_name = || Fault::ALL.iter().copied().find(|f| f.name().eq_ignore_ascii_case(text));
    by_code.or_else(by_name).ok_or_else(|| {
        let names = Fault::ALL.iter().map(|fault| fault.name()).collect::<Vec<_>>();
        let nearest = cathforce_bundle::nearest(text, &names);
        let hint = nearest.map_or(String::new(), |name| format!(", the nearest is {name}"));
        format!("there is no such fault{hint}; `cathforce fault list` lists them")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_known_by_name_and_code_and_a_slip_names_its_neighbour() {
        assert_eq!(fault("encoderlost"), Ok(Fault::EncoderLost));
        assert_eq!(fault("33"), Ok(Fault::BusOff));
        let error = fault("EncodrLost").unwrap_err();
        assert!(error.contains("the nearest is EncoderLost"), "{error}");
        assert!(fault("0").unwrap_err().contains("fault list"));
    }
}
