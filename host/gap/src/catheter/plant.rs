//! A catheter in a vessel as a [`Plant`]: prepared trials, the model that plays them, its predictions.

use std::sync::Arc;

use cathforce_bundle::geometry::SurfaceModel;
use cathforce_bundle::lumen::{BuiltLumen, LumenOptions};
use cathforce_bundle::{
    Bundle, CELL_M, LumenReport, SolverDefaults, Vessel, check_rig, to_description,
};
use cathforce_mechanics::{Description, Drag, LumenHeader};
use cathforce_recording::snap::Snap;

use super::check::{self, CatheterError};
use super::column::Source;
use super::defects::{Defects, goes_with};
use super::forks::{decided_by_forks, left_out};
use super::library::Library;
use super::motion::{self, PHASES};
use super::prepare::{self, Prepared};
use super::priors::Priors;
use super::repeats;
use super::segments::Segments;
use super::simulate::{Inputs, Setup, Simulator, Trajectory, readings};
use super::ways::{WAYS, WITHOUT_JUNCTIONS};
use crate::data::duplicate_trials::without_copies;
use crate::noise::floor;
use crate::plant::Silhouette;
use crate::plant::{
    At, Channel, Effect, Impostor, Nuisance, Plant, Point, Repeat, Sample, Segment, Swing, Trial,
};

/// A diagnosis plays every trial hundreds of times: with a quarter of the ticks of the device, and with
/// links of twice the length, also those of the tip, where that makes little difference. Predictions
/// are corrected by what a finer model changes where a fit ends.
pub(super) const COARSER: f64 = 2.0;
const TICK_S: f64 = 4e-3;
/// Standard deviations beyond which a residual is what a snap or a whip leaves.
const FAR_OFF: f64 = 3.0;
/// The predictor follows a new rate within about as much time as with short ticks …
const PREDICTOR_GAIN: f64 = 0.35;
/// … and contact sets in over so many times the device's way, so that long ticks do not chatter.
const ONSET: f64 = 3.0;
/// More damping of the wall does the same \[s\], and drag from lower speeds on. The finer model has them
/// too: corrected by one that has not, a narrowing was named beside a stream (docs/decisions/0019-coarse-model-corrected.md).
const WALL_DAMPING_S: f64 = 5e-3;
const DRAG: Drag<f64> =
    Drag { at_rest_n_s_per_m2: 0.155, swift_n_s_per_m2: 1.55, swift_m_per_s: 0.08 };
/// Share of it that varies along the vessel; the rest is a wall that is nearer everywhere, a
/// nuisance.
const WALL_LOCAL: f64 = 0.05;
/// Share of what a finer model changes that it leaves open itself: with a quarter of the step,
/// about a quarter of an error of first order is left.
const FINER_LEFT: f64 = 0.2;
/// Share of a parameter's spread in a vessel that does not divide. Of 154 intervals of 90 % in 258
/// cases, 152 contain the truth at the full width, 142 at this share of it, and 136 at half of it. Where
/// vessels divide, the full width contains it in 46 of 51: there two models of one rig differ by more.
pub(super) const SPREAD_SHARE_UNDIVIDED: f64 = 0.6;

/// Catheter bundles as a [`Plant`].
pub struct Catheter {
    pub(super) nominal: Description<f64>,
    pub(super) simulator: Simulator,
    /// By trial, lengths of its links over the device's.
    pub(super) coarser: Vec<f64>,
    /// By trial.
    pub(super) defects: Vec<Defects>,
    pub(super) library: Library,
    pub(super) channels: Vec<Channel>,
    pub(super) regimes: Vec<String>,
    pub(super) trials: Vec<Trial>,
    pub(super) prepared: Vec<Prepared>,
    pub(super) priors: Priors,
    pub(super) nuisances: Vec<Nuisance>,
    pub(super) repeats: Vec<Repeat>,
    pub(super) segments: Segments,
    pub(super) remarks: Vec<String>,
    pub(super) complaint: Option<String>,
}

impl Catheter {
    /// Prepares a bundle: the vessel, samples, what the model leaves open at each of them.
    pub fn new(bundle: &Bundle) -> Result<Self, CatheterError> {
        check::check(bundle)?;
        let radius_m = nominal(bundle)?.instrument.outer_radius_m;
        let (lumen, report) = lumen(bundle, radius_m)?;
        let mut catheter = Self::in_lumen(bundle, lumen.header, lumen.bytes)?;
        let holes = report.doubtful_openings(radius_m);
        catheter.remarks.extend(holes.map(|holes| format!("the vessel: {holes}")));
        Ok(catheter)
    }

    /// The same in a lumen that is known already, as a device image holds it.
    pub fn in_lumen(
        bundle: &Bundle,
        header: LumenHeader,
        bytes: Vec<u8>,
    ) -> Result<Self, CatheterError> {
        check::check(bundle)?;
        let nominal = nominal(bundle)?;
        let (trials, remarks) = without_copies(&bundle.trials);
        let outer_radius_m = nominal.instrument.outer_radius_m;
        let kept = trials.len() + Segments::MOST;
        let simulator = Simulator::new(header, bytes, outer_radius_m, kept);
        let mut prepared = Vec::new();
        for trial in trials {
            let own = Prepared::of(trial, &bundle.rig.sensor, TICK_S);
            prepared.push((trial.number, own.ok_or(CatheterError::NoTrials)?));
        }
        let priors = Priors::of(&bundle.rig.priors);
        let mut catheter = Self {
            library: Library { effects: Vec::new(), keys: Vec::new() },
            nominal,
            nuisances: priors.nuisances(simulator.has_junctions()),
            simulator,
            coarser: Vec::new(),
            defects: Vec::new(),
            channels: prepare::channels(prepared.iter().map(|(_, own)| own)),
            regimes: motion::regimes(),
            trials: Vec::new(),
            prepared: Vec::new(),
            priors,
            repeats: Vec::new(),
            segments: Segments::default(),
            remarks,
            complaint: None,
        };
        if catheter.channels.is_empty() {
            return Err(CatheterError::NothingMeasured);
        }
        let mut tips_m = Vec::new();
        for (number, mut own) in prepared {
            let path = catheter.add(number, &mut own)?;
            // A trial without a comparable sample tells nothing; a remark names it.
            if catheter.trials.last().is_some_and(|trial| trial.samples.is_empty()) {
                catheter.trials.pop();
                catheter.coarser.pop();
                catheter.simulator.forget(catheter.trials.len());
                continue;
            }
            tips_m.extend(path);
            catheter.prepared.push(own);
        }
        if catheter.trials.is_empty() {
            return Err(CatheterError::NothingCompared);
        }
        catheter.defects = catheter.trials.iter().map(|_| Defects::default()).collect();
        catheter.library = Library::of(&catheter.nominal, &tips_m);
        catheter.repeats = repeats::repeats(&catheter.trials, &catheter.prepared);
        catheter.segments =
            Segments::of(&catheter.prepared, &catheter.channels, &catheter.trials, TICK_S);
        catheter.remark_on_channels();
        catheter.complaint = catheter.complaint_of_turns();
        Ok(catheter)
    }

    /// Samples of one trial; gives the way of the nominal model's tip.
    fn add(&mut self, number: u32, own: &mut Prepared) -> Result<Vec<[f64; 3]>, CatheterError> {
        let trial = self.trials.len();
        let bend_m = self.nominal.instrument.precurve.iter().map(|piece| piece.length_m).sum();
        let run = |own: &Prepared, setup: &Setup| {
            let found = self.simulator.run(trial, setup, 0.0, &own.inputs);
            found.ok_or(CatheterError::Nominal(number))
        };
        let setup = Setup::from(self.nominal.clone());
        let nominal = run(own, &setup)?;
        // What the model leaves open without any effect: it is corrected by a finer one, which is
        // finite too, and the wall may stand elsewhere.
        let finer = WAYS[0].finer(&setup, &self.priors);
        let mut nearer = setup.clone();
        nearer.description.instrument.outer_radius_m += self.priors.wall_m;
        let mut half = setup.clone();
        half.description.solver.link_length_m *= COARSER;
        let (finer, nearer, half) = (run(own, &finer)?, run(own, &nearer)?, run(own, &half)?);
        own.choose_samples(&nominal);
        let nominal_at = |own: &Prepared| own.read(&nominal, &nominal.force_n, 0.0);
        let deviation = |own: &Prepared| -> Vec<f64> {
            let finer = own.read(&finer, &finer.force_n, 0.0);
            let nearer = own.read(&nearer, &nearer.force_n, 0.0);
            let changed = finer.iter().zip(&nearer).zip(nominal_at(own));
            changed.map(|((f, w), n)| (FINER_LEFT * (f - n)).hypot(WALL_LOCAL * (w - n))).collect()
        };
        let smooth = own.samples(&self.channels, &deviation(own), bend_m);
        let forked = decided_by_forks(&nominal_at(own), |way| {
            let way = WAYS[..ways(&self.simulator)].get(way)?;
            let found = run(own, &way.apply(&setup, &self.priors)).ok()?;
            Some(own.read(&found, &found.force_n, 0.0))
        });
        let decided = left_out(&smooth, &forked);
        let is_force = |sample: &Sample| self.channels[sample.channel].quantity.is_force();
        let places = smooth.iter().zip(At::of_samples(&smooth)).zip(&decided);
        let forks = places.filter(|((sample, _), decided)| **decided && is_force(sample));
        let forks = forks.map(|((_, at), _)| at).collect();
        own.leave_out(&decided);
        let kept = forked.iter().zip(&decided).filter(|(_, decided)| !**decided);
        let open =
            deviation(own).into_iter().zip(kept).map(|(own, (forked, _))| own.hypot(*forked));
        let samples = own.samples(&self.channels, &open.collect::<Vec<f64>>(), bend_m);
        self.remarks.extend(own.remarks(number));
        let (start_s, start_m) = (own.start_s(), own.inputs.insertion_m[0]);
        let half = own.read(&half, &half.force_n, 0.0);
        let finer = own.read(&finer, &finer.force_n, 0.0);
        let changed: Vec<f64> = finer.iter().zip(&half).map(|(f, h)| f - h).collect();
        self.coarser.push(if goes_with(&changed, &samples) { COARSER } else { 1.0 });
        let blocks = prepare::BLOCKS;
        self.trials.push(Trial { number, start_s, start_m, samples, blocks, forks });
        Ok(nominal.tip_m.clone())
    }

    /// Predictions of all samples of a trial, not corrected; `None` when a simulation breaks down.
    pub(super) fn uncorrected(
        &self,
        trial: usize,
        setup: Setup,
        nuisances: &[f64],
    ) -> Option<Vec<f64>> {
        let own = self.prepared.get(trial)?;
        let Played { found, force_n, shift_s } = self.play(trial, &own.inputs, setup, nuisances)?;
        Some(own.read(&found, &force_n, shift_s))
    }

    /// The same with the links that a trial is played with.
    pub(super) fn coarse(
        &self,
        trial: usize,
        mut setup: Setup,
        nuisances: &[f64],
    ) -> Option<Vec<f64>> {
        setup.description.solver.link_length_m *= self.coarser.get(trial)?;
        self.uncorrected(trial, setup, nuisances)
    }

    /// `slot`: where the simulator keeps what it found.
    pub(super) fn play(
        &self,
        slot: usize,
        inputs: &Inputs,
        mut setup: Setup,
        nuisances: &[f64],
    ) -> Option<Played> {
        let (of_any, junctions) = nuisances.split_first_chunk::<{ Priors::OF_ANY }>()?;
        let [bias @ .., shift_s, offset_m, x, y, z, tilt_x, tilt_y, tilt_z, nearer_m] = of_any;
        let description = &mut setup.description;
        let registration = &mut description.effects.wall.registration;
        registration.x_m += x;
        registration.y_m += y;
        registration.z_m += z;
        registration.tilt_x_rad += tilt_x;
        registration.tilt_y_rad += tilt_y;
        registration.tilt_z_rad += tilt_z;
        description.instrument.outer_radius_m += nearer_m;
        setup.junctions_m += match junctions {
            [] => 0.0,
            [junctions_m] => *junctions_m,
            _ => return None,
        };
        // The sensor acts after the mechanics: trajectories are kept without it.
        let mut mechanics = setup.clone();
        mechanics.description.effects.sensor = self.nominal.effects.sensor;
        let found = self.simulator.run(slot, &mechanics, *offset_m, inputs)?;
        let mut force_n = readings(&setup.description, inputs, &found);
        for force in &mut force_n {
            force.iter_mut().zip(bias).for_each(|(f, bias)| *f += bias);
        }
        Some(Played { found, force_n, shift_s: *shift_s })
    }

    /// The finer model of a trial, on the way that it goes.
    pub(super) fn finer(&self, trial: usize, point: &Point) -> Option<Setup> {
        let description = self.library.describe(&self.nominal, point)?;
        Some(WAYS.get(way(trial, point))?.finer(&description.into(), &self.priors))
    }

    pub(super) fn remark_on_channels(&mut self) {
        // One axis, one point for all that are alike.
        for source in [Source::Force(0), Source::DriveForce, Source::Tip(0), Source::Shape(0, 0)] {
            let noise = self.prepared.iter().filter_map(|own| own.estimated_noise(source));
            let noise: Vec<f64> = noise.collect();
            if !noise.is_empty() {
                self.remarks.push(floor::unstated(&source.channel().name, &noise));
            }
            let understated = self.prepared.iter().filter_map(|own| own.understated_noise(source));
            let most = understated.max_by(|a, b| a[1].total_cmp(&b[1]));
            if let Some([stated, found]) = most {
                self.remarks.push(floor::understated(&source.channel().name, stated, found));
            }
        }
        for (source, what) in [
            (
                Source::Force(0),
                "no force was measured: effects that show only in it cannot be named",
            ),
            (
                Source::Tip(0),
                "no tip was measured: stiffness, pre-curve and wall are told apart poorly",
            ),
            (
                Source::DriveForce,
                "no drive force was measured: what acts outside the vessel (introducer, drive) \
                 cannot be told from what acts inside",
            ),
        ] {
            if !self.prepared.iter().any(|own| own.has(source)) {
                self.remarks.push(what.to_owned());
            }
        }
    }
}

/// One motion played by the model.
pub(super) struct Played {
    pub(super) found: Arc<Trajectory>,
    /// What the sensor reads, one a tick.
    pub(super) force_n: Vec<[f64; 3]>,
    /// It is read later by this.
    pub(super) shift_s: f64,
}

impl Plant for Catheter {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn phases(&self) -> &[&'static str] {
        &PHASES
    }

    fn regimes(&self) -> &[String] {
        &self.regimes
    }

    fn trials(&self) -> &[Trial] {
        &self.trials
    }

    fn effects(&self) -> &[Effect] {
        &self.library.effects
    }

    fn nuisances(&self) -> &[Nuisance] {
        &self.nuisances
    }

    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>> {
        if point.anchor.is_everywhere {
            return self.uncorrected(trial, self.finer(trial, point)?, &point.nuisances);
        }
        let description = self.library.describe(&self.nominal, point)?;
        let way = way(trial, point);
        let anchor = Point { effects: point.anchor.effects.to_vec(), ..point.clone() };
        let anchor = self.library.describe(&self.nominal, &anchor)?;
        self.predict(trial, &description.into(), &point.nuisances, (&anchor.into(), way))
    }

    fn along(&self, trial: usize, channel: usize) -> f64 {
        self.prepared[trial].along(&self.channels[channel])
    }

    fn vessel(&self) -> Option<Silhouette> {
        self.simulator.silhouette(self.nominal.entry.position_m)
    }

    fn places_m(&self, trial: usize) -> Vec<[f64; 3]> {
        let Some(own) = self.prepared.get(trial) else { return Vec::new() };
        // The first one of a trial that is kept: nothing is simulated again.
        let nominal = self.simulator.run(trial, &self.nominal.clone().into(), 0.0, &own.inputs);
        nominal.map(|nominal| own.places_m(&nominal)).unwrap_or_default()
    }

    fn prior_sds(&self, effect: usize) -> Option<Vec<f64>> {
        let own = self.library.effects.get(effect)?;
        (own.id == "wall.registration").then(|| self.priors.of_registration(&own.parameters))
    }

    fn snaps(&self, trial: usize) -> Vec<Snap> {
        self.prepared.get(trial).map(Prepared::measured_snaps).unwrap_or_default()
    }

    fn predicted_snaps(&self, trial: usize, point: &Point) -> Option<Vec<Snap>> {
        let own = self.prepared.get(trial)?;
        let finer = self.finer(trial, point)?;
        let Played { force_n, shift_s, .. } =
            self.play(trial, &own.inputs, finer, &point.nuisances)?;
        Some(own.predicted_snaps(&force_n, shift_s))
    }

    fn ways(&self) -> usize {
        ways(&self.simulator)
    }

    fn cheap(&self) -> bool {
        false
    }

    fn far_off(&self) -> f64 {
        FAR_OFF
    }

    fn swing(&self, effect: usize) -> Option<Swing> {
        self.library.swing(effect, &self.nuisances)
    }

    fn impostor(&self, effect: usize) -> Option<Impostor> {
        self.library.impostor(effect, &self.nuisances)
    }

    fn repeats(&self) -> &[Repeat] {
        &self.repeats
    }

    fn spread_share(&self) -> f64 {
        spread_share(&self.simulator)
    }

    fn segments(&self) -> &[Segment] {
        &self.segments.list
    }

    fn simulate_segment(&self, segment: usize, point: &Point) -> Option<Vec<f64>> {
        let description = self.library.describe(&self.nominal, point)?;
        let inputs = self.segments.inputs(segment)?;
        let slot = self.trials.len() + segment;
        let Played { found, force_n, shift_s } =
            self.play(slot, inputs, description.into(), &point.nuisances)?;
        self.segments.read(segment, &found, &force_n, shift_s)
    }

    fn complaint(&self) -> Option<&str> {
        self.complaint.as_deref()
    }

    fn remarks(&self) -> &[String] {
        &self.remarks
    }

    fn compared(&self) -> &'static str {
        "measured forces (means over 20 ms), tip and shape with those of the device's own model, fed \
         with the measured insertion and rotation"
    }
}

/// Which of [`WAYS`] a trial goes.
fn way(trial: usize, point: &Point) -> usize {
    point.anchor.ways.get(trial).copied().unwrap_or_default()
}

/// How many of [`WAYS`] a vessel has.
fn ways(simulator: &Simulator) -> usize {
    if simulator.has_junctions() { WAYS.len() } else { WITHOUT_JUNCTIONS }
}

/// [`Plant::spread_share`] of what is played in a vessel.
pub(super) fn spread_share(simulator: &Simulator) -> f64 {
    if simulator.has_junctions() { 1.0 } else { SPREAD_SHARE_UNDIVIDED }
}

/// The vessel of a bundle as a device with that instrument sees it.
pub(super) fn lumen(
    bundle: &Bundle,
    radius_m: f64,
) -> Result<(BuiltLumen, LumenReport), CatheterError> {
    let vessel = Vessel::from_bundle(bundle, SurfaceModel::default())?;
    Ok(vessel.lumen(LumenOptions::for_instrument(radius_m, CELL_M))?)
}

/// What rig.toml states, with the diagnosis' ticks.
pub(super) fn nominal(bundle: &Bundle) -> Result<Description<f64>, CatheterError> {
    let device = SolverDefaults::default();
    let defaults = SolverDefaults {
        tick_s: TICK_S,
        predictor_gain: PREDICTOR_GAIN,
        onset_m: ONSET * device.onset_m,
        wall_damping_s: WALL_DAMPING_S,
        drag: DRAG,
        ..device
    };
    let nominal = to_description::<f64>(bundle, &defaults).ok_or(CatheterError::NoTrials)?;
    check_rig(bundle, &nominal).map_err(Box::new)?;
    Ok(nominal)
}
