//! Names and units of the columns of a sensor's log.

/// Indices of the columns that are read.
pub(super) struct Heading {
    pub(super) force: [usize; 3],
    pub(super) time: Option<usize>,
}

/// A column's name in lower case without its unit, the unit as written, and further words.
struct Name {
    word: String,
    unit: Option<String>,
    is_exact: bool,
}

/// Other units of force, and how many of each make a newton, for the advice in an error.
const PER_NEWTON: [(&str, &str); 6] = [
    ("mn", "1000"),
    ("kn", "0.001"),
    ("lbf", "0.224809"),
    ("lb", "0.224809"),
    ("kgf", "0.101972"),
    ("gf", "101.972"),
];
const NEWTONS: [&str; 3] = ["n", "newton", "newtons"];
const SECONDS: [&str; 4] = ["s", "sec", "second", "seconds"];
/// Units of times and counts, to tell them from other words behind a name.
const OTHER_UNITS: [&str; 8] = ["ms", "us", "µs", "ns", "min", "counts", "count", "cts"];

type Wrong = (String, String);

impl Heading {
    /// Whether these are the names of a log's columns.
    pub(super) fn is_one(names: &[&str]) -> bool {
        ["fx", "fy", "fz"].iter().all(|axis| names.iter().any(|name| Name::of(name).word == *axis))
    }

    /// Finds the columns and checks that their unit is newtons, or counts by `counts_per_n`.
    pub(super) fn read(names: &[&str], counts_per_n: f64) -> Result<Self, Wrong> {
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
        check_force(names[force[0]], units[0].as_deref(), counts_per_n)?;
        let time = column(names, "Time")?.map_or_else(|| column(names, "t"), |at| Ok(Some(at)))?;
        if let Some(at) = time
            && let Some(unit) = Name::of(names[at]).unit
            && !SECONDS.contains(&unit.to_lowercase().as_str())
        {
            let problem = format!("`{}` is in {unit}, not in s", names[at]);
            let fix = "write the column in seconds and name it `Time (s)`, or take it out and give --rate";
            return Err((problem, fix.into()));
        }
        Ok(Self { force, time })
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

fn check_force(name: &str, unit: Option<&str>, counts_per_n: f64) -> Result<(), Wrong> {
    let Some(unit) = unit else { return Ok(()) };
    let small = unit.to_lowercase();
    let is_given = counts_per_n != 1.0;
    match (NEWTONS.contains(&small.as_str()), is_given) {
        (true, true) => Err((
            format!("`{name}` is in newtons, but --counts-per-n says that {counts_per_n} are one"),
            "leave --counts-per-n out, or name the column without a unit".into(),
        )),
        (false, false) => {
            let known = PER_NEWTON.iter().find(|(other, _)| *other == small);
            let per_newton = known.map_or("N", |(_, number)| number);
            let fix = format!("say how many {unit} are one newton: --counts-per-n {per_newton}");
            Err((format!("`{name}` is in {unit}, not in N"), fix))
        }
        _ => Ok(()),
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
            let of_force = PER_NEWTON.iter().any(|(unit, _)| *unit == small);
            [&NEWTONS[..], &SECONDS, &OTHER_UNITS].concat().contains(&small.as_str()) || of_force
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

    fn read(heading: &str, counts_per_n: f64) -> Result<Heading, String> {
        let names = heading.split(',').collect::<Vec<_>>();
        assert!(Heading::is_one(&names), "{heading}");
        Heading::read(&names, counts_per_n).map_err(|(problem, fix)| format!("{problem}: {fix}"))
    }

    #[test]
    fn units_are_read_in_every_spelling_and_what_is_none_of_them_is_refused() {
        for heading in [
            "Fx,Fy,Fz,Time",
            "Fx (N),Fy (N),Fz (N),Time (s)",
            "Fx_N,Fy_N,Fz_N,t_s",
            "\"Fx [N]\",\"Fy [N]\",\"Fz [N]\",\"Time [sec]\"",
        ] {
            let found = read(heading, 1.0).unwrap_or_else(|error| panic!("{heading}: {error}"));
            assert_eq!((found.force, found.time), ([0, 1, 2], Some(3)), "{heading}");
        }
        let counts = "Fx (counts),Fy (counts),Fz (counts),Time";
        assert!(read(counts, 1e6).is_ok());
        for (heading, counts_per_n, says) in [
            (counts, 1.0, "--counts-per-n N"),
            ("Fx (lbf),Fy (lbf),Fz (lbf),Time", 1.0, "--counts-per-n 0.224809"),
            ("Fx (mN),Fy (mN),Fz (mN),Time", 1.0, "--counts-per-n 1000"),
            ("Fx (N),Fy (N),Fz (N),Time", 1e6, "leave --counts-per-n out"),
            ("Fx (N),Fy (mN),Fz (N),Time", 1.0, "different units"),
            ("Fx,Fy,Fz,Time (ms)", 1.0, "`Time (ms)` is in ms, not in s"),
            ("Fx,Fy,Fz,t_ms", 1.0, "not in s"),
        ] {
            let error = read(heading, counts_per_n).err().expect(heading);
            assert!(error.contains(says), "{heading}: {error}");
        }
    }

    #[test]
    fn the_exact_name_goes_first_and_two_candidates_are_refused() {
        let found = read("Fx filtered,Fy filtered,Fz filtered,Fx,Fy,Fz,Time", 1.0);
        assert_eq!(found.map(|found| found.force).unwrap(), [3, 4, 5]);
        let found = read("Fx_raw,Fx,Fy,Fz,Time", 1.0);
        assert_eq!(found.map(|found| found.force).unwrap(), [1, 2, 3]);
        let found = read("Fx filtered,Fy filtered,Fz filtered", 1.0);
        assert_eq!(found.map(|found| found.force).unwrap(), [0, 1, 2]);
        for heading in
            ["Fx,Fy,Fz,Fx (N),Time", "Fx raw2,Fx filtered,Fy,Fz,Time", "Fx,Fy,Fz,Time,Time"]
        {
            let error = read(heading, 1.0).err().expect(heading);
            assert!(error.contains("may each be"), "{heading}: {error}");
        }
    }
}
