//! Makes a trial of a bag of ROS 2: joints, wrenches, points and frames of another robot, by their names.
//!
//! The wanted numbers become a table with a row for each time, which is read as any other table.

mod bag;
mod decoded;
mod error;
mod message;
mod rows;
mod signal;
mod sqlite;
mod times;

use cathforce_bundle::bundle::{ColumnMap, columns};
use cathforce_bundle::nearest;

use super::table::{ImportedTable, read_csv};
pub use bag::RosFile;
use bag::{Bag, Topic};
use decoded::{Known, kind_of, received};
pub use error::RosError;
use message::{Kind, known};
use rows::{Signal, cut_to_motion, of_table, rows, table};
use signal::{Pick, names, split};
pub use times::RosClock;
use times::Times;

/// Names that a list shows of one topic at most.
const MOST_NAMES: usize = 24;

/// A trial of a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedBag {
    pub table: ImportedTable,
    /// What was understood: topics, rates, spans, clocks.
    pub understood: Vec<String>,
}

/// A topic of a bag, for a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RosTopic {
    pub name: String,
    pub kind: String,
    pub messages: u64,
    /// What a column can be made of; empty for a type that is not read.
    pub signals: Vec<String>,
}

/// The topics of a bag, with what a column can be made of, and remarks on damage.
pub fn list_ros(files: &[RosFile]) -> Result<(Vec<RosTopic>, Vec<String>), RosError> {
    // Pictures and the like are only counted.
    let mut bag = Bag::read(files, &|topic| kind_of(topic).is_some())?;
    let messages = received(&mut bag)?;
    let found = Known::of(&bag, &messages)?;
    let topics = bag.topics.iter().enumerate().map(|(at, topic)| {
        let own = kind_of(topic).map(|kind| names(kind, &found.names[at])).unwrap_or_default();
        let signal = |name: &String| format!("{}:{name}", topic.name);
        RosTopic {
            name: topic.name.clone(),
            kind: topic.kind.clone(),
            messages: topic.count,
            signals: own.iter().take(MOST_NAMES).map(signal).collect(),
        }
    });
    Ok((topics.collect(), bag.remarks))
}

/// Reads the trial whose columns `maps` names by signals of the bag, `TOPIC:NAME`.
pub fn read_ros(
    files: &[RosFile],
    maps: &[ColumnMap],
    clock: RosClock,
) -> Result<ImportedBag, RosError> {
    if let Some(map) = maps.iter().find(|map| map.to == columns::TIME) {
        let problem = format!("--column {}=… is given, but messages have their own time", map.to);
        return Err(RosError::new(problem, "leave it out; --clock says which time counts"));
    }
    let wanted = |topic: &Topic| maps.iter().any(|map| split(&map.from).0 == topic.name);
    let mut bag = Bag::read(files, &wanted)?;
    let messages = received(&mut bag)?;
    let found = Known::of(&bag, &messages)?;
    let signals = signals(&bag, &found, maps)?;
    let mut remarks = std::mem::take(&mut bag.remarks);
    let mut understood =
        vec![format!("{} with {} topics", bag.formats.join(" and "), bag.topics.len())];
    let times = Times::of(&bag, &messages, clock);
    understood.extend(times.said(&bag, &messages, &found));
    let mut rows = rows(&messages, &signals, &times)?;
    let Some((cut, outside)) = cut_to_motion(&mut rows, &signals) else {
        let problem = "the messages of the drives do not overlap in time";
        return Err(RosError::new(problem, "check their clocks; --clock log takes the recorder's"));
    };
    if outside > 0 {
        remarks
            .push(format!("{outside} rows before or after the motion of the drives are left out"));
    }
    understood.push(format!("{} rows over {:.3} s", rows.len(), cut));
    let text = table(&signals, &rows);
    let table = read_csv(text.as_bytes(), maps).map_err(|error| of_table(&error, &rows))?;
    let ImportedTable { trial, remarks: of_rows } = table;
    remarks.extend(of_rows);
    Ok(ImportedBag { table: ImportedTable { trial, remarks }, understood })
}

/// The signals that the columns name, each once.
fn signals(bag: &Bag, found: &Known, maps: &[ColumnMap]) -> Result<Vec<Signal>, RosError> {
    let mut signals: Vec<Signal> = Vec::new();
    for map in maps {
        // A number in the place of a signal is the value in every row.
        if map.from.parse::<f64>().is_ok() {
            continue;
        }
        let (of, name) = split(&map.from);
        let is_motion = is_motion(&map.to);
        if let Some(known) = signals.iter_mut().find(|signal| signal.name == map.from) {
            known.is_motion |= is_motion;
            continue;
        }
        let topic = topic(bag, of)?;
        let Topic { kind, encoding, count, .. } = &bag.topics[topic];
        if encoding != "cdr" {
            let problem = format!("{of}: its messages are coded as `{encoding}`, and not as CDR");
            let fix =
                "convert the bag: `rosbags-convert --src in --dst out` of `pip install rosbags`";
            return Err(RosError::new(problem, fix));
        }
        let Some(kind) = Kind::of(kind) else {
            let problem = format!("{of}: messages of the type {kind} are not read");
            return Err(RosError::new(problem, format!("give a topic of {}", known())));
        };
        if *count == 0 {
            let problem = format!("{of}: the bag has no message of this topic");
            return Err(RosError::new(problem, "record it, or give another topic"));
        }
        let pick = Pick::of(kind, name, &found.names[topic])
            .map_err(|there| RosError::new(format!("{of}: there is no `{name}`"), there))?;
        signals.push(Signal { name: map.from.clone(), topic, pick, is_motion });
    }
    Ok(signals)
}

fn topic(bag: &Bag, name: &str) -> Result<usize, RosError> {
    let found = bag.topics.iter().enumerate().filter(|(_, topic)| topic.name == name);
    match found.map(|(at, _)| at).collect::<Vec<_>>()[..] {
        [only] => Ok(only),
        [] => {
            let names = bag.topics.iter().map(|topic| topic.name.as_str()).collect::<Vec<_>>();
            let fix = match nearest(name, &names) {
                Some(meant) => format!("did you mean `{meant}`? --list lists all"),
                None => format!("the bag has {}; --list lists what they hold", names.join(", ")),
            };
            Err(RosError::new(format!("there is no topic `{name}`"), fix))
        }
        [..] => {
            let problem = format!("the topic `{name}` has messages of several types");
            Err(RosError::new(problem, "split the bag with `ros2 bag convert`"))
        }
    }
}

fn is_motion(column: &str) -> bool {
    columns::REQUIRED.contains(&column)
        || [columns::GUIDEWIRE_INSERTION, columns::GUIDEWIRE_ROTATION].contains(&column)
        || columns::TENDONS.contains(&column)
}
