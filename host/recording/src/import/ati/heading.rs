//! Names and units of the columns of a sensor's log.

use super::units;

/// Indices of the columns that are read, and what they say of their unit.
pub(super) struct Heading {
    pub(super) force: [usize; 3],
    /// The unit of the forces, as their columns say.
    pub(super) force_unit: Option<String>,
    /// The three torques, if the log has them.
    pub(super) torque: Option<[usize; 3]>,
    /// The column of time, and its unit if its name has one \[s\].
    pub(super) time: Option<(usize, Option<f64>)>,
    /// The status word, and whether it is hexadecimal.
    pub(super) status: Option<(usize, bool)>,
    /// Columns that are set where a row is no measurement.
    pub(super) flags: Vec<usize>,
    /// The number of the packet.
    pub(super) sequence: Option<usize>,
}

/// A column's name in lower case without its unit, the unit as written, and further words.
struct Name {
    word: String,
    unit: Option<String>,
    is_exact: bool,
}

/// Units of times and their sizes \[s\].
const TIMES: [(&str, f64); 14] = [
    ("s", 1.0),
    ("sec", 1.0),
    ("second", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("millis", 1e-3),
    ("us", 1e-6),
    ("µs", 1e-6),
    ("μs", 1e-6),
    ("usec", 1e-6),
    ("micros", 1e-6),
    ("ns", 1e-9),
    ("nsec", 1e-9),
];
/// Other units, to tell them from other words behind a name.
const OTHER_UNITS: [&str; 4] = ["min", "counts", "count", "cts"];
/// Flags of Bota's and OnRobot's drivers.
const FLAGS: [&str; 6] = [
    "overrange",
    "overload",
    "overloaded",
    "saturated",
    "invalid_measurements",
    "app_took_too_long",
];
/// Names of the column of time, the usual first.
const CLOCKS: [&str; 4] = ["Time", "t", "Timestamp", "Stamp"];

type Wrong = (String, String);

impl Heading {
    /// Whether these are the names of a log's columns.
    pub(super) fn is_one(names: &[&str]) -> bool {
        ["fx", "fy", "fz"].iter().all(|axis| names.iter().any(|name| Name::of(name).word == *axis))
    }

    /// Finds the columns. Errors: one is missing or there twice, or its unit is none of a force or not
    /// the others'.
    pub(super) fn read(names: &[&str]) -> Result<Self, Wrong> {
        let force = |axis| {
            let none = || (format!("there is no column {axis}"), "log anew".to_owned());
            column(names, axis)?.ok_or_else(none)
        };
        let force = [force("Fx")?, force("Fy")?, force("Fz")?];
        let units = force.map(|at| Name::of(names[at]).unit);
        if units.iter().any(|unit| *unit != units[0]) {
            let of = force.map(|at| format!("`{}`", names[at])).join(", ");
            return Err((format!("{of} are of different units"), "log all three in one".into()));
        }
        let [force_unit, ..] = units;
        if let Some(unit) = &force_unit
            && units::newtons(unit).is_none()
            && !units::is_counts(unit)
        {
            let problem = format!(
                "`{}` is in {unit}, which is no unit of force that is known",
                names[force[0]]
            );
            return Err((problem, format!("name one of {} there, or counts", units::known())));
        }
        let mut time = None;
        for name in CLOCKS {
            time = time.map_or_else(|| column(names, name), |at| Ok(Some(at)))?;
        }
        let time = time.map(|at| Ok::<_, Wrong>((at, time_unit(names[at])?))).transpose()?;
        let axes = ["Tx", "Ty", "Tz"].map(|axis| column(names, axis).ok().flatten());
        let torque = match axes {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        let is_flag = |name: &str| {
            let name = name.trim().to_lowercase().replace([' ', '-'], "_");
            FLAGS.iter().any(|flag| name.ends_with(flag))
        };
        let flags = (0..names.len()).filter(|at| is_flag(names[*at])).collect();
        let status = column(names, "Status")?;
        let is_hex = |at: usize| {
            Name::of(names[at]).unit.is_some_and(|unit| unit.eq_ignore_ascii_case("hex"))
        };
        let status = status.map(|at| (at, is_hex(at)));
        let sequence = names.iter().position(|name| {
            let name = name.to_lowercase();
            name.starts_with("rdt") && name.contains("seq")
        });
        Ok(Self { force, force_unit, torque, time, status, flags, sequence })
    }
}

/// The unit of a column of time \[s\], if its name has one.
fn time_unit(name: &str) -> Result<Option<f64>, Wrong> {
    let Some(unit) = Name::of(name).unit else { return Ok(None) };
    let known = TIMES.iter().find(|(known, _)| *known == unit.to_lowercase());
    let wrong = || {
        let problem = format!("`{name}` is in {unit}, which is no unit of time that is known");
        (
            problem,
            "name one of s, ms, us or ns there, or take the column out and give --rate".into(),
        )
    };
    known.map(|(_, size_s)| Some(*size_s)).ok_or_else(wrong)
}

/// The column of a name: the one without further words, or the only one.
fn column(names: &[&str], wanted: &str) -> Result<Option<usize>, Wrong> {
    let candidates = |is_exact: bool| {
        let all = names.iter().enumerate().map(|(at, name)| (at, Name::of(name)));
        let own = all.filter(|(_, name)| name.word == wanted.to_lowercase());
        own.filter(|(_, name)| name.is_exact || !is_exact).map(|(at, _)| at).collect::<Vec<_>>()
    };
    let exact = candidates(true);
    let found = if exact.is_empty() { candidates(false) } else { exact };
    match found[..] {
        [] => Ok(None),
        [only] => Ok(Some(only)),
        _ => {
            let all = found.iter().map(|at| format!("`{}`", names[*at])).collect::<Vec<_>>();
            let problem = format!("{} may each be {wanted}", all.join(" and "));
            Err((problem, format!("leave one of them, or call the one that is meant `{wanted}`")))
        }
    }
}

impl Name {
    /// `Fx`, `Fx (N)`, `Fx [counts]`, `Fx_N`, `"Fx filtered"`.
    fn of(name: &str) -> Self {
        let name = name.trim().trim_matches(['"', '\'']);
        let (before, bracket) = match name.find(['(', '[']) {
            Some(at) => {
                (&name[..at], Some(name[at + 1..].trim_end_matches([')', ']', ' ']).trim()))
            }
            None => (name, None),
        };
        let words = before.split([' ', '_', '.', '/']).filter(|word| !word.is_empty());
        let mut others = words.collect::<Vec<_>>();
        let has = |word: &str| others.iter().position(|one| one.eq_ignore_ascii_case(word));
        // A driver of ROS has `wrench.force.x`, others a sensor's name before `timestamp`.
        let from = has("wrench").map(|at| at + 1).or_else(|| has("timestamp"));
        others.drain(..from.unwrap_or_default());
        let word = word(&mut others);
        let is_unit = |word: &&str| {
            let small = word.to_lowercase();
            TIMES.iter().any(|(known, _)| *known == small)
                || OTHER_UNITS.contains(&small.as_str())
                || units::newtons(word).is_some()
        };
        let behind = bracket.is_none() && others.last().is_some_and(is_unit);
        let unit = if behind { others.pop() } else { bracket };
        let unit = unit.filter(|unit| !unit.is_empty()).map(str::to_owned);
        Self { word, unit, is_exact: others.is_empty() }
    }
}

/// Takes what a column is off the front of its words: `Fx`, `Force X`, `ForceX` and `F_x` are one.
fn word(words: &mut Vec<&str>) -> String {
    if words.is_empty() {
        return String::new();
    }
    let first = words.remove(0).to_lowercase();
    let letter = |name: &str| match name {
        "force" | "f" => Some('f'),
        "torque" | "moment" | "t" | "m" => Some('t'),
        _ => None,
    };
    let is_axis = |word: &str| ["x", "y", "z"].contains(&word);
    if let Some(letter) = letter(&first)
        && let Some(axis) =
            words.first().map(|axis| axis.to_lowercase()).filter(|axis| is_axis(axis))
    {
        words.remove(0);
        return format!("{letter}{axis}");
    }
    let split = first.char_indices().last().map(|(at, _)| first.split_at(at));
    match split
        .filter(|(_, axis)| is_axis(axis))
        .and_then(|(name, axis)| Some((letter(name)?, axis)))
    {
        Some((letter, axis)) => format!("{letter}{axis}"),
        None => first,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(heading: &str) -> Result<Heading, String> {
        let names = heading.split(',').collect::<Vec<_>>();
        assert!(Heading::is_one(&names), "{heading}");
        Heading::read(&names).map_err(|(problem, fix)| format!("{problem}: {fix}"))
    }

    #[test]
    fn units_are_read_in_every_spelling_and_what_is_none_of_them_is_refused() {
        for (heading, unit) in [
            ("Fx,Fy,Fz,Time", None),
            ("Fx (N),Fy (N),Fz (N),Time (s)", Some("N")),
            ("Fx_N,Fy_N,Fz_N,t_s", Some("N")),
            ("\"Fx [lbf]\",\"Fy [lbf]\",\"Fz [lbf]\",\"Time [sec]\"", Some("lbf")),
            ("Fx (counts),Fy (counts),Fz (counts),Time", Some("counts")),
        ] {
            let found = read(heading).unwrap_or_else(|error| panic!("{heading}: {error}"));
            let time = found.time.map(|(at, _)| at);
            assert_eq!((found.force, time), ([0, 1, 2], Some(3)), "{heading}");
            assert_eq!(found.force_unit.as_deref(), unit, "{heading}");
        }
        for (heading, says) in [
            ("Fx (stone),Fy (stone),Fz (stone),Time", "no unit of force"),
            ("Fx (N),Fy (mN),Fz (N),Time", "different units"),
            ("Fx,Fy,Fz,Time (days)", "`Time (days)` is in days, which is no unit of time"),
        ] {
            let error = read(heading).err().expect(heading);
            assert!(error.contains(says), "{heading}: {error}");
        }
    }

    #[test]
    fn other_makers_names_are_the_same_columns() {
        for heading in [
            "timestamp_us,Fx,Fy,Fz,Mx,My,Mz",
            "Sensor timestamp (us),Force X (N),Force Y (N),Force Z (N),Torque X,Torque Y,Torque Z",
            "time [us],F_x,F_y,F_z,T_x,T_y,T_z",
            "t_us,/ft/wrench.force.x,/ft/wrench.force.y,/ft/wrench.force.z,/ft/wrench.torque.x,\
             /ft/wrench.torque.y,/ft/wrench.torque.z",
            "stamp_us,forceX,forceY,forceZ,momentX,momentY,momentZ",
        ] {
            let found = read(heading).unwrap_or_else(|error| panic!("{heading}: {error}"));
            assert_eq!((found.time, found.force), (Some((0, Some(1e-6))), [1, 2, 3]), "{heading}");
            assert_eq!(found.torque, Some([4, 5, 6]), "{heading}");
        }
        let flags =
            read("Fx,Fy,Fz,status.overrange,app_took_too_long,overload limit").unwrap().flags;
        assert_eq!(flags, [3, 4]);
    }

    #[test]
    fn the_status_and_the_number_of_the_packet_are_found() {
        let found = read("Status (hex),RDT Sequence,F/T Sequence,Fx,Fy,Fz").unwrap();
        assert_eq!((found.status, found.sequence), (Some((0, true)), Some(1)));
        assert_eq!(read("Status,Fx,Fy,Fz").unwrap().status, Some((0, false)));
    }

    #[test]
    fn the_exact_name_goes_first_and_two_candidates_are_refused() {
        let found = read("Fx filtered,Fy filtered,Fz filtered,Fx,Fy,Fz,Time");
        assert_eq!(found.map(|found| found.force).unwrap(), [3, 4, 5]);
        let found = read("Fx_raw,Fx,Fy,Fz,Time");
        assert_eq!(found.map(|found| found.force).unwrap(), [1, 2, 3]);
        let found = read("Fx filtered,Fy filtered,Fz filtered");
        assert_eq!(found.map(|found| found.force).unwrap(), [0, 1, 2]);
        for heading in
            ["Fx,Fy,Fz,Fx (N),Time", "Fx raw2,Fx filtered,Fy,Fz,Time", "Fx,Fy,Fz,Time,Time"]
        {
            let error = read(heading).err().expect(heading);
            assert!(error.contains("may each be"), "{heading}: {error}");
        }
    }
}
