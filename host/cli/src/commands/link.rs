//! `cathforce link`: the CAN interfaces of this computer.

use cathforce_link::interface::{self, BusState, Interface, Kind};
use cathforce_link::{Sim, serve};
use serde_json::{Value, json};

use crate::args::{LinkAction, LinkArguments, LinkServeArguments, LinkUpArguments};
use crate::failure::Failure;
use crate::session::interrupt_flag;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &LinkArguments) -> Result<(), Failure> {
    match &arguments.action {
        LinkAction::List => list(ui),
        LinkAction::Up(arguments) => up(ui, arguments),
        LinkAction::Down(arguments) => {
            interface::bring_down(&arguments.interface)?;
            show(ui, &[interface::find(&arguments.interface)?])
        }
        LinkAction::Serve(arguments) => be_a_device(ui, arguments),
    }
}

fn list(ui: &Ui) -> Result<(), Failure> {
    let interfaces = interface::list();
    if interfaces.is_empty() {
        // An empty list would leave open whether there could be any.
        interface::check_sockets()?;
        ui.say("there is no CAN interface; `cathforce link up vcan0` makes a virtual one");
    }
    show(ui, &interfaces)
}

fn up(ui: &Ui, arguments: &LinkUpArguments) -> Result<(), Failure> {
    show(ui, &[interface::bring_up(&arguments.interface, arguments.setup())?])
}

fn show(ui: &Ui, interfaces: &[Interface]) -> Result<(), Failure> {
    let text = interfaces.iter().map(|it| format!("{}  {}\n", it.name, description(it)));
    ui.data(&interfaces.iter().map(json).collect::<Vec<_>>(), text.collect::<String>())
}

fn json(interface: &Interface) -> Value {
    json!({
        "name": interface.name,
        "kind": interface.kind.name(),
        "up": interface.is_up,
        "bit_rate": interface.bit_rate,
        "state": interface.state.map(BusState::name),
        "restart_ms": interface.restart_ms,
        "queue_frames": interface.queue_frames,
    })
}

/// What there is to know of an interface, in one line.
fn description(interface: &Interface) -> String {
    let mut parts = vec![interface.kind.name().to_owned()];
    parts.push(if interface.is_up { "up" } else { "down" }.into());
    if interface.kind == Kind::Controller {
        parts.push(match interface.bit_rate {
            Some(rate) => format!("{rate} bit/s"),
            None => "bit rate not set".into(),
        });
    }
    parts.extend(interface.state.filter(|_| interface.is_up).map(|s| s.name().to_owned()));
    parts.push(format!("queue of {} frames", interface.queue_frames));
    parts.join(", ")
}

fn be_a_device(ui: &Ui, arguments: &LinkServeArguments) -> Result<(), Failure> {
    let address = &arguments.link;
    let stop = interrupt_flag()?;
    let mut device = if arguments.lock_step { Sim::in_lock_step() } else { Sim::new() };
    let mut link = cathforce_link::open(address)?;
    ui.say(format_args!("a device without hardware answers on {address}; Ctrl-C ends it"));
    let served = serve(&mut *link, &mut device, stop)?;
    let json = json!({
        "received": served.received, "sent": served.sent, "unsent": served.unsent,
    });
    let text = format!(
        "{} frames received, {} sent, {} that nobody took\n",
        served.received, served.sent, served.unsent
    );
    ui.data(&json, text)
}
