//! One tick of catheters abreast.

use alloc::vec;
use alloc::vec::Vec;

use cathforce_scalar::{Abreast, Gather, Number, PlainPack, Vector3};

use crate::abreast_chains::{Bodies, Chains};
use crate::algebra::Rotation;
use crate::chain::{Chain, base_cells};
use crate::effects::active::Nominal;
use crate::joint::Cell;
use crate::math::maximum;
use crate::outputs::{Peaks, collect_outputs};
use crate::predict::{Prediction, predict};
use crate::proximity::Proximity;
use crate::scheme::Scheme;
use crate::solve::{Totals, solve};
use crate::step::{Tick, momentum_share};
use crate::wall_sampling::{OUTSIDE_M, Sampler, Stored, sample_wall};
use crate::{Drag, Drives, Loads, Lumen, Model, Outputs, Real, State, WallSample};

/// Catheters abreast.
pub(crate) struct Company<P: Number, const LINKS: usize> {
    pub chains: Chains<P, LINKS>,
    pub bodies: Bodies<P, LINKS>,
    /// Of each catheter alone.
    pub masks: P::Lanes<P::Mask>,
}

/// Numbers of links inside the vessel.
struct Reach<P: Number> {
    /// Of each catheter.
    count: Abreast<P>,
    shortest: usize,
    longest: usize,
}

impl<P: Number> Reach<P> {
    #[inline(always)]
    fn of<T: Real, const LINKS: usize>(states: &[&mut State<T, LINKS>], here: &[bool]) -> Self
    where
        P: PlainPack<T>,
    {
        let n = here.len();
        let number = |k: usize| if k < n && here[k] { states[k].count } else { 0 };
        Self {
            count: Abreast::from_lanes(|k| T::int(number(k) as i32)),
            shortest: (0..n).filter(|&k| here[k]).map(number).min().unwrap_or(0),
            longest: (0..n).map(number).max().unwrap_or(0),
        }
    }
}

/// The tick of a lane's catheter, if it is stepped.
#[inline(always)]
fn tick_of<T: Real>(ticks: &[Option<Tick<T>>], lane: usize) -> Option<&Tick<T>> {
    ticks.get(lane).and_then(Option::as_ref)
}

/// The schemes of all catheters.
#[inline(always)]
fn scheme_abreast<T: Real, P: PlainPack<T>>(ticks: &[Option<Tick<T>>]) -> Scheme<Abreast<P>> {
    let number_of = |of: &dyn Fn(&Scheme<T>) -> T| {
        Abreast::<P>::from_lanes(|k| tick_of(ticks, k).map_or(T::ONE, |tick| of(&tick.scheme)))
    };
    Scheme {
        dt_s: number_of(&|scheme| scheme.dt_s),
        inertia: number_of(&|scheme| scheme.inertia),
        friction: number_of(&|scheme| scheme.friction),
        sliding: [number_of(&|scheme| scheme.sliding[0]), number_of(&|scheme| scheme.sliding[1])],
        drag: Drag {
            at_rest_n_s_per_m2: number_of(&|scheme| scheme.drag.at_rest_n_s_per_m2),
            swift_n_s_per_m2: number_of(&|scheme| scheme.drag.swift_n_s_per_m2),
            swift_m_per_s: number_of(&|scheme| scheme.drag.swift_m_per_s),
        },
        predictor_gain: number_of(&|scheme| scheme.predictor_gain),
        first: true,
        last: true,
    }
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
    pub fn hand_back<T: Real>(&self, states: &mut [&mut State<T, LINKS>], leaves: &[bool])
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
        ticks: &[Option<Tick<T>>],
        longest: usize,
    ) where
        P: PlainPack<T>,
    {
        for (k, (state, tick)) in states.iter().zip(ticks).enumerate() {
            if tick.is_none() || state.count >= longest {
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

    /// One tick of the catheters that are `here`; `None` for the others.
    #[inline(always)]
    pub fn tick<T: Real>(
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
        let solver = models[0].description().solver;
        let begin = |k: usize| here[k].then(|| Tick::begin(models[k], states[k], drives[k]));
        let mut ticks: Vec<Option<Tick<T>>> = (0..n).map(begin).collect();
        let mut outputs = vec![None; n];
        for part in 1..=solver.substeps.max(1) {
            for (k, tick) in ticks.iter_mut().enumerate() {
                if let Some(tick) = tick {
                    self.feed(k, models[k], states[k], tick, part);
                }
            }
            let reach = Reach::of(states, here);
            self.predict(states, &ticks, &reach);
            let totals = self.solve_substep(models, lumen, states, &ticks, &reach);
            if part >= solver.substeps {
                self.collect(models, states, &ticks, &reach, &totals, &mut outputs);
            }
        }
        for (k, tick) in ticks.iter_mut().enumerate() {
            if let (Some(tick), Some(output)) = (tick, &mut outputs[k]) {
                *output = tick.finish(models[k], states[k], *output);
            }
        }
        outputs
    }

    #[inline(always)]
    fn predict<T: Real>(
        &mut self,
        states: &[&mut State<T, LINKS>],
        ticks: &[Option<Tick<T>>],
        reach: &Reach<P>,
    ) where
        P: PlainPack<T>,
    {
        let state = |k: usize| &*states[k.min(ticks.len() - 1)];
        let predictions = P::per_lane(|k| match tick_of(ticks, k) {
            Some(tick) => {
                Prediction::new(tick.scheme.dt_s * state(k).momentum_share, tick.ratio.link_rates)
            }
            None => Prediction::new(T::ZERO, T::ONE),
        });
        let prediction = Prediction {
            dt_s: Abreast::<P>::from_lanes(|k| predictions[k].dt_s),
            forgotten: Abreast::from_lanes(|k| predictions[k].forgotten),
        };
        let mouth = Abreast::<P>::gather_vectors(|k| state(k).effects.mouth);
        let links = &mut self.chains.links[..reach.longest];
        predict::<Abreast<P>, Abreast<P>>(links, reach.count, mouth, &prediction);
    }

    /// The solves of one substep; returns the totals of the last one.
    #[inline(always)]
    fn solve_substep<T: Real>(
        &mut self,
        models: &[&Model<T, LINKS>],
        lumen: &Lumen<'_>,
        states: &mut [&mut State<T, LINKS>],
        ticks: &[Option<Tick<T>>],
        reach: &Reach<P>,
    ) -> P::Lanes<Totals<T>>
    where
        P: PlainPack<T>,
    {
        let n = ticks.len();
        let solver = models[0].description().solver;
        let state = |k: usize| &*states[k.min(n - 1)];
        let mut guide = self.chains.links[0];
        guide.rotation = Rotation::gather(|k| &state(k).guide.rotation);
        guide.tangent = Abreast::gather_vectors(|k| state(k).guide.tangent);
        guide.turn = Abreast::gather_vectors(|k| state(k).guide.turn);
        guide.displacement = Vector3::zeros();
        let mouth = Abreast::<P>::gather_vectors(|k| state(k).effects.mouth);
        let cells = P::per_lane(|k| match tick_of(ticks, k) {
            Some(tick) => base_cells(models[k], states[k], &tick.scheme),
            None => (T::ONE, [Cell::new(T::ONE, T::ONE, T::ZERO, [T::ZERO; 2]); 2]),
        });
        let fed_m = Abreast::<P>::from_lanes(|k| state(k).fed_m);
        let share = Abreast::<P>::from_lanes(|k| state(k).momentum_share);
        let mut scheme = scheme_abreast::<T, P>(ticks);
        let mut farthest_squared = vec![T::ZERO; n];
        let mut solve_number = 1;
        loop {
            (scheme.first, scheme.last) = (solve_number == 1, solve_number >= solver.solves);
            for (state, _) in states.iter_mut().zip(ticks).filter(|(_, tick)| tick.is_some()) {
                state.nodes_sampled ^= scheme.first;
            }
            // The last solve has moved them.
            self.put_guides(states, ticks, reach.longest);
            let of_nodes = Abreast::<P>::mask(|k| states[k.min(n - 1)].nodes_sampled);
            let Chains { links, eliminations } = &mut self.chains;
            let mut chain = Chain {
                links,
                eliminations,
                count: reach.count,
                shortest: reach.shortest,
                longest: reach.longest,
                guide: &guide,
                mouth: &mouth,
                tendon_cells: None,
                springs: None,
                fed_m,
                momentum_share: share,
                damping: Abreast::from_lanes(|k| cells[k].0),
                at_base: [0, 1].map(|which| Cell::gather(|k| &cells[k].1[which])),
            };
            let body = self.bodies.body();
            if scheme.first {
                let lumen = StoredAbreast(Stored::<T>::new(lumen));
                let lowest_m = sample_wall::<Abreast<P>, Abreast<P>, LINKS>(
                    &mut chain,
                    of_nodes,
                    body.radius_m,
                    &lumen,
                    &Nominal,
                )
                .numbers();
                for k in (0..n).filter(|&k| ticks[k].is_some()) {
                    states[k].outside = lowest_m[k] < T::lit(OUTSIDE_M);
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
            for k in (0..n).filter(|&k| ticks[k].is_some()) {
                farthest_squared[k] = maximum(farthest_squared[k], turned[k]);
                if scheme.last {
                    states[k].momentum_share = momentum_share(farthest_squared[k]);
                }
            }
            if scheme.last {
                return split_totals(&totals);
            }
            solve_number += 1;
        }
    }

    /// `totals`: of the last solve.
    #[inline(always)]
    fn collect<T: Real>(
        &self,
        models: &[&Model<T, LINKS>],
        states: &[&mut State<T, LINKS>],
        ticks: &[Option<Tick<T>>],
        reach: &Reach<P>,
        totals: &P::Lanes<Totals<T>>,
        outputs: &mut [Option<Outputs<T>>],
    ) where
        P: PlainPack<T>,
    {
        let peaks = Peaks::of(&self.chains.links[..reach.longest], reach.count);
        let [force_squared, node, stretched_squared] =
            [peaks.force_squared, peaks.node, peaks.stretched_squared].map(Abreast::numbers);
        for (k, output) in outputs.iter_mut().enumerate().filter(|(k, _)| ticks[*k].is_some()) {
            let peaks = Peaks {
                force_squared: force_squared[k],
                node: node[k].truncated() as u16,
                stretched_squared: stretched_squared[k],
            };
            *output = Some(collect_outputs(models[k], states[k], &totals[k], &peaks));
        }
    }

    /// Position \[m\] and contact force on the vessel \[N\] of every node, in the vessel's frame.
    #[inline(always)]
    pub fn fill<T: Real>(&self, rows: &mut [T])
    where
        P: PlainPack<T>,
    {
        let mut places = rows.chunks_exact_mut(P::LANES);
        for link in self.chains.links.iter() {
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
    pub fn tip_m<T: Real>(&self, k: usize) -> Vector3<T>
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
