//! `cathforce bundle`.

use std::fs;
use std::io;
use std::path::Path;

use cathforce_bundle::{TemplatePlant, template};
use cathforce_recording::make_folder;
use serde_json::json;

use crate::args::{BundleAction, BundleArguments, BundleInitArguments, Plant};
use crate::failure::{Code, Failure};
use crate::output::check_new_folder;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &BundleArguments) -> Result<(), Failure> {
    match &arguments.action {
        BundleAction::Init(arguments) => init(ui, arguments),
    }
}

fn init(ui: &Ui, arguments: &BundleInitArguments) -> Result<(), Failure> {
    let folder = &arguments.folder;
    check_folder(folder)?;
    let files = template(TemplatePlant::from(arguments.plant), &name_of(folder));
    fill_folder(folder, |new| {
        for (name, text) in &files {
            let path = new.join(name);
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            fs::write(path, text)?;
        }
        Ok(())
    })?;
    let names: Vec<_> = files.iter().map(|(name, _)| *name).collect();
    let shown = folder.display();
    let next = match arguments.plant {
        Plant::Catheter => format!("cathforce simulate {shown}"),
        Plant::Drive | Plant::Transmission => format!("cathforce gap diagnose {shown}"),
    };
    let text = format!(
        "{shown}: {}\nEdit rig.toml, then check it with `cathforce info {shown}`. As it stands, \
         `{next}` works already.\n",
        names.join(", ")
    );
    ui.data(&json!({ "path": shown.to_string(), "files": names }), text)
}

/// What a rig in this folder may be called.
fn name_of(folder: &Path) -> String {
    let named = folder.file_name().map(|name| name.to_string_lossy().into_owned());
    // `.` and the like name no folder, but lead to one.
    let found = || Some(folder.canonicalize().ok()?.file_name()?.to_string_lossy().into_owned());
    named.or_else(found).unwrap_or_else(|| "my-rig".into())
}

/// Says before the work that a folder can be neither made nor filled.
pub fn check_folder(folder: &Path) -> Result<(), Failure> {
    match fs::read_dir(folder).map(|mut entries| entries.next().is_none()) {
        Ok(true) => Ok(()),
        Ok(false) => {
            let message = format!(
                "{} is not empty, and nothing in it is touched\n  fix: name a folder that is not \
                 there yet",
                folder.display()
            );
            Err(Failure::new(Code::Usage, message))
        }
        Err(_) => check_new_folder(folder),
    }
}

/// Makes a folder, or fills one that is empty: with everything or, on an error, with nothing.
pub fn fill_folder(
    folder: &Path,
    fill: impl FnOnce(&Path) -> io::Result<()>,
) -> Result<(), Failure> {
    let filled = match folder.is_dir() {
        false => make_folder(folder, fill),
        true => {
            let part = folder.join(format!(".{}.part", std::process::id()));
            make_folder(&part, fill).and_then(|()| move_up(&part, folder)).inspect_err(|_| {
                // The error that led here is the one to be told.
                let _ = fs::remove_dir_all(&part);
            })
        }
    };
    filled.map_err(|e| Failure::write(folder, e))
}

fn move_up(from: &Path, to: &Path) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        fs::rename(entry.path(), to.join(entry.file_name()))?;
    }
    fs::remove_dir(from)
}
