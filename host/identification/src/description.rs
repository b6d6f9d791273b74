//! The file that describes a catheter, its experiments and what is searched for.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cathforce_bundle::nearest;
use serde::Deserialize;

use crate::clamped::{Bends, Chamber, ClampedCatheter, TipTendon};
use crate::error::IdentificationError;
use crate::quantity::{OF_FLOW, OF_LOOP, OF_RELEASE, Quantity};
use crate::rod::RodValues;

/// The format that this reads.
pub const FORMAT: &str = "identification/1";

/// What is done with the catheter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A weight at the tip is cut off.
    WeightRelease,
    /// A tendon is pulled back and forth.
    TendonHysteresis,
    /// The tip moves in a pulsating flow.
    PulsatileFlow,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::WeightRelease, Self::TendonHysteresis, Self::PulsatileFlow];

    /// As descriptions and the command line spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::WeightRelease => "weight-release",
            Self::TendonHysteresis => "tendon-hysteresis",
            Self::PulsatileFlow => "pulsatile-flow",
        }
    }

    /// The parameters of this experiment, in the order of their values.
    pub fn quantities(self) -> &'static [Quantity] {
        match self {
            Self::WeightRelease => &OF_RELEASE,
            Self::TendonHysteresis => &OF_LOOP,
            Self::PulsatileFlow => &OF_FLOW,
        }
    }
}

/// What is known of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "a number that is known, or bounds to search between, as [lowest, highest]"
)]
pub enum Range {
    Known(f64),
    Within([f64; 2]),
}

impl Range {
    /// The value, or the middle of the bounds, in the parameter's unit.
    pub fn start(self) -> f64 {
        match self {
            Self::Known(value) => value,
            Self::Within([low, high]) => 0.5 * (low + high),
        }
    }
}

/// The experiments of one trial: the files, beside the description, and what the sensor does not record.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialFiles {
    /// Weight \[kg\] and record of each release.
    Releases(Vec<(f64, PathBuf)>),
    /// A record of each loop.
    Loops(Vec<PathBuf>),
    /// A record, and where the tip rests without flow \[m\].
    Flow { record: PathBuf, rest_m: f64 },
}

/// What the catheter is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surroundings {
    Air,
    Tendon(TipTendon),
    /// Chamber, frequency of the beats \[Hz\], and area that the flow meets per length \[m\].
    Flow {
        chamber: Chamber,
        frequency_hz: f64,
        width_m: f64,
    },
}

/// A description that was read and found consistent.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    pub kind: Kind,
    pub seed: u64,
    pub catheter: ClampedCatheter,
    /// What is known of the rod; of releases, what is searched for begins there.
    pub rod: RodValues,
    pub surroundings: Surroundings,
    /// White noise of the sensor of the tip, one standard deviation \[m\].
    pub noise_m: f64,
    /// Of each of [`Kind::quantities`].
    pub parameters: Vec<Range>,
    pub trials: Vec<TrialFiles>,
}

/// What every description begins with.
#[derive(Deserialize)]
struct Head {
    format: Option<String>,
    kind: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReleaseFile {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(default = "one")]
    seed: u64,
    catheter: FreeCatheter,
    sensor: Sensor,
    parameters: Parameters,
    #[serde(rename = "trial")]
    trials: Vec<ReleaseTrial>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopFile {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(default = "one")]
    seed: u64,
    catheter: PulledCatheter,
    tendon: TendonTable,
    sensor: Sensor,
    parameters: Parameters,
    #[serde(rename = "trial")]
    trials: Vec<LoopTrial>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FlowFile {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(default = "one")]
    seed: u64,
    catheter: KnownCatheter,
    flow: FlowTable,
    sensor: Sensor,
    parameters: Parameters,
    #[serde(rename = "trial")]
    trials: Vec<FlowTrial>,
}

fn one() -> u64 {
    1
}

type Parameters = BTreeMap<String, Range>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sensor {
    noise_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FreeCatheter {
    length_m: f64,
    bending_diameter_m: f64,
    poissons_ratio: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PulledCatheter {
    length_m: f64,
    outer_diameter_m: f64,
    bending_diameter_m: f64,
    poissons_ratio: f64,
    density_kg_per_m3: f64,
    youngs_pa: f64,
    damping_n_m2_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownCatheter {
    length_m: f64,
    outer_diameter_m: f64,
    bending_diameter_m: f64,
    poissons_ratio: f64,
    density_kg_per_m3: f64,
    youngs_pa: f64,
    damping_n_m2_s: f64,
    tip_mass_kg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TendonTable {
    offset_m: f64,
    stiffness_n_per_m: f64,
    bend_behind_rad: f64,
    bends: Direction,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Direction {
    Up,
    Down,
    Sideways,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FlowTable {
    fluid_density_kg_per_m3: f64,
    frequency_hz: f64,
    width_m: f64,
    chamber_radius_m: f64,
    #[serde(default)]
    off_axis_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReleaseTrial {
    releases: Vec<ReleaseEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReleaseEntry {
    weight_kg: f64,
    record: PathBuf,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopTrial {
    loops: Vec<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FlowTrial {
    record: PathBuf,
    rest_m: f64,
}

/// Free lengths: shorter is no catheter, and longer is longer than the shaft of the simulation, or than
/// the free space around it where a tendon pulls \[m\].
const LENGTHS_M: [f64; 2] = [5e-3, 0.9];
const PULLED_M: f64 = 0.35;

/// What is wrong: the key, how many of that name come before it, the cause and the fix.
struct Fault {
    key: String,
    before: usize,
    cause: String,
    fix: String,
}

fn fault(key: &str, cause: impl Into<String>, fix: impl Into<String>) -> Fault {
    Fault { key: key.to_owned(), before: 0, cause: cause.into(), fix: fix.into() }
}

impl Description {
    /// Reads a description. Errors: the file cannot be read, is no TOML, or says what cannot be; they have
    /// its line.
    pub fn read(path: &Path) -> Result<Self, IdentificationError> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            let cause = format!("cannot be read: {error}");
            IdentificationError::file(path.display().to_string(), cause, "check the path")
        })?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Reads a description from its text. `shown`: how its file is called in an error.
    pub fn parse(shown: &str, text: &str) -> Result<Self, IdentificationError> {
        let head: Head = parsed(shown, text)?;
        let refused = |own: Fault| {
            let place = format!("{shown}:{}", line_of(text, &own.key, own.before));
            IdentificationError::file(place, own.cause, own.fix)
        };
        let kind = head.kind().map_err(refused)?;
        let own = match kind {
            Kind::WeightRelease => parsed::<ReleaseFile>(shown, text)?.description(),
            Kind::TendonHysteresis => parsed::<LoopFile>(shown, text)?.description(),
            Kind::PulsatileFlow => parsed::<FlowFile>(shown, text)?.description(),
        };
        let own = own.map_err(refused)?;
        match own.fault() {
            Some(own) => Err(refused(own)),
            None => Ok(own),
        }
    }

    /// The parameters that are searched for.
    pub fn searched(&self) -> impl Iterator<Item = (&'static Quantity, [f64; 2])> {
        let all = self.kind.quantities().iter().zip(&self.parameters);
        all.filter_map(|(own, range)| match range {
            Range::Within(bounds) => Some((own, *bounds)),
            Range::Known(_) => None,
        })
    }

    fn fault(&self) -> Option<Fault> {
        let ClampedCatheter { length_m, outer_radius_m, bending_diameter_m, poisson } =
            self.catheter;
        let [least, mut most] = LENGTHS_M;
        if self.kind == Kind::TendonHysteresis {
            most = PULLED_M;
        }
        let thick_m = 0.2 * length_m;
        let rod = self.rod.to_array().into_iter().zip(&OF_RELEASE);
        // The rod of a release stands in [parameters].
        let rod = rod.filter(|_| self.kind != Kind::WeightRelease);
        within("length_m", length_m, least, most, "metres")
            .or_else(|| within("outer_diameter_m", 2.0 * outer_radius_m, 1e-4, 0.05, "metres"))
            .or_else(|| within("bending_diameter_m", bending_diameter_m, 1e-5, thick_m, "metres"))
            .or_else(|| within("poissons_ratio", poisson, 0.0, 0.5, "a ratio"))
            .or_else(|| within("noise_m", self.noise_m, 1e-7, thick_m, "metres"))
            .or_else(|| {
                let mut all = rod;
                all.find_map(|(value, own)| within(own.name, value, own.least, own.most, own.unit))
            })
            .or_else(|| self.fault_of_surroundings())
            .or_else(|| self.fault_of_trials())
    }

    fn fault_of_surroundings(&self) -> Option<Fault> {
        match self.surroundings {
            Surroundings::Air => None,
            Surroundings::Tendon(TipTendon {
                offset_m,
                stiffness_n_per_m,
                bend_behind_rad,
                ..
            }) => {
                let radius_m = self.catheter.outer_radius_m;
                // The device's own limits.
                within("offset_m", offset_m, 1e-5, radius_m, "metres from the centre line")
                    .or_else(|| {
                        within("stiffness_n_per_m", stiffness_n_per_m, 1.0, 1e6, "N/m")
                    })
                    .or_else(|| within("bend_behind_rad", bend_behind_rad, 0.0, 30.0, "radians"))
                    .or_else(|| {
                        let friction = match self.parameters[0] {
                            Range::Known(most) | Range::Within([_, most]) => most,
                        };
                        (friction * bend_behind_rad > 4.0).then(|| {
                            fault(
                                "static_friction",
                                "the friction at its upper bound would hold any pull in the bends behind \
                                 the clamp",
                                "keep `static_friction` times `bend_behind_rad` below 4",
                            )
                        })
                    })
            }
            Surroundings::Flow { chamber, frequency_hz, width_m } => {
                let Chamber { radius_m, off_axis_m, fluid_density_kg_per_m3 } = chamber;
                let outer_m = self.catheter.outer_radius_m;
                within("fluid_density_kg_per_m3", fluid_density_kg_per_m3, 0.1, 2e4, "kg/m³")
                    .or_else(|| {
                        within(
                            "frequency_hz",
                            frequency_hz,
                            0.05,
                            20.0,
                            "hertz, not beats a minute",
                        )
                    })
                    .or_else(|| within("width_m", width_m, 1e-6, 0.05, "metres"))
                    .or_else(|| within("chamber_radius_m", radius_m, outer_m, 0.5, "metres"))
                    .or_else(|| {
                        let most_m = radius_m - outer_m;
                        within(
                            "off_axis_m",
                            off_axis_m,
                            -most_m,
                            most_m,
                            "metres, inside the chamber",
                        )
                    })
            }
        }
    }

    fn fault_of_trials(&self) -> Option<Fault> {
        let (key, what) = match self.kind {
            Kind::WeightRelease => ("releases", "`weight_kg` and `record` of each release"),
            Kind::TendonHysteresis => ("loops", "the file of each loop"),
            Kind::PulsatileFlow => ("record", "`record` and `rest_m`"),
        };
        let mut files: Vec<&PathBuf> = Vec::new();
        let mut weights = 0;
        for (k, own) in self.trials.iter().enumerate() {
            let before = files.len();
            match own {
                TrialFiles::Releases(releases) => {
                    for (weight_kg, record) in releases {
                        let own = within("weight_kg", *weight_kg, 1e-6, 1.0, "kilograms");
                        if let Some(own) = own {
                            return Some(Fault { before: weights, ..own });
                        }
                        weights += 1;
                        files.push(record);
                    }
                }
                TrialFiles::Loops(loops) => files.extend(loops),
                TrialFiles::Flow { record, rest_m } => {
                    let length_m = self.catheter.length_m;
                    if let Some(own) = within("rest_m", *rest_m, -length_m, length_m, "metres") {
                        return Some(Fault { before: k, ..own });
                    }
                    files.push(record);
                }
            }
            if files.len() == before {
                let own = fault(key, "a trial has no record", format!("give {what}"));
                return Some(Fault { before: k, ..own });
            }
        }
        let mut sorted = files.clone();
        sorted.sort();
        let twice = sorted.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        twice.map(|twice| {
            let name = twice.display().to_string();
            let cause = format!("the record {name} is named twice");
            Fault { before: 1, ..fault(&name, cause, "give each experiment a file of its own") }
        })
    }
}

/// A fault if a number is not within limits.
fn within(key: &str, value: f64, low: f64, high: f64, what: &str) -> Option<Fault> {
    // In this form NaN is refused.
    if value >= low && value <= high {
        return None;
    }
    let cause = format!("`{key}` is {value}");
    Some(fault(key, cause, format!("give a number from {low} to {high}, in {what}")))
}

impl Head {
    fn kind(&self) -> Result<Kind, Fault> {
        match self.format.as_deref() {
            Some(FORMAT) => {}
            None => {
                let cause = "it has no `format`";
                return Err(fault(
                    "format",
                    cause,
                    format!("begin it with `format = \"{FORMAT}\"`"),
                ));
            }
            Some(other) => {
                let cause = format!("the format is `{other}`, not `{FORMAT}`");
                return Err(fault("format", cause, "give the description of an identification"));
            }
        }
        let names = Kind::ALL.map(Kind::name);
        let listed = format!("give one of `{}`", names.join("`, `"));
        let Some(kind) = self.kind.as_deref() else {
            return Err(fault("kind", "it has no `kind` of experiment", listed));
        };
        Kind::ALL.into_iter().find(|own| own.name() == kind).ok_or_else(|| {
            let meant = nearest(kind, &names).map(|own| format!("; did you mean `{own}`?"));
            let cause = format!("there is no kind `{kind}`{}", meant.unwrap_or_default());
            fault("kind", cause, listed)
        })
    }
}

/// The ranges of all parameters of a kind.
fn ranges(kind: Kind, given: &Parameters) -> Result<Vec<Range>, Fault> {
    let names: Vec<&str> = kind.quantities().iter().map(|own| own.name).collect();
    if let Some(name) = given.keys().find(|name| !names.contains(&name.as_str())) {
        let meant = nearest(name, &names).map(|own| format!("; did you mean `{own}`?"));
        let cause = format!("there is no parameter `{name}`{}", meant.unwrap_or_default());
        return Err(fault(name, cause, format!("name `{}`", names.join("`, `"))));
    }
    let mut ranges = Vec::new();
    for own in kind.quantities() {
        let Quantity { name, unit, least, most, .. } = *own;
        let range = given.get(name).copied().ok_or_else(|| {
            let fix = "give its value, or bounds as [lowest, highest]";
            fault("[parameters]", format!("[parameters] lacks `{name}` ({unit})"), fix)
        })?;
        let wrong = match range {
            Range::Known(value) => within(name, value, least, most, unit),
            Range::Within([low, high]) if low < high => within(name, low, least, most, unit)
                .or_else(|| within(name, high, least, most, unit)),
            Range::Within([low, high]) => {
                let fix = "give two different bounds, the lower one first";
                Some(fault(name, format!("`{name}` runs from {low} to {high}"), fix))
            }
        };
        match wrong {
            Some(wrong) => return Err(wrong),
            None => ranges.push(range),
        }
    }
    if ranges.iter().all(|own| matches!(own, Range::Known(_))) {
        let fix = "give bounds, as [lowest, highest], of what is to be found";
        return Err(fault("[parameters]", "every parameter is known", fix));
    }
    Ok(ranges)
}

fn no_trial(is_empty: bool) -> Result<(), Fault> {
    match is_empty {
        true => Err(fault("trial", "there is no trial", "give a [[trial]] with its records")),
        false => Ok(()),
    }
}

impl ReleaseFile {
    fn description(self) -> Result<Description, Fault> {
        no_trial(self.trials.is_empty())?;
        let FreeCatheter { length_m, bending_diameter_m, poissons_ratio } = self.catheter;
        let parameters = ranges(Kind::WeightRelease, &self.parameters)?;
        let start: Vec<f64> = parameters.iter().map(|own| own.start()).collect();
        let files = |own: ReleaseTrial| {
            let each = own.releases.into_iter().map(|own| (own.weight_kg, own.record));
            TrialFiles::Releases(each.collect())
        };
        Ok(Description {
            kind: Kind::WeightRelease,
            seed: self.seed,
            catheter: ClampedCatheter {
                length_m,
                // Nothing is touched: the surface does not matter.
                outer_radius_m: 0.5 * bending_diameter_m.max(1e-4),
                bending_diameter_m,
                poisson: poissons_ratio,
            },
            rod: RodValues::of_array(std::array::from_fn(|k| start[k])),
            surroundings: Surroundings::Air,
            noise_m: self.sensor.noise_m,
            parameters,
            trials: self.trials.into_iter().map(files).collect(),
        })
    }
}

impl LoopFile {
    fn description(self) -> Result<Description, Fault> {
        no_trial(self.trials.is_empty())?;
        let own = self.catheter;
        let TendonTable { offset_m, stiffness_n_per_m, bend_behind_rad, bends } = self.tendon;
        let bends = match bends {
            Direction::Up => Bends::Up,
            Direction::Down => Bends::Down,
            Direction::Sideways => Bends::Sideways,
        };
        Ok(Description {
            kind: Kind::TendonHysteresis,
            seed: self.seed,
            catheter: ClampedCatheter {
                length_m: own.length_m,
                outer_radius_m: 0.5 * own.outer_diameter_m,
                bending_diameter_m: own.bending_diameter_m,
                poisson: own.poissons_ratio,
            },
            rod: RodValues {
                density_kg_per_m3: own.density_kg_per_m3,
                youngs_pa: own.youngs_pa,
                air_drag_kg_per_m2: 0.0,
                damping_n_m2_s: own.damping_n_m2_s,
                tip_mass_kg: 0.0,
            },
            surroundings: Surroundings::Tendon(TipTendon {
                offset_m,
                stiffness_n_per_m,
                bend_behind_rad,
                bends,
            }),
            noise_m: self.sensor.noise_m,
            parameters: ranges(Kind::TendonHysteresis, &self.parameters)?,
            trials: self.trials.into_iter().map(|own| TrialFiles::Loops(own.loops)).collect(),
        })
    }
}

impl FlowFile {
    fn description(self) -> Result<Description, Fault> {
        no_trial(self.trials.is_empty())?;
        let own = self.catheter;
        let FlowTable {
            fluid_density_kg_per_m3,
            frequency_hz,
            width_m,
            chamber_radius_m,
            off_axis_m,
        } = self.flow;
        let files = |own: FlowTrial| TrialFiles::Flow { record: own.record, rest_m: own.rest_m };
        Ok(Description {
            kind: Kind::PulsatileFlow,
            seed: self.seed,
            catheter: ClampedCatheter {
                length_m: own.length_m,
                outer_radius_m: 0.5 * own.outer_diameter_m,
                bending_diameter_m: own.bending_diameter_m,
                poisson: own.poissons_ratio,
            },
            rod: RodValues {
                density_kg_per_m3: own.density_kg_per_m3,
                youngs_pa: own.youngs_pa,
                air_drag_kg_per_m2: 0.0,
                damping_n_m2_s: own.damping_n_m2_s,
                tip_mass_kg: own.tip_mass_kg,
            },
            surroundings: Surroundings::Flow {
                chamber: Chamber {
                    radius_m: chamber_radius_m,
                    off_axis_m,
                    fluid_density_kg_per_m3,
                },
                frequency_hz,
                width_m,
            },
            noise_m: self.sensor.noise_m,
            parameters: ranges(Kind::PulsatileFlow, &self.parameters)?,
            trials: self.trials.into_iter().map(files).collect(),
        })
    }
}

/// A text as TOML, with the line of what is wrong.
fn parsed<T: serde::de::DeserializeOwned>(
    shown: &str,
    text: &str,
) -> Result<T, IdentificationError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        let fix = "compare with the description that `cathforce identify example` writes";
        IdentificationError::file(format!("{shown}:{line}"), error.message(), fix)
    })
}

/// The line on which a key stands that so many of its name come before; the last one of its name, or 1,
/// where there are fewer. Remarks do not count.
fn line_of(text: &str, key: &str, before: usize) -> usize {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut seen = 0;
    let mut last = 1;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        for (at, _) in line.match_indices(key) {
            let (left, right) = (&line[..at], &line[at + key.len()..]);
            if left.ends_with(is_word) || right.starts_with(is_word) {
                continue;
            }
            last = number;
            if seen == before {
                return number;
            }
            seen += 1;
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    const RELEASE: &str = include_str!("example/weight-release.toml");
    const LOOP: &str = include_str!("example/tendon-hysteresis.toml");
    const FLOW: &str = include_str!("example/pulsatile-flow.toml");

    #[test]
    fn the_examples_are_read() {
        let own = Description::parse("a.toml", RELEASE).unwrap();
        assert_eq!(
            (own.kind, own.trials.len(), own.searched().count()),
            (Kind::WeightRelease, 1, 5)
        );
        let own = Description::parse("a.toml", LOOP).unwrap();
        assert_eq!((own.kind, own.catheter.outer_radius_m), (Kind::TendonHysteresis, 2.05e-3));
        let own = Description::parse("a.toml", FLOW).unwrap();
        // The velocity is known.
        assert_eq!((own.searched().count(), own.parameters[3]), (3, Range::Known(0.173)));
        assert_eq!(own.trials.len(), 2);
    }

    /// What is wrong, the line on which it is, and words of the message.
    #[test]
    fn what_is_wrong_is_refused_with_its_line_cause_and_fix() {
        for (text, from, to, words) in [
            (RELEASE, "identification/1", "ultrasound/1", "the format is `ultrasound/1`"),
            (RELEASE, "\"weight-release\"", "\"weight\"", "did you mean `weight-release`?"),
            (RELEASE, "length_m = 0.135", "lenght_m = 0.135", "unknown field `lenght_m`"),
            (RELEASE, "length_m = 0.135", "length_m = 135", "`length_m` is 135"),
            (RELEASE, "noise_m = 0.2e-3", "noise_m = 0.2", "`noise_m` is 0.2"),
            (
                RELEASE,
                "youngs_pa = [13e9, 57e9]",
                "youngs_gpa = [13, 57]",
                "did you mean `youngs_pa`?",
            ),
            (RELEASE, "[13e9, 57e9]", "[57e9, 13e9]", "runs from 57000000000 to 13000000000"),
            (RELEASE, "[13e9, 57e9]", "[13.0, 57.0]", "`youngs_pa` is 13"),
            (
                RELEASE,
                "[13e9, 57e9]",
                "\"stiff\"",
                "bounds to search between, as [lowest, highest]",
            ),
            (RELEASE, "weight_kg = 20e-3", "weight_kg = 20", "`weight_kg` is 20"),
            (RELEASE, "\"release-20g.csv\"", "\"release-5g.csv\"", "release-5g.csv is named twice"),
            (
                LOOP,
                "outer_diameter_m = 4.1e-3",
                "outer_diameter_m = 2.1e-3",
                "`offset_m` is 0.0015",
            ),
            (LOOP, "bends = \"up\"", "bends = \"left\"", "unknown variant `left`"),
            (
                LOOP,
                "bend_behind_rad = 0.5",
                "bend_behind_rad = 20",
                "the friction at its upper bound",
            ),
            (
                LOOP,
                "[\"loop-1.csv\", \"loop-2.csv\", \"loop-3.csv\"]",
                "[]",
                "a trial has no record",
            ),
            (FLOW, "frequency_hz = 1.2", "frequency_hz = 72", "hertz, not beats a minute"),
            (FLOW, "off_axis_m = 8e-3", "off_axis_m = 0.03", "inside the chamber"),
            (FLOW, "rest_m = 0.0", "rest_m = 3.0", "`rest_m` is 3"),
            (FLOW, "velocity_m_per_s = 0.173", "", "[parameters] lacks `velocity_m_per_s`"),
        ] {
            assert!(text.contains(from), "{from}");
            let at = text.find(from).unwrap_or(0);
            let line = 1 + text[..at].matches('\n').count();
            let changed = text.replacen(from, to, 1);
            let error = Description::parse("a.toml", &changed).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("\n  fix: "), "`{words}` in: {error}");
            // What is missing has no line of its own; a friction that is too large stands elsewhere.
            let elsewhere = ["lacks", "`offset_m`", "upper bound"];
            if !elsewhere.iter().any(|word| words.contains(word)) {
                assert!(error.starts_with(&format!("a.toml:{line}: ")), "{line}: {error}");
            }
        }
        let known = FLOW.replace("[0.0, 1.0]", "0.5").replace("[-3.1416, 3.1416]", "0.0");
        let known = known.replace("[0.2, 5.0]", "1.0");
        let error = Description::parse("a.toml", &known).unwrap_err().to_string();
        assert!(error.contains("every parameter is known"), "{error}");
        let missing = Description::read(Path::new("/nowhere/a.toml")).unwrap_err().to_string();
        assert!(missing.contains("/nowhere/a.toml: cannot be read"), "{missing}");
    }

    #[test]
    fn the_line_of_a_key_is_found_though_remarks_and_longer_names_hold_it() {
        let text = "# a_m\nna_m = 1\nx = { a_m = 2 }\na_m = 3\n";
        assert_eq!([0, 1, 7].map(|before| line_of(text, "a_m", before)), [3, 4, 4]);
        assert_eq!(line_of(text, "absent", 0), 1);
    }
}
