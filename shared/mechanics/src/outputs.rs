//! What a step says: forces on the vessel and on the drives, the peak of the contact, and whether it is
//! resolved.

use cathforce_scalar::{Catheters, Number, Vector3};

use crate::load_sharing::DriveLoad;
use crate::solve::{STRAINS, Totals};
use crate::state::LinkState;
use crate::{Model, Outputs, Real, State};

/// A step whose last solve turned a link by more than this is flagged as unresolved \[rad\].
///
/// The linear model misplaces the tip by about ½ length × turn². That is 1 µm on 90 mm, and a wall
/// of 600 N/m at a sample changes its force by less than 1 mN. Snaps turn links by tenths of a
/// radian.
const RESOLVED_TURN_RAD: f64 = 5e-3;

/// The largest of all links.
pub(crate) struct Peaks<S, I> {
    /// Square of the contact force \[N²\], and the node with it.
    pub force_squared: S,
    pub node: I,
    /// Square of the strain less the middle of its range \[1\].
    pub stretched_squared: S,
}

impl<S: Catheters> Peaks<S, S::Index> {
    #[inline(always)]
    pub fn of(links: &[LinkState<S>], counts: S::Count) -> Self {
        let (mut peak, mut node) = (S::lit(0.0), S::index(0));
        let (middle, _) = strain_range::<S>();
        let mut stretched_squared = S::lit(0.0);
        for (j, link) in links.iter().enumerate() {
            let present = S::present(counts, j);
            let squared = link.force.dot(&link.force);
            let counted = S::either(present, || squared, || peak);
            (peak, node) =
                S::either(peak.below(counted), || (counted, S::index(j)), || (peak, node));
            let strain = link.strain - middle;
            let stretched = S::either(present, || strain * strain, || stretched_squared);
            let is_larger = stretched.reaches(stretched_squared);
            stretched_squared = S::either(is_larger, || stretched, || stretched_squared);
        }
        Self { force_squared: peak, node, stretched_squared }
    }
}

/// docs/explanation/model.md (22)
#[inline(always)]
pub(crate) fn collect_outputs<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    totals: &Totals<T>,
    peaks: &Peaks<T, u16>,
) -> Outputs<T> {
    let direction = model.guide.tangent();
    let moment = &totals.moment_on_guide;
    let twist = moment.dot(&direction);
    let mouth = if state.count == 0 {
        T::zero()
    } else {
        configurational_force_n(model, state, moment, twist)
    };
    let Peaks { force_squared, node, stretched_squared } = *peaks;
    let (_, half_range) = strain_range::<T>();
    let overstretched = stretched_squared >= half_range * half_range;
    let limit = T::lit(RESOLVED_TURN_RAD * RESOLVED_TURN_RAD);
    let whole =
        DriveLoad { force_n: -totals.force_on_guide.dot(&direction) - mouth, torque_n_m: -twist };
    let none = DriveLoad { force_n: T::zero(), torque_n_m: T::zero() };
    let guidewire = state.guidewire_share(model, whole).unwrap_or(none);
    Outputs {
        force_on_vessel_n: (-totals.force_on_instrument).into(),
        moment_on_vessel_n_m: (-totals.moment_on_instrument).into(),
        drive_force_n: whole.force_n - guidewire.force_n,
        drive_torque_n_m: whole.torque_n_m - guidewire.torque_n_m,
        guidewire_force_n: guidewire.force_n,
        guidewire_torque_n_m: guidewire.torque_n_m,
        peak_contact_force_n: force_squared.root(),
        peak_node: node,
        links: state.count as u16,
        unresolved: totals.largest_turn_squared > limit || state.outside || overstretched,
        lost: false,
    }
}

/// Configurational force at the guide's mouth \[N\]: the bending energy per length that insertion
/// would release, by which a bent instrument is pulled in.     docs/explanation/model.md (23)
fn configurational_force_n<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    moment: &Vector3<T>,
    twist: T,
) -> T {
    let half = T::lit(0.5);
    let base = state.count.saturating_sub(1).min(LINKS - 1);
    let (joint, h) = (&state.tables(model).joints[base], model.grid.cell_m(base));
    let softness = state.effects.softness(model);
    let bend_squared = moment.dot(moment) - twist * twist;
    let per_stiffness = half / (h * softness);
    // A pre-curvature that only comes back past the mouth releases no energy at the mouth.
    let straightened = model.description().effects.entry.guide.straightened_m > T::zero();
    let straight = if straightened { T::zero() } else { T::one() / h };
    // Tendons bend the instrument like a pre-curvature.
    let bend_by_tendons = state.effects.tendon_bend_at_mouth() + state.tendons.at_mouth;
    let unloaded = joint.unloaded * straight + bend_by_tendons * (T::one() / h);
    let spent = moment.dot(&state.guide.rotation.rotate(&unloaded))
        + half * h * softness * joint.energy(&unloaded);
    per_stiffness * (bend_squared / joint.bending + twist * twist / joint.torsion) + spent
}

/// Outputs of a step whose results are not finite.
pub(crate) fn lost_outputs<T: Real>() -> Outputs<T> {
    Outputs { unresolved: true, lost: true, ..Outputs::default() }
}

/// Middle and half length of the range [`STRAINS`].
fn strain_range<T: Number>() -> (T, T) {
    let half = 0.5 * (STRAINS.end - STRAINS.start);
    (T::lit(STRAINS.start + half), T::lit(half))
}

/// Every link contributes to the total force, so a number that is not finite anywhere shows in it.
pub(crate) fn is_finite<T: Real>(outputs: &Outputs<T>) -> bool {
    let sum = |v: &[T; 3]| v[0] + v[1] + v[2];
    let wrench = sum(&outputs.force_on_vessel_n) + sum(&outputs.moment_on_vessel_n_m);
    let catheter = outputs.drive_force_n + outputs.drive_torque_n_m;
    let guidewire = outputs.guidewire_force_n + outputs.guidewire_torque_n_m;
    (wrench + catheter + guidewire).is_finite()
}
