//! Catheters abreast: several independent ones are stepped together, one in each lane of the processor's
//! packs.
//!
//! The equations are those of a single catheter, in [`crate::solve`] and its neighbours, computed with
//! [`Abreast`] in place of a number. What a step does once, and not for each link, is done for one catheter
//! after the other by the same functions.

use alloc::vec;
use alloc::vec::Vec;

use cathforce_scalar::{Abreast, Gather, Kernel, Number, PlainPack, Vector3};

use crate::abreast_chains::{Bodies, Chains};
use crate::chain::{Body, Chain, base_cells};
use crate::effects::active::Nominal;
use crate::joint::Cell;
use crate::math::maximum;
use crate::predict::{Prediction, predict};
use crate::proximity::Proximity;
use crate::scheme::Scheme;
use crate::solve::{Totals, solve};
use crate::step::{Peaks, Tick, collect_outputs, momentum_share};
use crate::wall_sampling::{OUTSIDE_M, Sampler, Stored, sample_wall};
use crate::{Drag, Drives, Loads, Lumen, Model, Outputs, Real, State, WallSample};

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

/// Catheters abreast.
struct Company<P: Number, const LINKS: usize> {
    chains: Chains<P, LINKS>,
    bodies: Bodies<P, LINKS>,
    /// Of each catheter alone.
    masks: P::Lanes<P::Mask>,
}

/// The wall next to a point of each catheter.
struct StoredAbreast<'a, 'l, T>(Stored<'a, 'l, T>);

impl<T: Real, P: PlainPack<T>> Sampler<Abreast<P>> for StoredAbreast<'_, '_, T> {
    #[inline(always)]
    fn sample(&self, position: Vector3<Abreast<P>>) -> WallSample<Abreast<P>> {
        let found = self.0.sample(Abreast::pack(&position));
        let normal = found.normal;
        WallSample {
            distance_m: Abreast(found.distance_m),
            normal: Vector3::new(Abreast(normal.x()), Abreast(normal.y()), Abreast(normal.z())),
            stiffness: Abreast(found.stiffness),
        }
    }
}

impl<P: Number, const LINKS: usize> Company<P, LINKS> {
    /// Writes the chains of the catheters that leave into their states.
    #[inline(always)]
    fn hand_back<T: Real>(&self, states: &mut [&mut State<T, LINKS>], leaves: &[bool])
    where
        P: PlainPack<T>,
    {
        let of = |k: usize| if leaves[k] { states[k].count } else { 0 };
        let longest = (0..leaves.len()).map(of).max().unwrap_or(0);
        self.chains.scatter(longest, |lane, j, link, proximity| {
            if leaves.get(lane) == Some(&true) && j < states[lane].count {
                let state = &mut states[lane];
                state.links[j] = link;
                state.eliminations[j].proximity = proximity;
            }
        });
    }

    /// Feeds one catheter, whose base link is in the chains and not in its state.
    #[inline(always)]
    fn feed<T: Real>(
        &mut self,
        k: usize,
        model: &Model<T, LINKS>,
        state: &mut State<T, LINKS>,
        tick: &mut Tick<T>,
        part: u8,
    ) where
        P: PlainPack<T>,
    {
        let Chains { links, eliminations } = &mut self.chains;
        let only = self.masks[k];
        let before = state.count;
        if let Some(base) = before.checked_sub(1) {
            state.links[base].strain = links[base].strain.numbers()[k];
        }
        tick.feed(model, state, part);
        for j in before.min(state.count).saturating_sub(1)..state.count {
            if j < before {
                links[j].put_span(only, &state.links[j].span);
            } else {
                links[j].put(only, &state.links[j]);
                for seen in &mut eliminations[j].proximity {
                    seen.put(only, &Proximity::none());
                }
            }
        }
    }

    /// Puts the guide of each shorter chain to where its next link would be.
    #[inline(always)]
    fn put_guides<T: Real>(
        &mut self,
        states: &[&mut State<T, LINKS>],
        here: &[bool],
        longest: usize,
    ) where
        P: PlainPack<T>,
    {
        for (k, state) in states.iter().enumerate().take(here.len()) {
            if !here[k] || state.count >= longest {
                continue;
            }
            let place = &mut self.chains.links[state.count];
            let (only, guide) = (self.masks[k], &state.guide);
            place.rotation.w.put(only, guide.rotation.w);
            Abreast::put_vector(&mut place.rotation.v, only, guide.rotation.v);
            Abreast::put_vector(&mut place.tangent, only, guide.tangent);
            Abreast::put_vector(&mut place.turn, only, guide.turn);
            Abreast::put_vector(&mut place.displacement, only, guide.displacement);
        }
    }

    #[inline(always)]
    fn tick<T: Real>(
        &mut self,
        models: &[&Model<T, LINKS>],
        lumen: &Lumen<'_>,
        states: &mut [&mut State<T, LINKS>],
        here: &[bool],
        drives: &[Drives<T>],
    ) -> Vec<Option<Outputs<T>>>
    where
        P: PlainPack<T>,
    {
        let n = here.len();
        let is_here = |k: usize| k < n && here[k];
        let solver = models[0].description().solver;
        let mut ticks: Vec<Option<Tick<T>>> =
            (0..n).map(|k| here[k].then(|| Tick::begin(models[k], states[k], drives[k]))).collect();
        let mut outputs = vec![None; n];
        for part in 1..=solver.substeps.max(1) {
            for (k, tick) in ticks.iter_mut().enumerate() {
                if let Some(tick) = tick {
                    self.feed(k, models[k], states[k], tick, part);
                }
            }
            let number = |k: usize| if is_here(k) { states[k].count } else { 0 };
            let count = Abreast::<P>::from_lanes(|k| T::int(number(k) as i32));
            let longest = (0..n).map(number).max().unwrap_or(0);
            let shortest = (0..n).filter(|&k| here[k]).map(number).min().unwrap_or(0);

            let state = |k: usize| &*states[k.min(n - 1)];
            let tick = |k: usize| ticks.get(k).and_then(|tick| tick.as_ref());
            let number_of = |of: &dyn Fn(&Tick<T>) -> T| {
                Abreast::<P>::from_lanes(|k| tick(k).map_or(T::ONE, of))
            };
            let v = Vector3::zeros();
            let mut guide = self.chains.links[0];
            guide.rotation = crate::algebra::Rotation::gather(|k| &state(k).guide.rotation);
            guide.tangent = Abreast::gather_vectors(|k| state(k).guide.tangent);
            guide.turn = Abreast::gather_vectors(|k| state(k).guide.turn);
            guide.displacement = v;
            let mouth = Abreast::<P>::gather_vectors(|k| state(k).effects.mouth);
            let mut scheme = Scheme {
                dt_s: number_of(&|tick| tick.scheme.dt_s),
                inertia: number_of(&|tick| tick.scheme.inertia),
                friction: number_of(&|tick| tick.scheme.friction),
                sliding: [
                    number_of(&|tick| tick.scheme.sliding[0]),
                    number_of(&|tick| tick.scheme.sliding[1]),
                ],
                drag: Drag {
                    at_rest_n_s_per_m2: number_of(&|tick| tick.scheme.drag.at_rest_n_s_per_m2),
                    swift_n_s_per_m2: number_of(&|tick| tick.scheme.drag.swift_n_s_per_m2),
                    swift_m_per_s: number_of(&|tick| tick.scheme.drag.swift_m_per_s),
                },
                predictor_gain: number_of(&|tick| tick.scheme.predictor_gain),
                first: true,
                last: true,
            };
            let predictions = P::per_lane(|k| match tick(k) {
                Some(tick) => Prediction::new(
                    tick.scheme.dt_s * state(k).momentum_share,
                    tick.ratio.link_rates,
                ),
                None => Prediction::new(T::ZERO, T::ONE),
            });
            let prediction = Prediction {
                dt_s: Abreast::<P>::from_lanes(|k| predictions[k].dt_s),
                forgotten: Abreast::from_lanes(|k| predictions[k].forgotten),
            };
            predict::<Abreast<P>, Abreast<P>>(
                &mut self.chains.links[..longest],
                count,
                mouth,
                &prediction,
            );
            let cells = P::per_lane(|k| match tick(k) {
                Some(tick) => base_cells(models[k], states[k], &tick.scheme),
                None => (T::ONE, [Cell::new(T::ONE, T::ONE, T::ZERO, [T::ZERO; 2]); 2]),
            });
            let fed_m = Abreast::<P>::from_lanes(|k| state(k).fed_m);
            let share = Abreast::<P>::from_lanes(|k| state(k).momentum_share);
            let mut farthest_squared = vec![T::ZERO; n];
            for solve_number in 1..=solver.solves.max(1) {
                (scheme.first, scheme.last) = (solve_number == 1, solve_number >= solver.solves);
                for (state, _) in states.iter_mut().zip(here).filter(|(_, here)| **here) {
                    state.nodes_sampled ^= scheme.first;
                }
                // The last solve has moved them.
                self.put_guides(states, here, longest);
                let of_nodes = Abreast::<P>::mask(|k| states[k.min(n - 1)].nodes_sampled);
                let Chains { links, eliminations } = &mut self.chains;
                let (Ok(links), Ok(eliminations)) =
                    ((&mut links[..]).try_into(), (&mut eliminations[..]).try_into())
                else {
                    return outputs;
                };
                let mut chain = Chain {
                    links,
                    eliminations,
                    count,
                    shortest,
                    longest,
                    guide: &guide,
                    mouth: &mouth,
                    tendon_cells: &[],
                    fed_m,
                    momentum_share: share,
                    damping: Abreast::from_lanes(|k| cells[k].0),
                    at_base: [0, 1].map(|which| Cell::gather(|k| &cells[k].1[which])),
                };
                let Bodies { tables, wall, gravity, radius_m, is_viscous } = &self.bodies;
                let body =
                    Body { tables, wall, gravity, radius_m: *radius_m, is_viscous: *is_viscous };
                if scheme.first {
                    let lumen = StoredAbreast(Stored::<T>::new(lumen));
                    let lowest_m = sample_wall::<Abreast<P>, Abreast<P>, LINKS>(
                        &mut chain, of_nodes, *radius_m, &lumen, &Nominal,
                    );
                    let lowest_m = lowest_m.numbers();
                    for (k, state) in states.iter_mut().enumerate().filter(|(k, _)| here[*k]) {
                        state.outside = lowest_m[k] < T::lit(OUTSIDE_M);
                    }
                }
                let zero = [Abreast::lit(0.0); 3];
                let loads = Loads { tip_force_n: zero, tip_moment_n_m: zero };
                let totals = solve::<Abreast<P>, Abreast<P>, _, LINKS>(
                    &body,
                    &mut chain,
                    &loads,
                    &scheme,
                    &mut Nominal,
                );
                let turned = totals.largest_turn_squared.numbers();
                for k in (0..n).filter(|&k| here[k]) {
                    farthest_squared[k] = maximum(farthest_squared[k], turned[k]);
                    if scheme.last {
                        states[k].momentum_share = momentum_share(farthest_squared[k]);
                    }
                }
                if scheme.last && part >= solver.substeps {
                    let peaks = Peaks::of(&self.chains.links[..longest], count);
                    let [force_squared, node, stretched_squared] =
                        [peaks.force_squared, peaks.node, peaks.stretched_squared]
                            .map(Abreast::numbers);
                    let totals = split_totals(&totals);
                    for k in (0..n).filter(|&k| here[k]) {
                        let peaks = Peaks {
                            force_squared: force_squared[k],
                            node: node[k].truncated() as u16,
                            stretched_squared: stretched_squared[k],
                        };
                        outputs[k] =
                            Some(collect_outputs(models[k], states[k], &totals[k], &peaks));
                    }
                }
            }
        }
        for (k, tick) in ticks.iter_mut().enumerate() {
            if let (Some(tick), Some(output)) = (tick, &mut outputs[k]) {
                *output = tick.finish(models[k], states[k], *output);
            }
        }
        outputs
    }

    /// Position \[m\] and contact force on the vessel \[N\] of every node, in the vessel's frame.
    #[inline(always)]
    fn fill<T: Real>(&self, rows: &mut [T])
    where
        P: PlainPack<T>,
    {
        let mut places = rows.chunks_exact_mut(P::LANES);
        for link in &self.chains.links {
            let (at, force) = (&link.position, -link.force);
            for number in [at.x(), at.y(), at.z(), force.x(), force.y(), force.z()] {
                if let Some(place) = places.next() {
                    let numbers = number.numbers();
                    (0..P::LANES).for_each(|lane| place[lane] = numbers[lane]);
                }
            }
        }
    }

    #[inline(always)]
    fn tip_m<T: Real>(&self, k: usize) -> Vector3<T>
    where
        P: PlainPack<T>,
    {
        Abreast::split(&self.chains.links[0].position)[k]
    }
}

/// The totals of each catheter.
#[inline(always)]
fn split_totals<T: Real, P: PlainPack<T>>(totals: &Totals<Abreast<P>>) -> P::Lanes<Totals<T>> {
    let [force, moment, at_guide, moment_at_guide] = [
        &totals.force_on_instrument,
        &totals.moment_on_instrument,
        &totals.force_on_guide,
        &totals.moment_on_guide,
    ]
    .map(|of| Abreast::split(of));
    let turned = totals.largest_turn_squared.numbers();
    P::per_lane(|lane| Totals {
        force_on_instrument: force[lane],
        moment_on_instrument: moment[lane],
        force_on_guide: at_guide[lane],
        moment_on_guide: moment_at_guide[lane],
        largest_turn_squared: turned[lane],
    })
}
