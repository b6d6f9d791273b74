//! `cathforce config apply`, `restore` and `save`: settings to a device and back.

use std::path::Path;

use cathforce_bundle::{Bundle, ImageOptions};
use cathforce_bus::service::crc32;
use cathforce_config::{ImageHead, Key, keys};
use cathforce_control::Mode;
use cathforce_link::Client;
use serde::Serialize;

use super::file::warn_of_slip;
use super::flash;
use super::show::NOT_CONFIGURED;
use super::values::{Change, Values, changes, head_of, head_on, paths, values};
use crate::args::{ConfigApplyArguments, ConfigSaveArguments};
use crate::failure::{Code, Failure};
use crate::image::{described, image_with, set_all};
use crate::open::open_bundle;
use crate::session::{Pace, configure, output_is_on, still_on};
use crate::settings::band::StatedBand;
use crate::settings::entry::{Entry, problem};
use crate::settings::parse::Parsed;
use crate::settings::units::unit;
use crate::settings::{Problem, Setting, SettingsFile, parse_file, refused};
use crate::ui::Ui;

/// Most differences that a message names.
const MOST_DIFFERENCES: usize = 5;

/// What was done, or would be done.
#[derive(Serialize)]
struct Applied {
    dry_run: bool,
    /// The device had no configuration before.
    fresh: bool,
    changes: Vec<Change>,
    counts: Counts,
    /// Names in the file that rig.toml states; they change there.
    read_only: Vec<String>,
    /// Entries of the file that this version or this rig does not have.
    not_carried_over: Vec<NotCarriedOver>,
    /// The device reports that it uses what it was sent.
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

/// A settings file, sorted into what a device can take and what it cannot.
struct Sorted {
    file: SettingsFile,
    image: Vec<u8>,
    head: ImageHead,
    /// Names that rig.toml states.
    read_only: Vec<String>,
    unknown: Vec<Problem>,
}

/// Configures a device. With `lenient`, entries that cannot be used are listed and left out; without
/// it the device is not configured at all.
pub fn apply(ui: &Ui, arguments: &ConfigApplyArguments, lenient: bool) -> Result<(), Failure> {
    let (bundle_path, path) = arguments.bundle_and_file();
    let parsed = parse_file(path)?;
    let bundle = open_bundle(ui, bundle_path)?;
    let sorted = sort(ui, parsed, &bundle, path, arguments.cell)?;
    if !lenient && !sorted.unknown.is_empty() {
        return Err(refused(path, &sorted.unknown));
    }

    let mut client = Client::connect(cathforce_link::open(&arguments.link)?)?;
    let old = head_on(&mut client)?;
    let mut applied = Applied::planned(arguments.dry_run, old.as_ref(), &sorted);
    // Printed before it is done, so that the changes stay on the screen when a device refuses.
    ui.say(applied.changes_text(arguments.all, path, &sorted.file));
    if !arguments.dry_run {
        if let Some(mode) = output_is_on(&client) {
            return Err(armed(mode, &arguments.link, &applied.changes));
        }
        configure(ui, &mut client, &sorted.image, Pace::LockStep)?;
        applied.verified = head_on(&mut client)?.as_ref() == Some(&sorted.head);
        if !applied.verified {
            let message = "the device does not read back what it was sent\n  fix: apply it again; if \
                           that does not help, check the device's memory";
            return Err(Failure::new(Code::Device, message));
        }
    }
    ui.data(&applied, applied.text(path))
}

fn sort(
    ui: &Ui,
    parsed: Parsed,
    bundle: &Bundle,
    path: &Path,
    cell_mm: Option<f64>,
) -> Result<Sorted, Failure> {
    let (wrong, right): (Vec<Entry>, Vec<Entry>) =
        parsed.entries.into_iter().partition(|entry| problem(entry).is_some());
    let set = right.into_iter().map(|entry| (entry.name, entry.setting)).collect();
    let file = SettingsFile { rig: parsed.rig, set, master: parsed.master, band: parsed.band };
    file.check_rig(path, &bundle.rig.name)?;
    for (name, setting) in &file.set {
        warn_of_slip(ui, name, setting.value());
    }
    let image = build(ui, bundle, &file, cell_mm)?;
    let head = head_of(&image)?;
    let (read_only, unknown) = unusable(&wrong, &head);
    Ok(Sorted { file, image, head, read_only, unknown })
}

/// Why nothing was sent to an armed device, and what to do.
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

/// Sorts entries that cannot be used: names that rig.toml states, and the problems of all others.
fn unusable(wrong: &[Entry], head: &ImageHead) -> (Vec<String>, Vec<Problem>) {
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
    fn planned(dry_run: bool, old: Option<&ImageHead>, sorted: &Sorted) -> Self {
        let changes = changes(&old.map(values).unwrap_or_default(), &values(&sorted.head));
        let counts = Counts {
            changed: changes.len(),
            unchanged: keys().count() - changes.len(),
            read_only: sorted.read_only.len(),
            unknown: sorted.unknown.len(),
        };
        let lost =
            |p: &Problem| NotCarriedOver { line: p.line, why: format!("{}; {}", p.message, p.fix) };
        Self {
            dry_run,
            fresh: old.is_none(),
            changes,
            counts,
            read_only: sorted.read_only.clone(),
            not_carried_over: sorted.unknown.iter().map(lost).collect(),
            verified: false,
        }
    }

    /// The changes, one a line. A device without a configuration gets every value, so only those of
    /// the file are listed unless `all` is asked for.
    fn changes_text(&self, all: bool, path: &Path, file: &SettingsFile) -> String {
        if self.changes.is_empty() {
            return "nothing changes: the device is configured like this already".into();
        }
        if all || !self.fresh {
            return self.changes.iter().map(Change::text).collect::<Vec<_>>().join("\n");
        }
        let mut text = format!(
            "the device has no configuration yet: it gets all {} values, of which {} come from {} \
             (--all lists them all)",
            self.changes.len(),
            file.set.len(),
            path.display()
        );
        for (name, setting) in &file.set {
            let unit = Key::find(name).map_or(String::new(), unit);
            text += &format!("\n{name} = {}{unit}", setting.value());
        }
        text
    }

    fn text(&self, file: &Path) -> String {
        let Counts { changed, unchanged, read_only, unknown } = self.counts;
        let changed = match self.fresh {
            true => format!("{changed} set"),
            false => format!("{changed} changed, {unchanged} unchanged"),
        };
        let mut text = format!("{changed}, {read_only} read-only, {unknown} unknown\n");
        for name in &self.read_only {
            text += &format!("read-only: {name} is a value of rig.toml; change it there\n");
        }
        for NotCarriedOver { line, why } in &self.not_carried_over {
            text += &format!("not carried over: {}:{line}: {why}\n", file.display());
        }
        text += match (self.dry_run, self.verified) {
            (true, _) => "dry run: nothing was changed\n",
            (false, true) => "the device uses these values: they were read back and compared\n",
            (false, false) => "",
        };
        text
    }
}

/// Writes what a device uses into a file, or lets it save that itself.
pub fn save(ui: &Ui, arguments: &ConfigSaveArguments) -> Result<(), Failure> {
    match (&arguments.bundle, &arguments.file) {
        (Some(bundle), Some(file)) => save_file(ui, arguments, bundle, file),
        _ => flash::save(ui, &arguments.link),
    }
}

fn save_file(
    ui: &Ui,
    arguments: &ConfigSaveArguments,
    bundle_path: &Path,
    path: &Path,
) -> Result<(), Failure> {
    let bundle = open_bundle(ui, bundle_path)?;
    let mut client = Client::connect(cathforce_link::open(&arguments.link)?)?;
    let Some(head) = head_on(&mut client)? else {
        return Err(Failure::new(Code::Device, NOT_CONFIGURED));
    };
    let nothing = SettingsFile { rig: bundle.rig.name.clone(), ..SettingsFile::default() };
    let base = values(&head_of(&build(ui, &bundle, &nothing, arguments.cell)?)?);
    let set = differing(&base, &values(&head), path);
    // The device states the band of the model that it computes with.
    let band = head.band.map(|band| StatedBand::new(band, &head.description));
    let file = SettingsFile { set, master: head.master, band, ..nothing };

    let image = build(ui, &bundle, &file, arguments.cell)?;
    let (again, used) = (crc32(&image), client.status()?.image_crc32);
    if again != used {
        return Err(another_rig(&head, &head_of(&image)?, bundle_path));
    }
    file.write(path)?.commit()?;
    let shown = path.display().to_string();
    let settings = file.set.len();
    let json = serde_json::json!({
        "path": shown, "settings": settings, "image_crc32": format!("{used:08x}"), "verified": true,
    });
    let text = format!(
        "{shown}: {settings} settings; with the bundle they reproduce the device's image, CRC \
         {used:08x}\n"
    );
    ui.data(&json, text)
}

/// The settings that turn `base` into `used`. A value that the file holds already keeps its origin.
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
        list.push(
            "the numbers agree but the field of the vessel differs, perhaps by --cell".into(),
        );
    }
    let path = path.display();
    let message = format!(
        "the device was not configured from {path}, so no settings can reproduce its image: {}\n  \
         fix: give the bundle that it was configured from, with the same --cell",
        list.join("; ")
    );
    Failure::input(message)
}
