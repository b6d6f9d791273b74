//! What the effects remember from tick to tick, and what they do once a tick.

use nalgebra::Vector3;

use super::nominal::Placement;
use super::{DriveTrain, EntryDrag, WallMotion};
use crate::model::{half_turn, maximum, minimum};
use crate::{Drive, Model, Outputs, Real};

/// Memory of the effects, those at the samples of the wall apart.
#[derive(Clone, Debug)]
pub(crate) struct Memory<T: Real> {
    pub train: DriveTrain<T>,
    /// Force at the drive in the last tick \[N\].
    load_n: T,
    /// Periods of the wall's motion since the run began, modulo 1.
    wall_turns: T,
    /// Elastic share of the introducer's friction: feed since it last slid \[m\].
    dragged_m: T,
    /// Where the vessel stands; `None` where the rig says.
    pub placement: Option<Placement<T>>,
    /// The guide's mouth in the vessel's frame \[m\].
    pub mouth: Vector3<T>,
}

impl<T: Real> Memory<T> {
    pub fn new() -> Self {
        Self {
            train: DriveTrain::new(),
            load_n: T::zero(),
            wall_turns: T::zero(),
            dragged_m: T::zero(),
            placement: None,
            mouth: Vector3::zeros(),
        }
    }

    /// Where the drive's motion has come to at the guide's mouth.
    pub fn follow<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        encoder: Drive<T>,
    ) -> Drive<T> {
        let description = model.description();
        let tick_s = description.solver.tick_s;
        let drive = self.train.follow(&description.effects.drive, tick_s, self.load_n, encoder);
        past_mouth(model, drive)
    }

    /// Puts the vessel where it stands at the end of a tick of `dt_s`.     docs/model.md (25), (26)
    pub fn place<const LINKS: usize>(&mut self, model: &Model<T, LINKS>, dt_s: T) {
        self.placement = model.placement;
        let Some(placement) = &mut self.placement else {
            self.mouth = model.mouth;
            return;
        };
        let motion = &model.description().effects.wall.motion;
        let turns = self.wall_turns + motion.frequency_hz * dt_s;
        self.wall_turns = turns - T::int(turns.floor_int());
        placement.offset += displacement(motion, self.wall_turns);
        self.mouth = placement.to_vessel(&model.mouth);
    }

    /// What the introducer adds to the forces, and the outputs in the rig's frame.
    ///
    /// `outputs`: in the vessel's frame, moments about the mouth; `fed_m`: feed of the tick.
    pub fn report<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        fed_m: T,
        outputs: &mut Outputs<T>,
    ) {
        let description = model.description();
        let entry = &description.effects.entry;
        let direction = Vector3::from(description.entry.direction);
        if let Some(placement) = &self.placement {
            let rig = |v: [T; 3]| placement.turned.rotate(&Vector3::from(v)).into();
            outputs.force_on_vessel_n = rig(outputs.force_on_vessel_n);
            outputs.moment_on_vessel_n_m = rig(outputs.moment_on_vessel_n_m);
        }
        if entry.guide.length_m > T::zero() {
            let force = Vector3::from(outputs.force_on_vessel_n);
            let moment = (direction * entry.guide.length_m).cross(&force);
            outputs.moment_on_vessel_n_m =
                (Vector3::from(outputs.moment_on_vessel_n_m) + moment).into();
        }
        if !entry.drag.is_off() {
            let drag_n = self.introducer(&entry.drag, fed_m, description.solver.tick_s);
            let shared = direction * (drag_n * entry.drag.phantom_share);
            outputs.drive_force_n += drag_n;
            outputs.force_on_vessel_n = (Vector3::from(outputs.force_on_vessel_n) + shared).into();
        }
        self.load_n = outputs.drive_force_n;
    }

    /// Force that the introducer's friction asks of the drive \[N\].     docs/model.md (27)
    fn introducer(&mut self, drag: &EntryDrag<T>, fed_m: T, tick_s: T) -> T {
        let most = drag.presliding_m;
        self.dragged_m = minimum(maximum(self.dragged_m + fed_m, -most), most);
        drag.coulomb_n * (self.dragged_m / most) + drag.viscous_n_s_per_m * (fed_m / tick_s)
    }
}

/// Insertion past the mouth of a guide that reaches into the vessel.
pub(crate) fn past_mouth<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    drive: Drive<T>,
) -> Drive<T> {
    let guide_m = model.description().effects.entry.guide.length_m;
    if guide_m > T::zero() {
        Drive { insertion_m: maximum(drive.insertion_m - guide_m, T::zero()), ..drive }
    } else {
        drive
    }
}

fn displacement<T: Real>(motion: &WallMotion<T>, turns: T) -> Vector3<T> {
    let (sin, _) = half_turn(turns * T::lit(core::f64::consts::TAU) + motion.phase_rad);
    Vector3::new(motion.x_m, motion.y_m, motion.z_m) * sin
}
