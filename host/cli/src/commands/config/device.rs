//! Settings to a device and back.

use std::path::Path;

use cathforce_bundle::{Bundle, ImageOptions};
use cathforce_bus::service::crc32;
use cathforce_config::{ImageHead, keys};
use cathforce_control::Mode;
use cathforce_link::Client;
use serde::Serialize;

use super::super::{described, image_with, open_bundle, set_all};
use super::file::warn_of_slip;
use super::values::{Change, Values, changes, head_of, head_on, paths, values};
use crate::args::{ConfigApplyArguments, ConfigSaveArguments};
use crate::failure::{Code, Failure};
use crate::session::{Pace, configure, output_is_on, still_on};
use crate::settings::band::StatedBand;
use crate::settings::parse::{Entry, Problem, problem};
use crate::settings::{Setting, SettingsFile, parse_file, refused};
use crate::ui::Ui;

/// Differences that are listed of two images that are not the same.
const MOST_DIFFERENCES: usize = 5;

/// What was done, or would be.
#[derive(Serialize)]
struct Applied {
    dry_run: bool,
    changes: Vec<Change>,
    counts: Counts,
    /// Of the file: stated by rig.toml, and to be changed there.
    read_only: Vec<String>,
    /// Of the file: what this version or this rig does not have, and why.
    not_carried_over: Vec<NotCarriedOver>,
    /// The device says that it uses what it was sent.
    verified: bool,
}

#[derive(Clone, Copy, Serialize)]
struct Counts {
    changed: usize,
    unchanged: usize,
    read_only: usize,
    unknown: usize,
}

#[derive(Serialize)]
struct NotCarriedOver {
    line: usize,
    why: String,
}

/// With `lenient`, what does not carry over is listed and left out; else nothing is done then.
pub fn apply(ui: &Ui, arguments: &ConfigApplyArguments, lenient: bool) -> Result<(), Failure> {
    if arguments.file.is_dir() && arguments.bundle.is_file() {
        let (file, bundle) = (arguments.file.display(), arguments.bundle.display());
        let message = format!(
            "{file} is a bundle and {bundle} is a file, but the settings come first\n  fix: write \
             {bundle} before {file}"
        );
        return Err(Failure::new(Code::Usage, message));
    }
    let parsed = parse_file(&arguments.file)?;
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (wrong, right): (Vec<Entry>, Vec<Entry>) =
        parsed.entries.into_iter().partition(|entry| problem(entry).is_some());
    let rig = parsed.rig;
    let set = right.into_iter().map(|entry| (entry.name, entry.setting)).collect();
    let file = SettingsFile { rig, set, master: parsed.master, band: parsed.band };
    file.check_rig(&arguments.file, &bundle.rig.name)?;
    for (name, setting) in &file.set {
        warn_of_slip(ui, name, setting.value());
    }
    let image = build(ui, &bundle, &file, arguments.cell)?;
    let head = head_of(&image)?;
    let (read_only, unknown) = sort_out(&wrong, &head);
    if !lenient && !unknown.is_empty() {
        return Err(refused(&arguments.file, &unknown));
    }

    let mut client = Client::connect(cathforce_link::open(&arguments.link)?)?;
    let old = head_on(&mut client)?.as_ref().map(values).unwrap_or_default();
    let changes = changes(&old, &values(&head));
    let changed = changes.len();
    let counts = Counts {
        changed,
        unchanged: keys().count() - changed,
        read_only: read_only.len(),
        unknown: unknown.len(),
    };
    let not_carried_over = unknown
        .into_iter()
        .map(|p| NotCarriedOver { line: p.line, why: format!("{}; {}", p.message, p.fix) })
        .collect();
    let mut applied = Applied {
        dry_run: arguments.dry_run,
        changes,
        counts,
        read_only,
        not_carried_over,
        verified: false,
    };
    // Shown before it is done: a device that refuses leaves the diff on the screen.
    ui.say(applied.changes_text());
    if !arguments.dry_run {
        if let Some(mode) = output_is_on(&client) {
            return Err(armed(mode, &arguments.link, &applied.changes));
        }
        configure(ui, &mut client, &image, Pace::LockStep)?;
        applied.verified = head_on(&mut client)?.as_ref() == Some(&head);
        if !applied.verified {
            let message = "the device does not read back what it was sent: apply it again, and if \
                           that does not help check the device's memory";
            return Err(Failure::new(Code::Device, message));
        }
    }
    ui.data(&applied, applied.text(&arguments.file))
}

/// What cannot change now, and how it can.
fn armed(mode: Mode, link: &str, changes: &[Change]) -> Failure {
    let names = changes.iter().map(|change| change.name).take(MOST_DIFFERENCES);
    let mut names = names.collect::<Vec<_>>().join(", ");
    match changes.len() {
        0 => names = "the configuration".into(),
        n if n > MOST_DIFFERENCES => names += &format!(" and {} others", n - MOST_DIFFERENCES),
        _ => {}
    }
    let message = format!("{names} cannot change: {}", still_on(mode, link));
    Failure::new(Code::Device, message)
}

fn build(
    ui: &Ui,
    bundle: &Bundle,
    file: &SettingsFile,
    cell_mm: Option<f64>,
) -> Result<Vec<u8>, Failure> {
    let mut options = ImageOptions::default();
    if let Some(cell_mm) = cell_mm {
        options.cell_m = 1e-3 * cell_mm;
    }
    set_all(&mut options, file).map_err(Failure::input)?;
    if let Some(stated) = &file.band {
        let description = described(bundle, &options)?;
        options.band = stated.for_model(ui, &description, &file.by_hand());
    }
    Ok(image_with(ui, bundle, &options)?.0)
}

/// Names that the rig states, and what is wrong with the others.
fn sort_out(wrong: &[Entry], head: &ImageHead) -> (Vec<String>, Vec<Problem>) {
    let paths = paths(head);
    let is_of_rig = |name: &str| {
        paths.keys().any(|path| {
            path.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    };
    let (mut read_only, mut unknown) = (Vec::new(), Vec::new());
    for entry in wrong {
        if cathforce_config::Key::find(&entry.name).is_none() && is_of_rig(&entry.name) {
            read_only.push(entry.name.clone());
        } else {
            unknown.extend(problem(entry));
        }
    }
    (read_only, unknown)
}

impl Applied {
    fn changes_text(&self) -> String {
        if self.changes.is_empty() {
            return "nothing changes: it is configured like that already".into();
        }
        self.changes.iter().map(Change::text).collect::<Vec<_>>().join("\n")
    }

    fn text(&self, file: &Path) -> String {
        let Counts { changed, unchanged, read_only, unknown } = self.counts;
        let mut text = format!(
            "{changed} changed, {unchanged} unchanged, {read_only} read-only, {unknown} unknown\n"
        );
        for name in &self.read_only {
            text += &format!("read-only: {name} is stated by rig.toml, change it there\n");
        }
        for NotCarriedOver { line, why } in &self.not_carried_over {
            text += &format!("not carried over: {}:{line}: {why}\n", file.display());
        }
        text += match (self.dry_run, self.verified) {
            (true, _) => "dry run: nothing was changed\n",
            (false, true) => "the device uses it: read back and compared\n",
            (false, false) => "",
        };
        text
    }
}

pub fn save(ui: &Ui, arguments: &ConfigSaveArguments) -> Result<(), Failure> {
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let mut client = Client::connect(cathforce_link::open(&arguments.link)?)?;
    let Some(head) = head_on(&mut client)? else {
        let message = "the device has no configuration; `cathforce config apply` gives it one";
        return Err(Failure::new(Code::Device, message));
    };
    let nothing = SettingsFile { rig: bundle.rig.name.clone(), ..SettingsFile::default() };
    let base = values(&head_of(&build(ui, &bundle, &nothing, arguments.cell)?)?);
    let set = differing(&base, &values(&head), &arguments.file);
    // What the device states is of what it computes with.
    let band = head.band.map(|band| StatedBand::new(band, &head.description));
    let file = SettingsFile { set, master: head.master, band, ..nothing };

    let image = build(ui, &bundle, &file, arguments.cell)?;
    let (again, used) = (crc32(&image), client.status()?.image_crc32);
    if again != used {
        return Err(another_rig(&head, &head_of(&image)?, &arguments.bundle));
    }
    file.write(&arguments.file)?.commit()?;
    let shown = arguments.file.display().to_string();
    let settings = file.set.len();
    let json = serde_json::json!({
        "path": shown, "settings": settings, "image_crc32": format!("{used:08x}"), "verified": true,
    });
    let text = format!(
        "{shown}: {settings} settings; with the bundle they give the image that the device uses, \
         CRC {used:08x}\n"
    );
    ui.data(&json, text)
}

/// What a file must say; where a value comes from is kept from a file that says the same.
fn differing(
    base: &Values,
    used: &Values,
    file: &Path,
) -> std::collections::BTreeMap<String, Setting> {
    let known = SettingsFile::read(file).unwrap_or_default();
    let setting = |change: Change| {
        let value = change.new?;
        let known = known.set.get(change.name).filter(|known| known.value() == value);
        let setting = known.cloned().unwrap_or(Setting::ByHand(value));
        Some((change.name.to_owned(), setting))
    };
    changes(base, used).into_iter().filter_map(setting).collect()
}

fn another_rig(device: &ImageHead, bundle: &ImageHead, path: &Path) -> Failure {
    let (device, bundle) = (paths(device), paths(bundle));
    let differs = |(name, value): (&String, &String)| {
        let other = bundle.get(name).map_or("nothing", String::as_str);
        (other != value).then(|| format!("{name} is {value} on the device and {other} here"))
    };
    let mut list = device.iter().filter_map(differs).take(MOST_DIFFERENCES).collect::<Vec<_>>();
    if list.is_empty() {
        list.push("the numbers agree, the field of the vessel does not: another --cell?".into());
    }
    let path = path.display();
    let message = format!(
        "the device was not configured from {path}, so no settings of it can give the same: {}\n  \
         fix: name the bundle that it was configured from, with its --cell",
        list.join("; ")
    );
    Failure::input(message)
}
