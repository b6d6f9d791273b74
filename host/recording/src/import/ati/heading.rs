//! Names and units of the columns of a sensor's log.

use super::units;

/// Indices of the columns that are read, and what they say of their unit.
pub(super) struct Heading {
    pub(super) force: [usize; 3],
    /// The unit of the forces, as their columns say.
    pub(super) force_unit: Option<String>,
    pub(super) time: Option<usize>,
    /// The status word, and whether it is hexadecimal.
    pub(super) status: Option<(usize, bool)>,
    /// The number of the packet.
    pub(super) sequence: Option<usize>,
}

/// A column's name in lower case without its unit, the unit as written, and further words.
struct Name {
    word: String,
    unit: Option<String>,
    is_exact: bool,
}

const SECONDS: [&str; 4] = ["s", "sec", "second", "seconds"];
/// Units of times and counts, to tell them from other words behind a name.
const OTHER_UNITS: [&str; 8] = ["ms", "us", "µs", "ns", "min", "counts", "count", "cts"];

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
        let time = column(names, "Time")?.map_or_else(|| column(names, "t"), |at| Ok(Some(at)))?;
        if let Some(at) = time
            && let Some(unit) = Name::of(names[at]).unit
            && !SECONDS.contains(&unit.to_lowercase().as_str())
        {
            let problem = format!("`{}` is in {unit}, not in s", names[at]);
            let fix = "write the column in seconds and name it `Time (s)`, or take it out and give --rate";
            return Err((problem, fix.into()));
        }
        let status = column(names, "Status")?;
        let is_hex = |at: usize| {
            Name::of(names[at]).unit.is_some_and(|unit| unit.eq_ignore_ascii_case("hex"))
        };
        let status = status.map(|at| (at, is_hex(at)));
        let sequence = names.iter().position(|name| {
            let name = name.to_lowercase();
            name.starts_with("rdt") && name.contains("seq")
        });
        Ok(Self { force, force_unit, time, status, sequence })
    }
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
        let mut words = before.split([' ', '_']).filter(|word| !word.is_empty());
        let word = words.next().unwrap_or_default().to_lowercase();
        let mut others = words.collect::<Vec<_>>();
        let is_unit = |word: &&str| {
            let small = word.to_lowercase();
            [&SECONDS[..], &OTHER_UNITS].concat().contains(&small.as_str())
                || units::newtons(word).is_some()
        };
        let behind = bracket.is_none() && others.last().is_some_and(is_unit);
        let unit = if behind { others.pop() } else { bracket };
        let unit = unit.filter(|unit| !unit.is_empty()).map(str::to_owned);
        Self { word, unit, is_exact: others.is_empty() }
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
            assert_eq!((found.force, found.time), ([0, 1, 2], Some(3)), "{heading}");
            assert_eq!(found.force_unit.as_deref(), unit, "{heading}");
        }
        for (heading, says) in [
            ("Fx (stone),Fy (stone),Fz (stone),Time", "no unit of force"),
            ("Fx (N),Fy (mN),Fz (N),Time", "different units"),
            ("Fx,Fy,Fz,Time (ms)", "`Time (ms)` is in ms, not in s"),
            ("Fx,Fy,Fz,t_ms", "not in s"),
        ] {
            let error = read(heading).err().expect(heading);
            assert!(error.contains(says), "{heading}: {error}");
        }
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
