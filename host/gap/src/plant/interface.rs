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

/// One measured column.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the column in a trial's file.
    pub name: String,
    pub quantity: Quantity,
}

/// One measured number that is compared with a prediction. What is not to be scored (snaps, a
/// start state that has not rested) is not among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time of the trial \[s\].
    pub t_s: f64,
    /// Index into [`Plant::channels`].
    pub channel: usize,
    /// Unit of the channel.
    pub value: f64,
    /// Standard deviation that the sensor's stated noise leaves in it.
    pub noise: f64,
    /// Standard deviation of what the model leaves open at this very sample (resolution,
    /// uncertain wall), apart from its effects.
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
    /// Where samples of a force were left out because a fork decides them.
    pub forks: Vec<At>,
}

/// Slower than this, the direction stays what it was \[m/s\].
pub const STANDING_M_PER_S: f64 = 1e-3;

/// What a device knows of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    pub insertion_m: f64,
    pub withdrawn: bool,
}

impl At {
    /// Of every sample of a trial, channel by channel.
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

/// Samples of a trial that were measured under the same motion as others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repeat {
    /// Trial and first sample of either run.
    pub first: (usize, usize),
    pub second: (usize, usize),
    /// Samples of each, all of one channel.
    pub len: usize,
}

/// One number of an effect.
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

/// One candidate cause, by the identifiers of the diagnosis format.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    pub id: &'static str,
    /// One sentence.
    pub what: &'static str,
    pub parameters: Vec<Parameter>,
    /// Values to start fits from besides `off`, a list of whole parameter vectors.
    pub starts: Vec<Vec<f64>>,
    /// Identifiers that it is easily confused with.
    pub confused_with: &'static [&'static str],
}

/// A quantity that is refitted for every candidate within a tight prior around 0, in every
/// trial on its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nuisance {
    pub name: &'static str,
    pub unit: &'static str,
    /// Standard deviation of the prior. The fit holds it within [`crate::NUISANCE_LIMIT`] of
    /// these.
    pub sd: f64,
    /// The effect that it is when it lies outside its prior.
    pub effect: Option<&'static str>,
}

/// What an effect swings along.
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
    /// Of a sample of a trial.
    pub fn of(self, trial: &Trial, sample: usize) -> f64 {
        let sample = &trial.samples[sample];
        match self {
            Self::Time => sample.t_s - trial.start_s,
            Self::Feed => sample.arc_m - trial.start_m,
            Self::Position => sample.arc_m,
        }
    }
}

/// A cause in no library that an effect may be mistaken for: to first order it does what some
/// nuisances do that grow along something.
#[derive(Clone, Debug)]
pub struct Impostor {
    /// Indices of the nuisances.
    pub nuisances: Vec<usize>,
    pub along: Along,
    /// What it is, for people.
    pub what: &'static str,
}

/// An effect that does, to first order, what some nuisances do that swing.
#[derive(Clone, Debug)]
pub struct Swing {
    /// Indices of the nuisances.
    pub nuisances: Vec<usize>,
    pub along: Along,
    /// Lowest and highest frequency \[cycles/s or cycles/m\].
    pub cycles: [f64; 2],
    /// The effect's parameters for nuisances A sin(2πfu + φ): A in the nuisances' units, f, φ.
    pub parameters: fn(&[f64], f64, f64) -> Vec<f64>,
    /// Index of the parameter φ, of what need not begin with the trial: nothing ties a breath to a run.
    pub own_phase: Option<usize>,
}

/// Values of all parameters of all effects, and of all nuisances.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// By effect, by parameter.
    pub effects: Vec<Vec<f64>>,
    pub nuisances: Vec<f64>,
    pub anchor: Anchor,
}

/// Where a plant takes how far its simulations are from those of a finer model; by so much it
/// corrects them, there and around. Plants without finer models take no notice.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchor {
    /// By effect, by parameter.
    pub effects: Arc<Vec<Vec<f64>>>,
    /// By trial, which of the [`Plant::ways`].
    pub ways: Arc<Vec<usize>>,
    /// Whether the finer model itself is asked, wherever the point is.
    pub is_everywhere: bool,
}

impl Point {
    /// Every effect off, every nuisance 0.
    pub fn nominal(plant: &dyn Plant) -> Self {
        Self::off(plant.effects(), plant.nuisances().len())
    }

    /// The same of some effects and so many nuisances.
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

    /// The same effects, corrected where they are.
    pub fn anchored(mut self) -> Self {
        if *self.anchor.effects != self.effects {
            self.anchor.effects = Arc::new(self.effects.clone());
        }
        self.anchor.is_everywhere = false;
        self
    }

    /// The same by the finer model itself.
    pub fn finer(mut self) -> Self {
        self.anchor.is_everywhere = true;
        self
    }

    /// The same with another finer model for one trial.
    pub fn on_way(mut self, trial: usize, way: usize) -> Self {
        let ways = Arc::make_mut(&mut self.anchor.ways);
        ways.resize(ways.len().max(trial + 1), 0);
        ways[trial] = way;
        self
    }
}
/// A piece of motion that could be recorded next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    pub name: &'static str,
    /// What to do, in a few words.
    pub what: &'static str,
}

/// What to look at where the nominal model breaks down.
pub const BROKEN_DOWN: &str = "see what `cathforce info` warns of, and look for jumps of the \
                               encoders and for values of another unit in rig.toml";

/// A model with effects, and the trials that were measured on what it models.
pub trait Plant: Sync {
    fn channels(&self) -> &[Channel];
    fn phases(&self) -> &[&'static str];
    fn regimes(&self) -> &[String];
    fn trials(&self) -> &[Trial];
    fn effects(&self) -> &[Effect];
    fn nuisances(&self) -> &[Nuisance];

    /// Predictions of all samples of a trial, in their order; `None` when the simulation
    /// breaks down at this point.
    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>>;

    /// Where on what is inside the vessel a trial's channel is measured, as a share of the arc
    /// length from the entry: 1 at the tip, and of what belongs to no place.
    fn along(&self, _trial: usize, _channel: usize) -> f64 {
        1.0
    }

    /// The vessel as a figure shows it; `None` of what has none.
    fn vessel(&self) -> Option<Silhouette> {
        None
    }

    /// Where in the vessel's frame each sample of a trial belongs \[m\]: a point on the shape where it
    /// was, all else where the tip was. Empty of what has no place in space.
    fn places_m(&self, _trial: usize) -> Vec<[f64; 3]> {
        Vec::new()
    }

    /// Snaps of the force that was measured in a trial, which no sample is of.
    fn snaps(&self, _trial: usize) -> Vec<Snap> {
        Vec::new()
    }

    /// The same of the force that the finer model predicts at a point, found by the same rule; `None` as
    /// for [`Plant::simulate`].
    fn predicted_snaps(&self, _trial: usize, _point: &Point) -> Option<Vec<Snap>> {
        Some(Vec::new())
    }

    /// How many finer models there are that simulations can be corrected by, all as good: at a fork
    /// the tip turns on less than any model knows, and they go different ways.
    fn ways(&self) -> usize {
        1
    }

    /// Whether a simulation costs next to nothing: fits may take many steps then, and nuisances
    /// are linearised again where every fit ends, and not only where it begins.
    fn cheap(&self) -> bool;

    /// Standard deviations from which on a residual counts for less than its square ([`Loss`]).
    ///
    /// [`Loss`]: crate::fitting::loss::Loss
    fn far_off(&self) -> f64;

    /// Share of the spread of a parameter, as the trials and models in general leave it open, in which
    /// blind checks on such plants have found what was put in.
    fn spread_share(&self) -> f64 {
        1.0
    }

    /// Standard deviations of the nuisances that an effect's parameters are while they are small, in
    /// their order; `None` of an effect that is none, however small.
    fn prior_sds(&self, _effect: usize) -> Option<Vec<f64>> {
        None
    }

    /// How an effect swings; `None` of one that does not.
    fn swing(&self, _effect: usize) -> Option<Swing> {
        None
    }

    /// By how much the phase of an effect that swings differs in a trial from what its parameter says
    /// \[rad\].
    fn own_phase_rad(&self, _effect: usize, _trial: usize) -> f64 {
        0.0
    }

    /// What an effect may be mistaken for that is in no library.
    fn impostor(&self, _effect: usize) -> Option<Impostor> {
        None
    }

    /// Runs under the same motion, for the noise floor.
    fn repeats(&self) -> &[Repeat];

    /// Canned motions that the plant can simulate.
    fn segments(&self) -> &[Segment] {
        &[]
    }

    /// Predictions of a canned motion, over its noise; `None` as for [`Plant::simulate`].
    fn simulate_segment(&self, _segment: usize, _point: &Point) -> Option<Vec<f64>> {
        None
    }

    /// Why axes or units cannot be those of the model, where the plant itself can tell.
    fn complaint(&self) -> Option<&str> {
        None
    }

    /// Why "no gap" cannot be said where the floor is so large beside what was measured \[N\], and
    /// what to do; `None` where it is small enough.
    fn hidden(&self, _floor_n: f64, _measured_n: f64) -> Option<String> {
        None
    }

    /// What is wrong in rig.toml, if it is not this effect at these values; `None` where nothing of it
    /// looks like that.
    fn misstated(&self, _effect: usize, _values: &[f64]) -> Option<String> {
        None
    }

    /// What cannot be concluded from these trials, or only with a reserve, and why.
    fn remarks(&self) -> &[String];

    /// What is compared with what, in a sentence.
    fn compared(&self) -> &'static str;
}

/// Whether the catalogue says of one of two effects that it is confused with the other.
pub fn are_confused(plant: &dyn Plant, a: usize, b: usize) -> bool {
    let effects = plant.effects();
    let says = |a: usize, b: usize| effects[a].confused_with.contains(&effects[b].id);
    says(a, b) || says(b, a)
}
