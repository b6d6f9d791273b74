//! What the diagnosis is told about a plant: trials as numbers with their noise, effects as
//! parameters, and one function that simulates.
//!
//! Nothing here knows of catheters or drives. An effect acts inside [`Plant::simulate`],
//! upstream of the measurement; the diagnosis never sees anything but predictions.

use std::ops::Range;
use std::sync::Arc;

use cathforce_recording::snap::Snap;

use super::silhouette::Silhouette;

/// What a channel is a part of; errors of the parts add up to a vector's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Force on the phantom, or the command force of a drive \[N\].
    Force,
    /// Force behind the guide \[N\].
    DriveForce,
    /// End of the centre line \[m\].
    Tip,
    /// Points on the shape \[m\].
    Shape,
}

impl Quantity {
    /// Of its channels.
    pub fn unit(self) -> &'static str {
        if self.is_force() { "N" } else { "m" }
    }

    /// Whether it is measured in newtons.
    pub fn is_force(self) -> bool {
        matches!(self, Self::Force | Self::DriveForce)
    }
}

/// Units of forces and lengths. What is called a force is a torque on a rotary axis, and what is called a length
/// an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum Units {
    /// N and m.
    #[default]
    #[serde(rename = "N, m")]
    Linear,
    /// N·m and rad.
    #[serde(rename = "N·m, rad")]
    Rotary,
    /// Of a transmission, whose output is called a force and whose input a length.
    #[serde(rename = "output m, input m")]
    MetresByMetres,
    #[serde(rename = "output rad, input m")]
    RadiansByMetres,
    #[serde(rename = "output m, input rad")]
    MetresByRadians,
    #[serde(rename = "output rad, input rad")]
    RadiansByRadians,
}

impl Units {
    pub fn force(self) -> &'static str {
        match self {
            Self::Linear => "N",
            Self::Rotary => "N·m",
            Self::MetresByMetres | Self::MetresByRadians => "m",
            Self::RadiansByMetres | Self::RadiansByRadians => "rad",
        }
    }

    /// What is called a force, in a word.
    pub fn of_force(self) -> &'static str {
        match self {
            Self::Linear | Self::Rotary => "force",
            _ => "output",
        }
    }

    /// Whether what is called a length is an angle.
    pub fn along_angle(self) -> bool {
        matches!(self, Self::Rotary | Self::MetresByRadians | Self::RadiansByRadians)
    }

    /// Of a quantity, which on a rotary axis is the torque.
    pub fn of(self, quantity: Quantity) -> &'static str {
        if quantity.is_force() { self.force() } else { quantity.unit() }
    }

    pub fn is_linear(&self) -> bool {
        *self == Self::Linear
    }

    /// A stretch along the way, without minus before a zero.
    pub fn stretch(self, [from, to]: [f64; 2]) -> String {
        if self.along_angle() {
            let [from, to] = [from, to].map(|at| (1e2 * at).round() / 1e2 + 0.0);
            format!("{from:.2} to {to:.2} rad")
        } else {
            let [from, to] = [from, to].map(|at| (1e3 * at).round() + 0.0);
            format!("{from:.0} to {to:.0} mm")
        }
    }
}

/// One measured column.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the column in a trial's file.
    pub name: String,
    pub quantity: Quantity,
}

/// One measured number that is compared with a prediction. Snaps and the first motion of a trial, which
/// are not scored, are no samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time of the trial \[s\].
    pub t_s: f64,
    /// Index into [`Plant::channels`].
    pub channel: usize,
    /// Unit of the channel.
    pub value: f64,
    /// Standard deviation of the sensor noise in it, in the unit of the channel.
    pub noise: f64,
    /// Standard deviation of the model's own uncertainty at this sample (resolution, position of the
    /// wall), apart from its effects, in the unit of the channel.
    pub model: f64,
    /// Index into [`Plant::phases`].
    pub phase: usize,
    /// Index into [`Plant::regimes`].
    pub regime: usize,
    /// Arc length inside the vessel, or position of a drive \[m\].
    pub arc_m: f64,
    /// Speed of the drive \[m/s\].
    pub speed_m_per_s: f64,
    /// Index of the cycle, or of the equal part of the trial, that it belongs to.
    pub block: usize,
}

/// One trial: its samples channel by channel, each channel by time.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Number in the file's name.
    pub number: u32,
    /// Time of the first row \[s\], which may be long before that of the first sample.
    pub start_s: f64,
    /// Insertion or position then \[m\].
    pub start_m: f64,
    pub samples: Vec<Sample>,
    /// Number of blocks.
    pub blocks: usize,
    /// Where force samples are not scored because they depend on the branch taken at a bifurcation.
    pub forks: Vec<At>,
}

/// Slower than this, the direction stays what it was \[m/s\].
pub const STANDING_M_PER_S: f64 = 1e-3;

/// What a device knows at the time of a sample: insertion, and direction of feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    pub insertion_m: f64,
    pub withdrawn: bool,
}

impl At {
    /// For every sample of a trial, channel by channel.
    pub fn of_samples(samples: &[Sample]) -> Vec<Self> {
        let (mut withdrawn, mut channel) = (false, None);
        let at = |sample: &Sample| {
            if channel.replace(sample.channel) != Some(sample.channel) {
                withdrawn = false;
            }
            if sample.speed_m_per_s.abs() > STANDING_M_PER_S {
                withdrawn = sample.speed_m_per_s < 0.0;
            }
            Self { insertion_m: sample.arc_m, withdrawn }
        };
        samples.iter().map(at).collect()
    }
}

impl Trial {
    /// The samples of each channel, as ranges of [`Trial::samples`].
    pub fn channel_ranges(&self) -> Vec<Range<usize>> {
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for (i, sample) in self.samples.iter().enumerate() {
            match ranges.last_mut() {
                Some(range) if self.samples[range.start].channel == sample.channel => {
                    range.end = i + 1;
                }
                _ => ranges.push(i..i + 1),
            }
        }
        ranges
    }
}

/// Two runs of samples that were measured under the same motion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repeat {
    /// Trial and first sample of either run.
    pub first: (usize, usize),
    pub second: (usize, usize),
    /// Samples of each, all of one channel.
    pub len: usize,
}

/// One parameter of an effect, in `unit`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    pub name: &'static str,
    pub unit: &'static str,
    pub low: f64,
    pub high: f64,
    /// The value at which the effect is not there.
    pub off: f64,
    /// Standard deviation of the prior around `off`; also sets the step of differences.
    pub scale: f64,
}

/// One candidate cause. Its identifier is that of the diagnosis format.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    pub id: &'static str,
    /// One sentence.
    pub what: &'static str,
    pub parameters: Vec<Parameter>,
    /// Starting points of fits besides `off`: whole parameter vectors.
    pub starts: Vec<Vec<f64>>,
    /// Identifiers of effects that it is easily confused with.
    pub confused_with: &'static [&'static str],
}

/// A nuisance parameter: refitted for every candidate and every trial, within a tight prior around 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nuisance {
    pub name: &'static str,
    pub unit: &'static str,
    /// Standard deviation of the prior. The fit keeps the parameter within
    /// [`crate::NUISANCE_LIMIT`] of these.
    pub sd: f64,
    /// The effect that explains a value outside the prior.
    pub effect: Option<&'static str>,
}

/// The variable along which an effect oscillates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Time since the trial began \[s\].
    Time,
    /// Length fed since the trial began \[m\].
    Feed,
    /// Position, wherever the trial began \[m\].
    Position,
}

impl Along {
    /// Its value at a sample of a trial, in s or m.
    pub fn of(self, trial: &Trial, sample: usize) -> f64 {
        let sample = &trial.samples[sample];
        match self {
            Self::Time => sample.t_s - trial.start_s,
            Self::Feed => sample.arc_m - trial.start_m,
            Self::Position => sample.arc_m,
        }
    }
}

/// A cause outside the library that an effect may be mistaken for. To first order it acts like nuisance
/// parameters that grow linearly along a variable.
#[derive(Clone, Debug)]
pub struct Impostor {
    /// Indices of the nuisances.
    pub nuisances: Vec<usize>,
    pub along: Along,
    /// Description for people.
    pub what: &'static str,
}

/// An oscillating effect. To first order it acts like nuisance parameters that oscillate.
#[derive(Clone, Debug)]
pub struct Swing {
    /// Indices of the nuisances.
    pub nuisances: Vec<usize>,
    pub along: Along,
    /// Lowest and highest frequency \[cycles/s or cycles/m\].
    pub cycles: [f64; 2],
    /// Parameters of the effect for nuisance parameters A sin(2πfu + φ), from A in their units, f and φ.
    pub parameters: fn(&[f64], f64, f64) -> Vec<f64>,
    /// Index of the parameter φ, if the phase is independent of the start of a trial, as in breathing.
    pub own_phase: Option<usize>,
}

/// Values of all parameters of all effects, and of all nuisance parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// By effect, by parameter.
    pub effects: Vec<Vec<f64>>,
    pub nuisances: Vec<f64>,
    pub anchor: Anchor,
}

/// The point at which a plant computes the difference between its finer model and its coarse one. It
/// corrects its coarse simulations by that difference. Plants without finer models ignore it.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchor {
    /// By effect, by parameter.
    pub effects: Arc<Vec<Vec<f64>>>,
    /// By trial, an index below [`Plant::ways`]: the perturbed model that corrects it.
    pub ways: Arc<Vec<usize>>,
    /// Whether the finer model itself is simulated, at any point.
    pub is_everywhere: bool,
}

impl Point {
    /// Every effect off, every nuisance parameter 0.
    pub fn nominal(plant: &dyn Plant) -> Self {
        Self::off(plant.effects(), plant.nuisances().len())
    }

    /// The same for these effects and this number of nuisance parameters.
    pub fn off(effects: &[Effect], nuisances: usize) -> Self {
        let off = |effect: &Effect| effect.parameters.iter().map(|p| p.off).collect();
        let effects: Vec<Vec<f64>> = effects.iter().map(off).collect();
        let anchor = Anchor {
            effects: Arc::new(effects.clone()),
            ways: Arc::default(),
            is_everywhere: false,
        };
        Self { effects, nuisances: vec![0.0; nuisances], anchor }
    }

    /// The same point, with its anchor there.
    pub fn anchored(mut self) -> Self {
        if *self.anchor.effects != self.effects {
            self.anchor.effects = Arc::new(self.effects.clone());
        }
        self.anchor.is_everywhere = false;
        self
    }

    /// The same point, simulated with the finer model itself.
    pub fn finer(mut self) -> Self {
        self.anchor.is_everywhere = true;
        self
    }

    /// The same point, with another perturbed model for one trial.
    pub fn on_way(mut self, trial: usize, way: usize) -> Self {
        let ways = Arc::make_mut(&mut self.anchor.ways);
        ways.resize(ways.len().max(trial + 1), 0);
        ways[trial] = way;
        self
    }
}
/// A motion that could be recorded next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    pub name: &'static str,
    /// What to do, in a few words.
    pub what: &'static str,
}

/// Advice for a rig whose nominal model breaks down.
pub const BROKEN_DOWN: &str = "see what `cathforce info` warns of, and look for jumps of the \
                               encoders and for values of another unit in rig.toml";

/// A model with effects, and the trials that were measured on the rig that it models.
pub trait Plant: Sync {
    fn channels(&self) -> &[Channel];
    fn phases(&self) -> &[&'static str];
    fn regimes(&self) -> &[String];
    fn trials(&self) -> &[Trial];
    fn effects(&self) -> &[Effect];
    fn nuisances(&self) -> &[Nuisance];

    /// Predictions of all samples of a trial, in the order of [`Trial::samples`] and in the unit of their
    /// channels. `None` if the simulation breaks down at this point.
    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>>;

    /// Where on the inserted length a channel is measured, as a share of the arc length from the entry:
    /// 1 at the tip, and for channels without a place.
    fn along(&self, _trial: usize, _channel: usize) -> f64 {
        1.0
    }

    /// The outline of the vessel for a figure; `None` if there is no vessel.
    fn vessel(&self) -> Option<Silhouette> {
        None
    }

    /// Position of each sample of a trial in the frame of the vessel \[m\]: of a point on the shape its
    /// own, of every other channel that of the tip. Empty if the plant has no positions.
    fn places_m(&self, _trial: usize) -> Vec<[f64; 3]> {
        Vec::new()
    }

    /// Snaps of the measured force of a trial. No sample is taken near them.
    fn snaps(&self, _trial: usize) -> Vec<Snap> {
        Vec::new()
    }

    /// Snaps of the force that the finer model predicts at a point, found by the same rule; `None` as for
    /// [`Plant::simulate`].
    fn predicted_snaps(&self, _trial: usize, _point: &Point) -> Option<Vec<Snap>> {
        Some(Vec::new())
    }

    /// Number of perturbed finer models that simulations can be corrected by. All are as plausible; near a
    /// bifurcation they take different branches.
    fn ways(&self) -> usize {
        1
    }

    /// Whether a simulation costs next to nothing. Fits then take many steps, and nuisance parameters are
    /// linearised again where each fit ends, not only where it begins.
    fn cheap(&self) -> bool;

    /// Standard deviations above which a residual counts for less than its square ([`Loss`]).
    ///
    /// [`Loss`]: crate::fitting::loss::Loss
    fn far_off(&self) -> f64;

    /// Standard deviation of what the model leaves open at a sample, and repeats from sample to sample, in the
    /// unit of the channel.
    fn open(&self, sample: &Sample) -> f64 {
        sample.model
    }

    /// The least amplitude of what the model leaves open that is tried. One whose equations are exact where its
    /// parts are simple may leave far less open than usual.
    fn least_amplitude(&self) -> f64 {
        0.5
    }

    /// Factor on the spread of a parameter. It is calibrated by blind tests on such plants, so that 90 %
    /// intervals contain the true value about nine times in ten.
    fn spread_share(&self) -> f64 {
        1.0
    }

    /// Whether another model of the same mechanics finds other values of the same parameters, as one of a beam in
    /// contact does. Terms of an equation that the axis is described by have no other model.
    fn has_other_models(&self) -> bool {
        true
    }

    /// Standard deviations of the nuisance parameters that the parameters of an effect equal while they
    /// are small, in the order of the parameters; `None` for an effect that is never a nuisance.
    fn prior_sds(&self, _effect: usize) -> Option<Vec<f64>> {
        None
    }

    /// How an effect oscillates; `None` if it does not.
    fn swing(&self, _effect: usize) -> Option<Swing> {
        None
    }

    /// Phase of an oscillating effect in a trial, relative to its parameter \[rad\].
    fn own_phase_rad(&self, _effect: usize, _trial: usize) -> f64 {
        0.0
    }

    /// The cause outside the library that an effect may be mistaken for.
    fn impostor(&self, _effect: usize) -> Option<Impostor> {
        None
    }

    /// Runs under the same motion, for the noise floor.
    fn repeats(&self) -> &[Repeat];

    /// Motions of the protocol that the plant can simulate.
    fn segments(&self) -> &[Segment] {
        &[]
    }

    /// Predictions of such a motion, divided by the noise; `None` as for [`Plant::simulate`].
    fn simulate_segment(&self, _segment: usize, _point: &Point) -> Option<Vec<f64>> {
        None
    }

    /// Why the axes or units cannot be those of the model, if the plant itself can tell.
    fn complaint(&self) -> Option<&str> {
        None
    }

    /// Why "no gap" cannot be concluded if the floor is large compared with the measured force \[N\], and
    /// what to do; `None` if it is small enough.
    fn hidden(&self, _floor_n: f64, _measured_n: f64) -> Option<String> {
        None
    }

    /// An error in rig.toml that would look like this effect at these values, if there is one.
    fn misstated(&self, _effect: usize, _values: &[f64]) -> Option<String> {
        None
    }

    /// Units of its forces and its lengths.
    fn units(&self) -> Units {
        Units::Linear
    }

    /// Conclusions that these trials do not allow, or only with a reserve, and why.
    fn remarks(&self) -> &[String];

    /// What is compared with what, in one sentence.
    fn compared(&self) -> &str;
}

/// Whether the catalogue lists one of two effects as easily confused with the other.
pub fn are_confused(plant: &dyn Plant, a: usize, b: usize) -> bool {
    let effects = plant.effects();
    let says = |a: usize, b: usize| effects[a].confused_with.contains(&effects[b].id);
    says(a, b) || says(b, a)
}
