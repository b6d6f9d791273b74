//! What the sweeps of a step see: the links of one catheter, or those of several abreast.

use cathforce_scalar::{Catheters, Vector3};

use crate::effects::driven_tendons::TendonCell;
use crate::effects::relaxation::Springs;
use crate::joint::Cell;
use crate::math::maximum;
use crate::scheme::Scheme;
use crate::state::{Elimination, LinkState, State};
use crate::tables::Tables;
use crate::{Model, Real, Wall};

/// Links inside the vessel, from the tip to the guide.
///
/// Abreast, a chain that is shorter than the longest has its guide where its next link would be, and what
/// is computed beyond it has no meaning.
pub(crate) struct Chain<'a, S: Catheters, const LINKS: usize> {
    pub links: &'a mut [LinkState<S>; LINKS],
    pub eliminations: &'a mut [Elimination<S>; LINKS],
    pub count: S::Count,
    /// Number of links of the shortest and of the longest chain.
    pub shortest: usize,
    pub longest: usize,
    pub guide: &'a LinkState<S>,
    pub mouth: &'a Vector3<S>,
    /// `None` for catheters abreast, which have neither tendons nor effects. References to arrays take less of the
    /// device's stack than slices.
    pub tendon_cells: Option<&'a [TendonCell<S>; LINKS]>,
    pub springs: Option<&'a Springs<S, LINKS>>,
    /// As in [`State`].
    pub fed_m: S,
    pub momentum_share: S,
    /// τ/dt: viscous time of bending over the time step.
    pub damping: S,
    /// Cells of the two joints at the base link, the guide's first. All other cells are full.
    pub at_base: [Cell<S>; 2],
}

/// What a solve reads of the model.
pub(crate) struct Body<'a, S: Catheters, const LINKS: usize> {
    pub tables: &'a Tables<S, LINKS>,
    pub wall: &'a Wall<S>,
    pub gravity: &'a Vector3<S>,
    /// Outer radius of the catheter \[m\].
    pub radius_m: S,
    /// Bending is viscous.
    pub is_viscous: bool,
}

/// [`Chain::damping`] and [`Chain::at_base`] of one catheter.
#[inline(always)]
pub(crate) fn base_cells<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    state: &State<T, LINKS>,
    scheme: &Scheme<T>,
) -> (T, [Cell<T>; 2]) {
    let grid = &model.grid;
    let half = T::lit(0.5);
    let damping = model.bending_damping_s * scheme.inertia / scheme.dt_s;
    let count = state.count.min(LINKS);
    let [base, before] = [1, 2].map(|behind| count.saturating_sub(behind));
    let guide_cell_m = state.guide_cell_m(model);
    let base_cell_m = (grid.link_m(before) + state.base_length_m) * half;
    // Half of the withdrawn arc leaves each of the two cells, and is as bent as the cell.
    let withdrawn_m = maximum(-state.fed_m, T::zero()) * half;
    // The guide's cell can be very short and its shaft winds up. Viscous twist keeps its torsional
    // stiffness within what single precision resolves beside the bending stiffness.
    let at_guide = Cell::new(guide_cell_m, grid.cell_m(base), withdrawn_m, [damping; 2]);
    let of_bending = [damping, T::zero()];
    let at_base = Cell::new(base_cell_m, grid.cell_m(before), withdrawn_m, of_bending);
    (damping, [at_guide, at_base])
}

impl<'a, T: Real, const LINKS: usize> Body<'a, T, LINKS> {
    /// `tables`: of the chain, which are not the model's if two instruments share it.
    #[inline(always)]
    pub fn of(model: &'a Model<T, LINKS>, tables: &'a Tables<T, LINKS>) -> Self {
        Self {
            tables,
            wall: &model.wall,
            gravity: &model.gravity,
            radius_m: model.description().instrument.outer_radius_m,
            is_viscous: model.bending_damping_s > T::zero(),
        }
    }
}

impl<'a, T: Real, const LINKS: usize> Chain<'a, T, LINKS> {
    /// The chain of one catheter, and the tables of two instruments that share it.
    #[inline(always)]
    pub fn of(
        state: &'a mut State<T, LINKS>,
        (damping, at_base): (T, [Cell<T>; 2]),
    ) -> (Self, &'a Tables<T, LINKS>) {
        let State {
            links,
            eliminations,
            count,
            guide,
            effects,
            tendons,
            springs,
            fed_m,
            momentum_share,
            coaxial_tables,
            ..
        } = state;
        let count = (*count).min(LINKS);
        let chain = Self {
            links,
            eliminations,
            count,
            shortest: count,
            longest: count,
            guide,
            mouth: &effects.mouth,
            tendon_cells: Some(&tendons.cells),
            springs: Some(springs),
            fed_m: *fed_m,
            momentum_share: *momentum_share,
            damping,
            at_base,
        };
        (chain, coaxial_tables)
    }
}
