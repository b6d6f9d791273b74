//! `cathforce link`: what this computer can reach a device through.

use cathforce_link::interface::{self, BusState, Interface, Kind};
use cathforce_link::{Bridged, LinkError, SerialPort, Sim, bridge, serial_ports, serve};
use serde_json::{Value, json};

use crate::args::{
    LinkAction, LinkArguments, LinkBridgeArguments, LinkServeArguments, LinkUpArguments,
};
use crate::failure::{Code, Failure};
use crate::session::interrupt_flag;
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &LinkArguments) -> Result<(), Failure> {
    match &arguments.action {
        LinkAction::List => list(ui),
        LinkAction::Up(arguments) => up(ui, arguments),
        LinkAction::Down(arguments) => {
            interface::bring_down(&arguments.interface)?;
            show(ui, &[interface::find(&arguments.interface)?], &[])
        }
        LinkAction::Serve(arguments) => be_a_device(ui, arguments),
        LinkAction::Bridge(arguments) => carry(ui, arguments),
    }
}

fn list(ui: &Ui) -> Result<(), Failure> {
    let (interfaces, ports) = (interface::list(), serial_ports());
    if interfaces.is_empty() {
        // An empty list would leave open whether there could be any.
        ui.say(match interface::check_sockets() {
            Ok(()) => {
                "There is no CAN interface. `cathforce link up vcan0` makes a virtual one.".into()
            }
            Err(LinkError::NoCanInKernel { .. }) => {
                "There are no CAN interfaces: this kernel has no CAN sockets (`modprobe can can_raw` \
                 loads them)."
                    .into()
            }
            Err(error) => format!("CAN interfaces cannot be listed: {error}"),
        });
    }
    if ports.is_empty() {
        ui.say("There is no serial port. An SLCAN adapter appears here once it is plugged in.");
    }
    show(ui, &interfaces, &ports)?;
    ui.say(
        "Without hardware: --link sim is a device in the same process, --link qemu an emulated \
         board;\n`cathforce link serve slcan:listen:5555` is a device that other programs reach \
         with --link slcan:tcp:127.0.0.1:5555.",
    );
    Ok(())
}

fn up(ui: &Ui, arguments: &LinkUpArguments) -> Result<(), Failure> {
    show(ui, &[interface::bring_up(&arguments.interface, arguments.setup())?], &[])
}

/// One line each: what to type after `--link`, and what it is.
fn show(ui: &Ui, interfaces: &[Interface], ports: &[SerialPort]) -> Result<(), Failure> {
    let json = interfaces.iter().map(json).chain(ports.iter().map(port_json));
    let rows = interfaces.iter().map(|it| (address(it), description(it)));
    let ports = ports.iter().map(|port| (port_address(port), port_description(port)));
    let rows: Vec<_> = rows.chain(ports).collect();
    ui.data(&json.collect::<Vec<_>>(), two_columns(&rows))
}

fn address(interface: &Interface) -> String {
    format!("socketcan:{}", interface.name)
}

fn port_address(port: &SerialPort) -> String {
    format!("slcan:{}", port.path)
}

fn port_json(port: &SerialPort) -> Value {
    let usb = port.usb.as_ref();
    json!({
        "name": port.path,
        "address": port_address(port),
        "kind": "serial port",
        "usb": usb.map(|usb| format!("{:04x}:{:04x}", usb.vendor, usb.product)),
        "manufacturer": usb.and_then(|usb| usb.manufacturer.as_deref()),
        "device": usb.and_then(|usb| usb.name.as_deref()),
    })
}

fn port_description(port: &SerialPort) -> String {
    let Some(usb) = &port.usb else { return "serial port".into() };
    let words = [usb.manufacturer.as_deref(), usb.name.as_deref()];
    let words: Vec<_> = words.into_iter().flatten().collect();
    let id = format!("USB {:04x}:{:04x}", usb.vendor, usb.product);
    match words.is_empty() {
        true => format!("serial port, {id}"),
        false => format!("serial port, {} ({id})", words.join(" ")),
    }
}

fn json(interface: &Interface) -> Value {
    json!({
        "name": interface.name,
        "address": address(interface),
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
    // Until somebody has connected, Ctrl-C ends this program as any other.
    let mut link = cathforce_link::open(&arguments.link)?;
    let stop = interrupt_flag()?;
    let mut device = if arguments.lock_step { Sim::in_lock_step() } else { Sim::new() };
    ui.say(format_args!("a device without hardware answers on {}; Ctrl-C ends it", link.name()));
    let served = serve(&mut *link, &mut device, stop)?;
    let json = json!({
        "received": served.received,
        "sent": served.sent,
        "unsent": served.unsent,
        "dropped": served.dropped,
    });
    let dropped = match served.dropped {
        0 => String::new(),
        dropped => format!(", {dropped} dropped because somebody read too slowly"),
    };
    let text = format!(
        "{} frames received, {} sent, {} while nobody listened{dropped}\n",
        served.received, served.sent, served.unsent
    );
    ui.data(&json, text)
}

fn carry(ui: &Ui, arguments: &LinkBridgeArguments) -> Result<(), Failure> {
    if arguments.first == arguments.second {
        let message = format!("both ends are {}, and a bus hears itself anyway", arguments.first);
        return Err(Failure::new(Code::Usage, message));
    }
    // Until both are there, Ctrl-C ends this program as any other.
    let mut first = cathforce_link::open(&arguments.first)?;
    let mut second = cathforce_link::open(&arguments.second)?;
    let stop = interrupt_flag()?;
    let (one, other) = (first.name().to_owned(), second.name().to_owned());
    ui.say(format_args!("{one} and {other} carry each other's frames; Ctrl-C ends it"));
    let Bridged { crossed, lost } = bridge(&mut *first, &mut *second, stop)?;
    let json = json!({ "first": one, "second": other, "crossed": crossed, "lost": lost });
    let ways = [(&one, &other), (&other, &one)].into_iter().zip(crossed).zip(lost);
    let text: String = ways
        .map(|(((from, to), crossed), lost)| match lost {
            0 => format!("{crossed} frames from {from} to {to}\n"),
            _ => format!("{crossed} frames from {from} to {to}, and {lost} that nobody took\n"),
        })
        .collect();
    ui.data(&json, text)
}
