//! `cathforce fault`: explains faults and clears the one that a device has.

use cathforce_bus::Command;
use cathforce_control::{Fault, Mode, Reaction};
use cathforce_link::{Client, Step};
use serde_json::{Value, json};

use crate::args::{FaultAction, FaultArguments, FaultClearArguments};
use crate::failure::{Code, Failure};
use crate::ui::{Ui, two_columns};

/// Ticks within which a device must leave a fault.
const PATIENCE_TICKS: usize = 50;

pub fn run(ui: &Ui, arguments: &FaultArguments) -> Result<(), Failure> {
    match &arguments.action {
        FaultAction::List(arguments) => match &arguments.link {
            Some(link) => show_latched(ui, link),
            None => list(ui),
        },
        FaultAction::Explain(arguments) => ui.data(&json(arguments.fault), text(arguments.fault)),
        FaultAction::Clear(arguments) => clear(ui, arguments),
    }
}

fn list(ui: &Ui) -> Result<(), Failure> {
    let all = Fault::ALL.iter().map(|&fault| json(fault)).collect::<Vec<_>>();
    let rows = Fault::ALL.iter().map(|fault| {
        (format!("{:>2} {}", fault.code(), ui.bold(fault.name())), fault.cause().to_owned())
    });
    ui.data(&all, two_columns(&rows.collect::<Vec<_>>()))
}

fn show_latched(ui: &Ui, link: &str) -> Result<(), Failure> {
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    match latched(&mut client)? {
        Some(fault) => ui.data(&[json(fault)], text(fault)),
        None => ui.data(&json!([]), "no fault\n"),
    }
}

/// The fault that holds the output at zero, or ramps it to zero.
fn latched(client: &mut Client) -> Result<Option<Fault>, Failure> {
    let status = client.status()?;
    Ok(Mode::from_codes(status.mode, status.fault).and_then(Mode::fault))
}

/// A device clears only the fault whose token it is sent, so that no unseen fault is cleared.
fn clear(ui: &Ui, arguments: &FaultClearArguments) -> Result<(), Failure> {
    let mut client = Client::connect(cathforce_link::open(&arguments.link)?)?;
    match latched(&mut client)? {
        Some(fault) if fault == arguments.fault => {}
        Some(other) => {
            let message = format!(
                "the device has another fault, {}: {}\n  fix: clear it with `cathforce fault clear {} \
                 --link {}`",
                other.name(),
                other.text(),
                other.name(),
                arguments.link
            );
            return Err(Failure::new(Code::Device, message));
        }
        None => return ui.data(&json!({ "cleared": null }), "the device has no fault\n"),
    }
    let token = arguments.fault.clear_token();
    for _ in 0..PATIENCE_TICKS {
        let step = Step { command: Some(Command::ClearFault { token }), ..Step::default() };
        client.run_tick(step)?;
        if latched(&mut client)?.is_none() {
            let name = arguments.fault.name();
            let text = format!("{name} is cleared; the device can be tested and armed again\n");
            return ui.data(&json!({ "cleared": name }), text);
        }
    }
    let message = format!(
        "the device keeps its fault {}\n  fix: remove its cause first: {}",
        arguments.fault.name(),
        arguments.fault.text()
    );
    Err(Failure::new(Code::Device, message))
}

fn json(fault: Fault) -> Value {
    json!({
        "code": fault.code(),
        "name": fault.name(),
        "cause": fault.cause(),
        "reaction": reaction(fault),
        "next": fault.next_step(),
        "clear_token": fault.clear_token(),
    })
}

fn text(fault: Fault) -> String {
    two_columns(&[
        ("fault".into(), format!("{} ({})", fault.name(), fault.code())),
        ("cause".into(), fault.cause().into()),
        ("reaction".into(), reaction(fault).into()),
        ("next".into(), fault.next_step().into()),
        ("then".into(), format!("cathforce fault clear {} --link …", fault.name())),
    ])
}

fn reaction(fault: Fault) -> &'static str {
    match fault.reaction() {
        Reaction::Ramp => "output ramps to zero within 20 ms and stays there",
        Reaction::Cut => "output is zero from the same tick on",
    }
}
