//! Catheters abreast: several independent ones are stepped together, one in each lane of the processor's
//! packs.
//!
//! The equations are those of a single catheter, in [`crate::solve`] and its neighbours, computed with
//! [`Abreast`] in place of a number. What a step does once, and not for each link, is done for one catheter
//! after the other by the same functions.

use alloc::vec;
use alloc::vec::Vec;

use cathforce_scalar::{Abreast, Kernel, PlainPack};

use crate::abreast_chains::{Bodies, Chains};
use crate::abreast_tick::Company;
use crate::{Drives, Lumen, Model, Outputs, Real, State};

/// Number of catheters that are stepped abreast.
pub fn side_by_side<T: Real>() -> usize {
    struct Lanes;
    impl<T: Real> Kernel<T> for Lanes {
        type Output = usize;
        #[inline(always)]
        fn run<P: PlainPack<T>>(self) -> usize {
            P::LANES
        }
    }
    T::run_vectorised(Lanes)
}

/// Which catheters can be stepped abreast. In this order, those beside each other waste the fewest lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Kind {
    solves: u8,
    substeps: u8,
    is_viscous: bool,
    /// The next step samples the wall at the nodes.
    samples_nodes: bool,
    links: usize,
}

impl Kind {
    /// `None` for a catheter that is not stepped abreast: with a guidewire, with tendons, with an effect in
    /// the recursion, or while it begins again.
    pub fn of<T: Real, const LINKS: usize>(
        model: &Model<T, LINKS>,
        state: &State<T, LINKS>,
    ) -> Option<Self> {
        let is_plain =
            model.guidewire.is_none() && model.tendons.is_empty() && !model.has_active_effects;
        let solver = &model.description().solver;
        (is_plain && !state.lost).then(|| Self {
            solves: solver.solves,
            substeps: solver.substeps.max(1),
            is_viscous: model.bending_damping_s > T::zero(),
            samples_nodes: !state.nodes_sampled,
            links: state.count,
        })
    }

    /// Both can be stepped abreast with each other.
    pub fn goes_with(&self, other: &Self) -> bool {
        let of = |kind: &Self| (kind.solves, kind.substeps, kind.is_viscous);
        of(self) == of(other)
    }
}

/// What a caller does between the ticks of catheters abreast, which have the numbers of their places.
pub trait Attendant<T: Real, const LINKS: usize> {
    /// Positions of the drives in the next tick. `None` takes the catheter out.
    fn before(&mut self, catheter: usize) -> Option<Drives<T>>;
    /// A catheter was taken out, and its state is complete.
    fn out(&mut self, catheter: usize, state: &mut State<T, LINKS>);
    /// A tick was computed. The catheters that are named begin anew from the empty guide, and are out.
    fn after(&mut self, found: &Found<'_, T>, anew: &mut [bool]);
}

/// What a tick of catheters abreast computed.
#[derive(Debug)]
pub struct Found<'a, T> {
    /// Of each catheter; `None` for those that are out.
    pub outputs: &'a [Option<Outputs<T>>],
    /// Number of nodes of each catheter.
    pub nodes: &'a [usize],
    /// Where the vessel of a catheter is placed, the last row of its
    /// [`State::node_results`](crate::State::node_results).
    pub placements: &'a [Option<[T; 6]>],
    /// The other rows: number by number, one for each lane.
    pub rows: &'a [T],
    /// Position of the tip in the rig's frame \[m\].
    pub tips_m: &'a [Option<[T; 3]>],
    /// Lanes of `rows`.
    pub lanes: usize,
}

/// [`step_abreast`](crate::step_abreast), for any number type and number of links.
pub(crate) fn advance_abreast<T: Real, const LINKS: usize>(
    models: &[&Model<T, LINKS>],
    lumen: &Lumen<'_>,
    states: &mut [&mut State<T, LINKS>],
    attendant: &mut dyn Attendant<T, LINKS>,
) {
    if !models.is_empty() && models.len() == states.len() {
        T::run_vectorised(TicksKernel { models, lumen, states, attendant });
    }
}

struct TicksKernel<'a, 'l, 's, T: Real, const LINKS: usize> {
    models: &'a [&'a Model<T, LINKS>],
    lumen: &'a Lumen<'l>,
    states: &'a mut [&'s mut State<T, LINKS>],
    attendant: &'a mut dyn Attendant<T, LINKS>,
}

impl<T: Real, const LINKS: usize> Kernel<T> for TicksKernel<'_, '_, '_, T, LINKS> {
    type Output = ();

    #[inline(always)]
    fn run<P: PlainPack<T>>(self) {
        let Self { models, lumen, states, attendant } = self;
        let n = states.len().min(P::LANES);
        // A lane without a catheter repeats the last one.
        let mut company = Company::<P, LINKS> {
            chains: Chains::gather(|lane| &*states[lane.min(n - 1)]),
            bodies: Bodies::gather(|lane| models[lane.min(n - 1)]),
            masks: P::per_lane(|lane| Abreast::<P>::mask(|other| other == lane)),
        };
        let mut rows = vec![T::ZERO; LINKS * 6 * P::LANES];
        let mut here = vec![true; n];
        let mut drives = vec![Drives::<T>::default(); n];
        loop {
            let mut leaves = vec![false; n];
            for k in (0..n).filter(|&k| here[k]) {
                match attendant.before(k) {
                    Some(next) => drives[k] = next,
                    None => leaves[k] = true,
                }
            }
            if leaves.contains(&true) {
                company.hand_back(states, &leaves);
                for k in (0..n).filter(|&k| leaves[k]) {
                    here[k] = false;
                    attendant.out(k, states[k]);
                }
            }
            if !here.contains(&true) {
                return;
            }
            let outputs = company.tick(models, lumen, states, &here, &drives);
            company.fill(&mut rows);
            let nodes_of = |k: usize| match here[k] && !states[k].lost {
                true => states[k].count,
                false => 0,
            };
            let nodes: Vec<usize> = (0..n).map(nodes_of).collect();
            let tips_m: Vec<_> = (0..n)
                .map(|k| (nodes[k] > 0).then(|| states[k].in_rig_m(company.tip_m(k))))
                .collect();
            let placements: Vec<_> = states.iter().map(|state| state.placement_row()).collect();
            let found = Found {
                outputs: &outputs,
                nodes: &nodes,
                placements: &placements,
                rows: &rows,
                tips_m: &tips_m,
                lanes: P::LANES,
            };
            let mut anew = vec![false; n];
            attendant.after(&found, &mut anew);
            for k in 0..n {
                if here[k] && anew[k] {
                    states[k].reset();
                }
                if here[k] && (anew[k] || states[k].lost) {
                    here[k] = false;
                    attendant.out(k, states[k]);
                }
            }
        }
    }
}
