//! `cathforce gap protocol`: the motion that a recording should hold, printed or played.

use std::fmt::Write as _;

use cathforce_bundle::bundle::EncoderReading;
use cathforce_bundle::{Bundle, SolverDefaults};
use cathforce_gap::protocol::{Piece, Position, Protocol};
use cathforce_link::{Client, Step};
use cathforce_mechanics::MAX_TENDONS;
use cathforce_recording::Trial;
use serde::Serialize;

use crate::args::{ProtocolArguments, Way};
use crate::commands::run::{encoder, temporary_folder, tendons};
use crate::failure::{Code, Failure};
use crate::open::{read_text, vessel_files};
use crate::output::{Kind, check_recording, write_again};
use crate::run_info::info;
use crate::session::{Pace, Plan, run as run_session};
use crate::ui::Ui;

#[derive(Serialize)]
struct Answer {
    rig: String,
    duration_s: f64,
    segments: Vec<Segment>,
    /// Rows of `t_s,insertion_m,rotation_rad,segment`, where they were written.
    csv: Option<String>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Segment {
    name: &'static str,
    what: &'static str,
    start_s: f64,
    end_s: f64,
}

pub fn run(ui: &Ui, arguments: &ProtocolArguments) -> Result<(), Failure> {
    let bundle = crate::open::open_bundle(ui, &arguments.bundle)?;
    let protocol = of(&bundle, &arguments.way)?;
    let rows = rows(&protocol, arguments.rate);
    if let Some(file) = &arguments.csv {
        write_again(file, Kind::Table(HEADING), &rows)?;
    }
    let answer = Answer::of(&bundle, &protocol, arguments);
    // Rows are data, and so is the list; whoever wants both writes the rows into a file.
    if ui.json || arguments.csv.is_some() || arguments.link.is_some() {
        ui.data(&answer, answer.text(ui))?;
    } else {
        ui.say(answer.text(ui).trim_end());
        ui.data(&answer, rows)?;
    }
    match &arguments.link {
        Some(link) => play(ui, link, &bundle, &protocol, arguments),
        None => Ok(()),
    }
}

/// The protocol between two insertions, which the bundle's trials know unless they are given.
pub fn of(bundle: &Bundle, way: &Way) -> Result<Protocol, Failure> {
    let refuse = |error: &dyn std::fmt::Display| {
        Failure::input(format!("{}: {error}", bundle.path.display()))
    };
    if bundle.catheter().is_none() {
        return Err(refuse(&"this rig has no instrument, and the protocol inserts one"));
    }
    let missing = || {
        refuse(
            &"there are no trials from which to take the insertions\n  fix: give \
              --from-m and --to-m",
        )
    };
    let starts = bundle.trials.iter().filter_map(|t| t.catheter()?.insertion_m.first().copied());
    let from_m = way.from_m.or(starts.min_by(f64::total_cmp)).ok_or_else(missing)?;
    let to_m = way.to_m.or(bundle.largest_insertion_m()).ok_or_else(missing)?;
    let length_m = bundle.catheter().map_or(f64::INFINITY, |rig| rig.instrument.length_m);
    if to_m > length_m {
        return Err(Failure::new(
            Code::Usage,
            format!(
                "to {to_m} m is farther than the instrument of {}, which is {length_m} m long\n  fix: \
                 give a --to-m that it reaches",
                bundle.path.join("rig.toml").display()
            ),
        ));
    }
    Protocol::new(from_m, to_m).map_err(|e| Failure::new(Code::Usage, e.to_string()))
}

const HEADING: &str = "t_s,insertion_m,rotation_rad,segment";

fn rows(protocol: &Protocol, rate_hz: f64) -> String {
    let mut text = format!("{HEADING}\n");
    for row in 0..=(protocol.duration_s() * rate_hz) as u64 {
        let t_s = row as f64 / rate_hz;
        let at = protocol.at(t_s);
        let name = protocol.piece_at(t_s).map_or("", |piece| piece.name);
        // Writing to a string does not fail.
        let _ = writeln!(text, "{t_s:.4},{:.7},{:.6},{name}", at.insertion_m, at.rotation_rad);
    }
    text
}

fn play(
    ui: &Ui,
    link: &str,
    bundle: &Bundle,
    protocol: &Protocol,
    arguments: &ProtocolArguments,
) -> Result<(), Failure> {
    if let Some(out) = &arguments.out {
        check_recording(out, arguments.overwrite)?;
    }
    let mut options = crate::image::options(ui, bundle, &arguments.changes)?;
    let pieces = protocol.pieces().iter();
    let deepest_m = pieces.map(|piece| protocol.at(piece.end_s).insertion_m).fold(0.0, f64::max);
    let defaults = SolverDefaults::default();
    options.link_length_m = bundle
        .catheter()
        .map(|rig| defaults.link_length_m(deepest_m, defaults.links_in(&rig.vessel)));
    let (image, _) = crate::image::image_with(ui, bundle, &options)?;
    let folder = temporary_folder()?;
    let out = arguments.out.clone().unwrap_or_else(|| folder.path().join("protocol.mcap"));
    // A guidewire stays at the entry: the protocol is the catheter's.
    let at_entry = EncoderReading { insertion_m: 0.0, rotation_rad: 0.0 };
    let wire = bundle.catheter().and_then(|rig| rig.guidewire.as_ref()).map(|_| at_entry);
    // Tendons rest where each is taut in the straight instrument.
    let pulled = bundle.catheter().map_or(0, |rig| rig.tendons.len());
    let plan = Plan {
        image: &image,
        pace: Pace::LockStep,
        rig_toml: &read_text(&bundle.path.join("rig.toml"))?,
        vessel: &vessel_files(bundle)?,
        info: info(link, bundle, "protocol"),
        trial: &Trial::default(),
        step_at: &|t_s| {
            let Position { insertion_m, rotation_rad } = protocol.at(t_s);
            Step {
                encoder: Some(encoder(EncoderReading { insertion_m, rotation_rad })),
                guidewire: wire.map(encoder),
                tendons: tendons(pulled, [0.0; MAX_TENDONS]),
                ..Step::default()
            }
        },
        duration_s: protocol.duration_s(),
        out: &out,
        overwrite: arguments.overwrite,
        sensor: None,
        watch: None,
    };
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    run_session(ui, &mut client, plan)?;
    if let Some(out) = &arguments.out {
        ui.say(format_args!("recording: {}", out.display()));
    }
    Ok(())
}

impl Answer {
    fn of(bundle: &Bundle, protocol: &Protocol, arguments: &ProtocolArguments) -> Self {
        let segment =
            |&Piece { name, what, start_s, end_s }: &Piece| Segment { name, what, start_s, end_s };
        let mut notes = protocol.remarks().to_vec();
        notes.push(
            "record it at least five times, with the same start: what differs between repeats is \
             the floor"
                .to_owned(),
        );
        notes.push("put a known weight on the force sensor once a day: its gain".to_owned());
        Self {
            rig: bundle.rig.name.clone(),
            duration_s: protocol.duration_s(),
            segments: protocol.pieces().iter().map(segment).collect(),
            csv: arguments.csv.as_ref().map(|file| file.display().to_string()),
            notes,
        }
    }

    fn text(&self, ui: &Ui) -> String {
        let title = format!("{}: {:.1} s", self.rig, self.duration_s);
        let mut text = format!("{}\n", ui.bold(&title));
        for Segment { name, what, start_s, end_s } in &self.segments {
            text += &format!("  {start_s:>6.2} to {end_s:>6.2} s  {name:<17} {what}\n");
        }
        for note in &self.notes {
            text += &format!("  note: {note}\n");
        }
        if let Some(csv) = &self.csv {
            text += &format!("rows: {csv}\n");
        }
        text
    }
}
