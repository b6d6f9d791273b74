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
        FaultAction::Explain(arguments) => ui.data(&json(arguments.fault), page(arguments.fault)),
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
        Some(fault) => ui.data(&[json(fault)], page(fault)),
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

/// The fault's page in the book.
pub fn page(fault: Fault) -> &'static str {
    match fault {
        Fault::EncoderLost => include_str!("../../../../docs/faults/EncoderLost.md"),
        Fault::BadFrames => include_str!("../../../../docs/faults/BadFrames.md"),
        Fault::EncoderJump => include_str!("../../../../docs/faults/EncoderJump.md"),
        Fault::TendonLost => include_str!("../../../../docs/faults/TendonLost.md"),
        Fault::TendonJump => include_str!("../../../../docs/faults/TendonJump.md"),
        Fault::ModelNotFinite => include_str!("../../../../docs/faults/ModelNotFinite.md"),
        Fault::ModelUnresolved => include_str!("../../../../docs/faults/ModelUnresolved.md"),
        Fault::SettleTimeout => include_str!("../../../../docs/faults/SettleTimeout.md"),
        Fault::Overrun => include_str!("../../../../docs/faults/Overrun.md"),
        Fault::BusOff => include_str!("../../../../docs/faults/BusOff.md"),
        Fault::Hang => include_str!("../../../../docs/faults/Hang.md"),
        Fault::Panic => include_str!("../../../../docs/faults/Panic.md"),
        Fault::HardFault => include_str!("../../../../docs/faults/HardFault.md"),
        Fault::StackOverflow => include_str!("../../../../docs/faults/StackOverflow.md"),
        Fault::StateNotFinite => include_str!("../../../../docs/faults/StateNotFinite.md"),
        Fault::SelfTest => include_str!("../../../../docs/faults/SelfTest.md"),
        Fault::SavedImageLost => include_str!("../../../../docs/faults/SavedImageLost.md"),
    }
}

fn reaction(fault: Fault) -> &'static str {
    match fault.reaction() {
        Reaction::Ramp => "output ramps to zero within 20 ms and stays there",
        Reaction::Cut => "output is zero from the same tick on",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page says what the table says.
    #[test]
    fn every_fault_has_its_page() {
        for &fault in Fault::ALL {
            let page = page(fault);
            let head = format!("# {}\n\nFault {}.\n", fault.name(), fault.code());
            assert!(page.starts_with(&head), "{}", fault.name());
            let text = page.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
            for said in [fault.cause(), fault.next_step()] {
                assert!(text.contains(&said.to_lowercase()), "{}: {said}", fault.name());
            }
        }
    }

    /// Numbers are ranged by what they concern, and never used again.
    #[test]
    fn every_fault_is_in_the_table_of_the_book() {
        let table = include_str!("../../../../docs/faults/README.md");
        for &fault in Fault::ALL {
            let row = format!("| {} | [{1}]({1}.md) |", fault.code(), fault.name());
            assert!(table.contains(&row), "{row}");
        }
        assert_eq!(table.matches(".md) |").count(), Fault::ALL.len());
    }
}
