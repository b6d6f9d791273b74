//! `cathforce config`.

mod device;
mod file;
mod flash;
#[cfg(feature = "hardware")]
mod import_dbc;
#[cfg(feature = "hardware")]
mod lab_dbc;
mod list;
pub mod schema;
mod show;
mod values;

use serde_json::json;

#[cfg(not(feature = "hardware"))]
use super::left_out::import_dbc;
use crate::args::{ConfigAction, ConfigArguments, ConfigImageArguments, ConfigListArguments};
use crate::failure::Failure;
use crate::image::image;
use crate::open::open_bundle;
use crate::output::{Kind, check_again, write_again};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ConfigArguments) -> Result<(), Failure> {
    match &arguments.action {
        None => list::run(ui, &ConfigListArguments::default()),
        Some(ConfigAction::List(arguments)) => list::run(ui, arguments),
        Some(ConfigAction::Init(arguments)) => file::init(ui, arguments),
        Some(ConfigAction::Show(arguments)) => show::show(ui, arguments),
        Some(ConfigAction::Get(arguments)) => show::get(ui, arguments),
        Some(ConfigAction::Set(arguments)) => file::set(ui, arguments),
        Some(ConfigAction::Diff(arguments)) => file::diff(ui, arguments),
        Some(ConfigAction::Validate(arguments)) => file::validate(ui, arguments),
        Some(ConfigAction::Apply(arguments)) => device::apply(ui, arguments, false),
        Some(ConfigAction::Save(arguments)) => device::save(ui, arguments),
        Some(ConfigAction::Restore(arguments)) => device::apply(ui, arguments, true),
        Some(ConfigAction::ImportDbc(arguments)) => import_dbc::run(ui, arguments),
        Some(ConfigAction::Schema(file)) => {
            let schema = schema::json();
            file.check()?;
            file.write(ui, &schema, format_args!("{schema:#}\n"))
        }
        Some(ConfigAction::Image(arguments)) => write_image(ui, arguments),
    }
}

fn write_image(ui: &Ui, arguments: &ConfigImageArguments) -> Result<(), Failure> {
    check_again(&arguments.out, Kind::DeviceImage)?;
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (bytes, report) = image(ui, &bundle, &arguments.changes)?;
    write_again(&arguments.out, Kind::DeviceImage, &bytes)?;
    let path = arguments.out.display().to_string();
    ui.data(
        &json!({ "path": path, "bytes": report.bytes }),
        format_args!("{path}: {} bytes\n", report.bytes),
    )
}
