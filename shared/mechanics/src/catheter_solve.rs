//! One solve of a catheter, with its effects and its guidewire, and before the first one of a step the
//! samples of the wall.

use cathforce_scalar::{Kernel, PlainPack};

use crate::chain::{Body, Chain, base_cells};
use crate::coaxial::Coaxial;
use crate::effects::active::{Law, Nominal};
use crate::effects::driven_tendons::DrivenTendons;
use crate::scheme::Scheme;
use crate::solve::{Totals, solve};
use crate::wall_sampling::{OUTSIDE_M, Stored, sample_wall};
use crate::{Loads, Lumen, Model, Real, State};

/// One solve, with the effects and the guidewire if there are any.
pub(crate) fn solve_catheter<T: Real, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
) -> Totals<T> {
    let entry = state.count.saturating_sub(1);
    let guide_cell_m = state.guide_cell_m(model);
    match state.effects.active(
        model,
        state.insertion_m,
        &state.overlap,
        entry,
        guide_cell_m,
        scheme.dt_s,
    ) {
        None => solve_coaxial(model, lumen, state, loads, scheme, &mut Nominal),
        Some(mut active) => {
            state.prepare_springs(model, scheme);
            active.tendons = DrivenTendons::new(
                &model.tendons,
                &model.grid,
                &state.overlap,
                &state.tendons,
                scheme.inertia > T::zero(),
            );
            let totals = solve_coaxial(model, lumen, state, loads, scheme, &mut active);
            let torque_n_m = totals.moment_on_guide.dot(&model.guide.tangent());
            state.effects.finish(&active, torque_n_m);
            if let Some(tendons) = &mut active.tendons {
                finish_tendons(state, tendons);
            }
            state.relax_springs(model, scheme);
            totals
        }
    }
}

/// Paths and tensions of the driven tendons after a solve.
// A frame of its own: the solve's is the deepest of a tick.
#[inline(never)]
fn finish_tendons<T: Real, const LINKS: usize>(
    state: &mut State<T, LINKS>,
    tendons: &mut DrivenTendons<'_, T>,
) {
    let State { links, guide, count, tendons: pulled, .. } = state;
    let links = &links[..(*count).min(LINKS)];
    let rotation = |j: usize| links.get(j).map_or(&guide.rotation, |link| &link.rotation);
    tendons.finish(links.len(), rotation, pulled);
}

fn solve_coaxial<T: Real, L: Law<T>, const LINKS: usize>(
    model: &Model<T, LINKS>,
    lumen: &Lumen<'_>,
    state: &mut State<T, LINKS>,
    loads: &Loads<T>,
    scheme: &Scheme<T>,
    effects: &mut L,
) -> Totals<T> {
    let overlap = state.overlap;
    match Coaxial::new(model, &overlap, scheme, effects) {
        Some(mut both) => {
            T::run_vectorised(SolveKernel { model, lumen, state, loads, scheme, law: &mut both })
        }
        None => T::run_vectorised(SolveKernel { model, lumen, state, loads, scheme, law: effects }),
    }
}

/// One solve, and before the first one of a step the samples of the wall: the part of a step that is
/// computed for several links at a time, one in each lane.
struct SolveKernel<'a, 'l, T: Real, L, const LINKS: usize> {
    model: &'a Model<T, LINKS>,
    lumen: &'a Lumen<'l>,
    state: &'a mut State<T, LINKS>,
    loads: &'a Loads<T>,
    scheme: &'a Scheme<T>,
    law: &'a mut L,
}

impl<T: Real, L: Law<T>, const LINKS: usize> Kernel<T> for SolveKernel<'_, '_, T, L, LINKS> {
    type Output = Totals<T>;

    #[inline(always)]
    fn run<N: PlainPack<T>>(self) -> Totals<T> {
        let Self { model, lumen, state, loads, scheme, law } = self;
        state.nodes_sampled ^= scheme.first;
        let of_nodes = state.nodes_sampled;
        let cells = base_cells(model, state, scheme);
        let (mut chain, coaxial_tables) = Chain::of(state, cells);
        let body = Body::of(model, if L::COAXIAL { coaxial_tables } else { &model.tables });
        let lowest_m = scheme.first.then(|| {
            let lumen = Stored::<T>::new(lumen);
            sample_wall::<T, N, LINKS>(&mut chain, of_nodes, body.radius_m, &lumen, law)
        });
        let totals = solve::<T, N, L, LINKS>(&body, &mut chain, loads, scheme, law);
        if let Some(lowest_m) = lowest_m {
            state.outside = lowest_m < T::lit(OUTSIDE_M);
        }
        totals
    }
}
