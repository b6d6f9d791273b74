//! State of the effects between ticks, and the parts of them that act once per step.

use cathforce_scalar::Vector3;

use super::active::{ActiveEffects, Straightened, Windup};
use super::fluid::FluidForce;
use super::nominal::Placement;
use super::tendon::{TendonBend, TendonState};
use super::wall_law::WallLaw;
use super::{DriveTrain, EntryDrag, WallMotion};
use crate::math::{maximum, minimum, sin_cos};
use crate::overlap::Overlap;
use crate::{Drive, Drives, Model, Outputs, Real};

/// Largest change of the shaft's wind-up in a solve \[rad\]; the joint at the entry is linearised in
/// it.
const LARGEST_UNWINDING_RAD: f64 = 0.2;
/// Time constant of the filter on the drives' speed \[s\]; an encoder moves in whole counts.
const SPEED_TIME_S: f64 = 0.01;

/// State of the effects, except for the relaxation at the contacts.
#[derive(Clone, Debug)]
pub(crate) struct EffectState<T: Real> {
    pub drive_train: DriveTrain<T>,
    /// Force at the drive in the last tick \[N\].
    load_n: T,
    /// Phase of the wall's motion \[periods, modulo 1\].
    wall_turns: T,
    /// Insertion past the introducer, and its change in the last tick \[m\].
    entered_m: Option<T>,
    entered_by_m: T,
    /// Presliding displacement of the introducer's friction \[m\].
    dragged_m: T,
    /// Accumulated feed since the run began, in both directions \[m\].
    path_m: T,
    /// Filtered speed of the faster instrument's surface at the mouth \[m/s\].
    speed_m_per_s: T,
    /// Share of the softening that has happened, 0 to 1.
    softened: T,
    /// Phase of the fluid's pulse \[periods, modulo 1\].
    pulses: T,
    /// Twist of the shaft behind the entry plane \[rad\].
    pub wound_rad: T,
    tendon: TendonState<T>,
    /// Placement of the vessel; `None` if its frame is the rig's.
    pub placement: Option<Placement<T>>,
    /// Mouth of the guide in the vessel's frame \[m\].
    pub mouth: Vector3<T>,
    /// Displacement of the mouth in that frame in this step \[m\], and its velocity in the last one
    /// \[m/s\].
    vessel_moved_m: Vector3<T>,
    vessel_m_per_s: Vector3<T>,
    has_stood: bool,
}

impl<T: Real> EffectState<T> {
    pub const fn new() -> Self {
        Self {
            drive_train: DriveTrain::new(),
            load_n: T::ZERO,
            wall_turns: T::ZERO,
            entered_m: None,
            entered_by_m: T::ZERO,
            dragged_m: T::ZERO,
            path_m: T::ZERO,
            speed_m_per_s: T::ZERO,
            softened: T::ZERO,
            pulses: T::ZERO,
            wound_rad: T::ZERO,
            tendon: TendonState::new(),
            placement: None,
            mouth: T::ORIGIN,
            vessel_moved_m: T::ORIGIN,
            vessel_m_per_s: T::ORIGIN,
            has_stood: false,
        }
    }

    /// Position of the catheter at the guide's mouth for the encoder's position.
    pub fn follow<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        encoder: Drive<T>,
    ) -> Drive<T> {
        let description = model.description();
        let tick_s = description.solver.tick_s;
        let drive =
            self.drive_train.follow(&description.effects.drive, tick_s, self.load_n, encoder);
        // Insertion past the introducer, whatever the guide's length and the reach of the links.
        let before_m = self.entered_m.replace(drive.insertion_m).unwrap_or(drive.insertion_m);
        self.entered_by_m = drive.insertion_m - before_m;
        past_mouth(model, drive)
    }

    /// Places the vessel at the end of a step of `dt_s`.     docs/explanation/model.md (36), (37)
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
        let before = core::mem::replace(&mut self.mouth, placement.to_vessel(&model.mouth));
        let (none, zero) = (Vector3::zeros(), T::zero());
        let last = core::mem::replace(&mut self.vessel_moved_m, none);
        // The first placement of a run is not a motion.
        let has_stood = core::mem::replace(&mut self.has_stood, true);
        self.vessel_moved_m = if has_stood { self.mouth - before } else { none };
        self.vessel_m_per_s = if dt_s > zero { last * (T::one() / dt_s) } else { none };
    }

    /// Advances wear, speed, softening and pulse by a step of `dt_s`, in which the chain was fed by
    /// `fed_m`.
    pub fn advance<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        before: &Drives<T>,
        now: &Drives<T>,
        fed_m: T,
        dt_s: T,
    ) {
        if !model.has_active_effects {
            return;
        }
        let effects = &model.description().effects;
        self.path_m += maximum(fed_m, -fed_m);
        let time_s = T::lit(SPEED_TIME_S);
        let surface_travel_m =
            surface_travel_m(model.description().instrument.outer_radius_m, before, now);
        self.speed_m_per_s = (self.speed_m_per_s * time_s + surface_travel_m) / (time_s + dt_s);
        // Implicit Euler of an exponential.     docs/explanation/model.md (43)
        let steps = dt_s / effects.instrument.softening.time_s;
        self.softened = (self.softened + steps) / (T::one() + steps);
        let pulses = self.pulses + effects.fluid.drag.frequency_hz * dt_s;
        self.pulses = pulses - T::int(pulses.floor_int());
    }

    /// The flow at present; `None` without flow.
    pub fn fluid_force<const LINKS: usize>(
        &self,
        model: &Model<T, LINKS>,
    ) -> Option<FluidForce<T>> {
        let drag = &model.description().effects.fluid.drag;
        (!drag.is_off()).then(|| FluidForce::new(drag, self.pulses))
    }

    /// The effects in the recursion for a step of `dt_s`, without driven tendons; `None` if there are none.
    ///
    /// `entry`: index of the joint at the entry plane; `guide_cell_m`: arc of its cell \[m\].
    pub fn active<'a, const LINKS: usize>(
        &self,
        model: &Model<T, LINKS>,
        insertion_m: T,
        overlap: &Overlap<T>,
        entry: usize,
        guide_cell_m: T,
        dt_s: T,
    ) -> Option<ActiveEffects<'a, T>> {
        if !model.has_active_effects {
            return None;
        }
        let description = model.description();
        let effects = &description.effects;
        let grid = &model.grid;
        let straightened_m = effects.entry.guide.straightened_m;
        let straightened = (straightened_m > T::zero()).then(|| Straightened {
            grid: *grid,
            past_mouth: insertion_m * (T::one() / grid.link_length_m),
            per_link: grid.link_length_m / straightened_m,
        });
        Some(ActiveEffects {
            wall: WallLaw::new(effects, model.least_stretch, self.path_m, self.speed_m_per_s, dt_s),
            fluid: self.fluid_force(model),
            tendon: TendonBend::new(description, &model.grid, overlap, &self.tendon),
            tendons: None,
            softness: self.softness(model),
            vessel_motion: [self.vessel_moved_m, self.vessel_m_per_s],
            straightened,
            windup: Windup {
                compliance: model.windup_rad_per_n_m,
                wound_rad: self.wound_rad,
                entry,
                guide_cell: guide_cell_m * (T::one() / grid.cell_m(entry)),
                twisting: T::one(),
            },
        })
    }

    /// Stiffness of the instrument after softening, over the nominal one \[1\].
    /// docs/explanation/model.md (43)
    pub fn softness<const LINKS: usize>(&self, model: &Model<T, LINKS>) -> T {
        T::one() - model.description().effects.instrument.softening.share * self.softened
    }

    /// Bend of the cell at the guide's mouth by a tendon, material axes \[rad\].
    pub fn tendon_bend_at_mouth(&self) -> Vector3<T> {
        self.tendon.at_mouth
    }

    /// Updates tendon and wind-up after a solve. `torque_n_m`: torque of the instrument on the guide,
    /// about the direction of insertion.
    pub fn finish(&mut self, active: &ActiveEffects<'_, T>, torque_n_m: T) {
        if let Some(tendon) = &active.tendon {
            tendon.finish(&mut self.tendon);
        }
        // docs/explanation/model.md (44)
        let most = T::lit(LARGEST_UNWINDING_RAD);
        let Windup { compliance, twisting, .. } = active.windup;
        let change = (compliance * torque_n_m - self.wound_rad) * twisting;
        self.wound_rad += minimum(maximum(change, -most), most);
    }

    /// Converts `outputs` to the rig's frame with moments about the entry point, and adds the friction of
    /// the introducer.
    ///
    /// `outputs`: in the vessel's frame, with moments about the mouth.
    pub fn report<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        outputs: &mut Outputs<T>,
    ) {
        let description = model.description();
        let entry = &description.effects.entry;
        let direction = Vector3::from(description.entry.direction);
        if let Some(placement) = &self.placement {
            let rig = |v: [T; 3]| placement.direction_to_rig(&Vector3::from(v)).into();
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
            let drag_n = self.introducer_drag_n(&entry.drag, description.solver.tick_s);
            let shared = direction * (drag_n * entry.drag.phantom_share);
            outputs.drive_force_n += drag_n;
            outputs.force_on_vessel_n = (Vector3::from(outputs.force_on_vessel_n) + shared).into();
        }
        self.load_n = outputs.drive_force_n;
    }

    /// Force at the drive against the introducer's friction \[N\].     docs/explanation/model.md (46)
    fn introducer_drag_n(&mut self, drag: &EntryDrag<T>, tick_s: T) -> T {
        let (most, fed_m) = (drag.presliding_m, self.entered_by_m);
        self.dragged_m = minimum(maximum(self.dragged_m + fed_m, -most), most);
        drag.coulomb_n * (self.dragged_m / most) + drag.viscous_n_s_per_m * (fed_m / tick_s)
    }
}

/// Travel of the faster instrument's surface at the mouth, along and about its axis \[m\].
fn surface_travel_m<T: Real>(radius_m: T, before: &Drives<T>, now: &Drives<T>) -> T {
    let squared = |before: &Drive<T>, now: &Drive<T>| {
        let along = now.insertion_m - before.insertion_m;
        let about = (now.rotation_rad - before.rotation_rad) * radius_m;
        along * along + about * about
    };
    let catheter = squared(&before.catheter, &now.catheter);
    maximum(catheter, squared(&before.guidewire, &now.guidewire)).root()
}

/// Position of a drive, with the insertion counted from the mouth of a guide that reaches into the
/// vessel.
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
    let (sin, _) = sin_cos(turns * T::lit(core::f64::consts::TAU) + motion.phase_rad);
    Vector3::new(motion.x_m, motion.y_m, motion.z_m) * sin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_moves_by_feed_and_turn_and_the_faster_one_counts() {
        let at = |insertion_m, rotation_rad| Drive { insertion_m, rotation_rad };
        let moved = |catheter: Drive<f64>, guidewire: Drive<f64>| {
            let start = at(0.1, 1.0);
            let tendons_m = [0.0; 4];
            let before = Drives { catheter: start, guidewire: start, tendons_m };
            surface_travel_m(1e-3, &before, &Drives { catheter, guidewire, tendons_m })
        };
        let is = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-15, "{found}");
        is(moved(at(0.1, 1.0), at(0.1, 1.0)), 0.0);
        is(moved(at(0.1 - 3e-6, 1.004), at(0.1, 1.0)), 5e-6);
        is(moved(at(0.1, 1.0), at(0.1 + 7e-6, 1.0)), 7e-6);
    }
}
