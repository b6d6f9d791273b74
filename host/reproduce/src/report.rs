//! All rows of some systems.

use std::time::Instant;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::meter::{Meter, Trouble};
use crate::part::Outcome;
use crate::plot::Plot;
use crate::registry::System;
use crate::row::Row;

/// The first line of every page and table.
pub const TRUTH: &str = "No recording of these experiments is public: the truth comes from the reference \
                         solver under the published dimensions, parameters, speeds and sensor noise, and \
                         \"ours\" is what the device's model makes of it.";

/// The figures of one system.
#[derive(Clone, Debug)]
pub struct SystemReport {
    pub name: &'static str,
    pub doc: &'static str,
    pub source: &'static str,
    pub rows: Vec<Row>,
    pub plots: Vec<Plot>,
    /// Time that it took \[s\].
    pub seconds: f64,
    /// Parts that failed, each with its reason.
    pub failed: Vec<String>,
}

/// The figures of all systems that were asked for.
#[derive(Clone, Debug, Default)]
pub struct Report {
    pub systems: Vec<SystemReport>,
    /// Whether it ended before all was done; what is there is whole.
    pub interrupted: bool,
}

impl Report {
    /// Every row.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.systems.iter().flat_map(|system| &system.rows)
    }

    /// What failed, with the system's name.
    pub fn failed(&self) -> impl Iterator<Item = String> {
        self.systems
            .iter()
            .flat_map(|own| own.failed.iter().map(|why| format!("{}: {why}", own.name)))
    }
}

impl Serialize for Report {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct Seconds<'a>(&'a [SystemReport]);
        impl Serialize for Seconds<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(Some(self.0.len()))?;
                for own in self.0 {
                    map.serialize_entry(own.name, &own.seconds)?;
                }
                map.end()
            }
        }
        let mut map = serializer.serialize_map(Some(5))?;
        map.serialize_entry("truth", TRUTH)?;
        map.serialize_entry("rows", &self.rows().collect::<Vec<_>>())?;
        map.serialize_entry("seconds", &Seconds(&self.systems))?;
        map.serialize_entry("failed", &self.failed().collect::<Vec<_>>())?;
        map.serialize_entry("interrupted", &self.interrupted)?;
        map.end()
    }
}

/// The work in all, in the unit that [`reproduce`] tells: milliseconds of the model's time.
pub fn work(systems: &[&System]) -> u64 {
    systems.iter().map(|system| system.work()).sum()
}

/// Computes the figures of some systems.
///
/// `tell` gets the work done and the work in all, in a unit of its own. Once `stop` is true, the
/// parts that are finished are returned.
pub fn reproduce(
    systems: &[&System],
    tell: &(dyn Fn(u64, u64) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Report {
    let meter = Meter::new(work(systems), tell, stop);
    let mut report = Report::default();
    let mut done = 0;
    for system in systems {
        let start = Instant::now();
        let mut own = SystemReport {
            name: system.name,
            doc: system.doc,
            source: system.source,
            rows: Vec::new(),
            plots: Vec::new(),
            seconds: 0.0,
            failed: Vec::new(),
        };
        for part in system.parts {
            let outcome =
                if meter.is_stopped() { Err(Trouble::Stopped) } else { (part.run)(&meter) };
            match outcome {
                Ok(Outcome { rows, plots }) => {
                    own.rows.extend(rows.into_iter().map(|row| Row { system: system.name, ..row }));
                    own.plots.extend(plots);
                }
                Err(Trouble::Stopped) => report.interrupted = true,
                Err(Trouble::Failed(error)) => {
                    let why = format!("{}: {error:#}", part.name);
                    let row = Row::without(format!("{}, all figures", part.name), "", why.clone());
                    own.rows.push(Row { system: system.name, ..row });
                    own.failed.push(why);
                }
            }
            if report.interrupted {
                break;
            }
            done += (part.work)();
            meter.at(done);
        }
        own.seconds = start.elapsed().as_secs_f64();
        report.systems.push(own);
        if report.interrupted {
            break;
        }
    }
    report
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::part::Part;

    fn good(meter: &Meter) -> Result<Outcome, Trouble> {
        meter.add(3)?;
        Ok(Outcome::rows(vec![Row::of("a", "N", 1.0).published(2.0)]))
    }

    fn bad(_: &Meter) -> Result<Outcome, Trouble> {
        Err(Trouble::Failed(anyhow::anyhow!("no balance")))
    }

    const TOY: System = System {
        name: "toy",
        doc: "",
        source: "",
        parts: &[
            Part { name: "good", work: || 5, run: good },
            Part { name: "bad", work: || 5, run: bad },
            Part { name: "good", work: || 5, run: good },
        ],
    };

    #[test]
    fn a_part_that_fails_has_a_row_with_the_reason_and_the_others_stay() {
        let told = Mutex::new((0, 0));
        let report =
            reproduce(&[&TOY], &|done, total| *told.lock().unwrap() = (done, total), &|| false);
        assert_eq!(*told.lock().unwrap(), (15, 15));
        let ours: Vec<_> = report.rows().map(|row| (row.system, row.ours)).collect();
        assert_eq!(ours, [("toy", Some(1.0)), ("toy", None), ("toy", Some(1.0))]);
        assert_eq!(report.failed().collect::<Vec<_>>(), ["toy: bad: no balance"]);
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["rows"][0]["published"], 2.0);
        assert!(json["rows"][1]["ours"].is_null() && json["seconds"]["toy"].is_number());
        assert_eq!(json["truth"], TRUTH);
    }

    #[test]
    fn what_is_finished_stays_after_an_interruption() {
        let stop = AtomicBool::new(false);
        let tell = |done, _| stop.store(done >= 5, Ordering::Relaxed);
        let report = reproduce(&[&TOY, &TOY], &tell, &|| stop.load(Ordering::Relaxed));
        assert!(report.interrupted);
        assert_eq!((report.systems.len(), report.rows().count()), (1, 1));
    }
}
