//! Ticks of several catheters abreast: their mechanics are computed together, one catheter in each lane of the
//! processor's packs, and each has the bits and the digest that it has alone.

use alloc::vec::Vec;

use cathforce_mechanics::{self as mechanics, Attendant, Found, Kind, MAX_LINKS};

use crate::state::Tracked;
use crate::tick::{Begun, Estimator, Memory};
use crate::{Band, Config, Inputs, Outputs, State};

/// What a caller does between the ticks of catheters abreast, which have the numbers of their places.
pub trait Ticks {
    /// Inputs of the next tick of a catheter; `None` after its last.
    fn inputs(&mut self, catheter: usize) -> Option<Inputs>;
    /// What the tick computed, and the position of the tip in the rig's frame \[m\].
    fn outputs(&mut self, catheter: usize, outputs: &Outputs, tip_m: Option<[f32; 3]>);
}

/// Which catheters can be stepped abreast; `None` for one that can be only alone.
pub fn kind(config: &Config<'_>, state: &State) -> Option<Kind> {
    Kind::of(&config.model, &state.mechanics)
}

/// Computes ticks until `ticks` has no more inputs for any of the catheters.
///
/// They must have the same lumen and be of kinds that go together. Those that are not of any kind, and those
/// beyond [`mechanics::side_by_side`], are computed one after the other.
pub fn step_abreast(configs: &[&Config<'_>], states: &mut [&mut State], ticks: &mut dyn Ticks) {
    let most = mechanics::side_by_side::<f32>();
    let mut together: Vec<usize> = Vec::with_capacity(most);
    for (k, (config, state)) in configs.iter().zip(&mut *states).enumerate() {
        let first = together.first().map(|&first| configs[first]);
        let goes = first.is_none_or(|first| core::ptr::eq(first, *config) || go(first, config));
        if together.len() < most && goes && kind(config, state).is_some() {
            together.push(k);
        } else {
            alone(config, state, k, ticks);
        }
    }
    let Some(&first) = together.first() else { return };
    let lumen = &configs[first].lumen;
    let models: Vec<_> = together.iter().map(|&k| &configs[k].model).collect();
    let (mut memories, mut mechanics) = (Vec::new(), Vec::new());
    for (k, state) in states.iter_mut().enumerate() {
        if together.contains(&k) {
            let State { memory, mechanics: of } = &mut **state;
            memories.push(memory);
            mechanics.push(of);
        }
    }
    let configs: Vec<_> = together.iter().map(|&k| configs[k]).collect();
    let begun = together.iter().map(|_| None).collect();
    let mut lanes = Lanes { places: &together, configs: &configs, memories, begun, ticks };
    mechanics::step_abreast(&models, lumen, &mut mechanics, &mut lanes);
}

/// Two configurations that are not of one catheter go together.
fn go(one: &Config<'_>, other: &Config<'_>) -> bool {
    let (one, other) = (&one.lumen, &other.lumen);
    one.header() == other.header() && one.has_the_bytes_of(other)
}

/// The ticks of one catheter.
fn alone(config: &Config<'_>, state: &mut State, k: usize, ticks: &mut dyn Ticks) {
    while let Some(inputs) = ticks.inputs(k) {
        let outputs = crate::step(config, state, &inputs);
        ticks.outputs(k, &outputs, state.mechanics.node_position_m(0));
    }
}

/// The stages of the tick around the mechanics of catheters abreast.
struct Lanes<'a, 'l> {
    /// Numbers of the catheters to the caller.
    places: &'a [usize],
    configs: &'a [&'a Config<'l>],
    memories: Vec<&'a mut Memory>,
    /// Ticks whose forces are not estimated yet.
    begun: Vec<Option<Begun>>,
    ticks: &'a mut dyn Ticks,
}

impl Attendant<f32, MAX_LINKS> for Lanes<'_, '_> {
    fn before(&mut self, k: usize) -> Option<mechanics::Drives<f32>> {
        let inputs = self.ticks.inputs(self.places[k])?;
        let config = self.configs[k];
        let begun = self.memories[k].begin(&config.settings, &Answer::none(config), &inputs);
        let drives = self.memories[k].followed(&begun);
        self.begun[k] = Some(begun);
        drives
    }

    fn out(&mut self, k: usize, state: &mut mechanics::State<f32>) {
        let (config, place) = (self.configs[k], self.places[k]);
        let memory = &mut *self.memories[k];
        let settings = &config.settings;
        if let Some(begun) = self.begun[k].take() {
            let mut model = Tracked { config, mechanics: state };
            let mut outputs = memory.complete(settings, &mut model, begun);
            model.nodes().flatten().for_each(|x| memory.digest().add(x.to_bits()));
            outputs.digest = memory.digest().value();
            self.ticks.outputs(place, &outputs, state.node_position_m(0));
        }
        while let Some(inputs) = self.ticks.inputs(place) {
            let mut model = Tracked { config, mechanics: state };
            let outputs = memory.tick(settings, &mut model, &inputs);
            self.ticks.outputs(place, &outputs, state.node_position_m(0));
        }
    }

    fn after(&mut self, found: &Found<'_, f32>, anew: &mut [bool]) {
        let finite = each_lane(found, Finite(found.nodes));
        let mut outputs: Vec<Option<Outputs>> = Vec::with_capacity(anew.len());
        let mut nodes = Vec::from(found.nodes);
        for k in 0..anew.len() {
            let (Some(contact), Some(begun)) = (found.outputs[k], self.begun[k].take()) else {
                outputs.push(None);
                nodes[k] = 0;
                continue;
            };
            let config = self.configs[k];
            let mut answer = Answer {
                config,
                contact,
                is_finite: finite[k] && placed(found, k),
                is_anew: false,
            };
            let found = self.memories[k].complete(&config.settings, &mut answer, begun);
            anew[k] = answer.is_anew;
            if anew[k] {
                nodes[k] = 0;
            }
            outputs.push(Some(found));
        }
        let digests = (0..found.lanes)
            .map(|k| self.memories.get_mut(k).map_or(0, |memory| memory.digest().value()));
        let digests = each_lane(found, Digests { nodes: &nodes, digests: digests.collect() });
        for (k, outputs) in outputs.iter_mut().enumerate() {
            let Some(outputs) = outputs else { continue };
            let digest = self.memories[k].digest();
            digest.set(digests[k]);
            if !anew[k] {
                found.placements[k].iter().flatten().for_each(|x| digest.add(x.to_bits()));
            }
            outputs.digest = digest.value();
            let tip_m = found.tips_m[k].filter(|_| !anew[k]);
            self.ticks.outputs(self.places[k], outputs, tip_m);
        }
    }
}

/// The numbers of a placement are finite.
fn placed(found: &Found<'_, f32>, k: usize) -> bool {
    found.placements[k].iter().flatten().all(|x| x.is_finite())
}

/// The mechanics of one catheter, computed already.
struct Answer<'a, 'l> {
    config: &'a Config<'l>,
    contact: mechanics::Outputs<f32>,
    is_finite: bool,
    /// It has begun anew from the empty guide.
    is_anew: bool,
}

impl<'a, 'l> Answer<'a, 'l> {
    /// Before it is computed.
    fn none(config: &'a Config<'l>) -> Self {
        Self { config, contact: mechanics::Outputs::default(), is_finite: true, is_anew: false }
    }
}

impl Estimator for Answer<'_, '_> {
    fn tick_s(&self) -> f32 {
        self.config.model.description().solver.tick_s
    }

    fn reach_m(&self) -> f32 {
        self.config.model.reach_m()
    }

    fn has_guidewire(&self) -> bool {
        self.config.model.description().guidewire.is_some()
    }

    fn tendons(&self) -> usize {
        self.config.model.description().tendons.len()
    }

    fn band(&self) -> Option<&Band> {
        self.config.band.as_ref()
    }

    fn step(&mut self, _drives: mechanics::Drives<f32>) -> mechanics::Outputs<f32> {
        self.contact
    }

    /// Never abreast.
    fn settle(&mut self, _drives: mechanics::Drives<f32>) -> bool {
        false
    }

    fn rebuild(&mut self) {
        self.is_anew = true;
    }

    /// Of all lanes at once, in [`each_lane`].
    fn nodes(&self) -> impl Iterator<Item = [f32; 6]> {
        core::iter::empty()
    }

    fn nodes_finite(&self) -> bool {
        self.is_finite
    }
}

/// Something that is computed from the numbers of all nodes, in order, for all lanes at once.
trait OfNodes {
    type Sum: Copy + Default;
    fn begin(&self, lane: usize) -> Self::Sum;
    /// Number of nodes of a lane.
    fn nodes(&self, lane: usize) -> usize;
    fn add(sum: Self::Sum, number: f32) -> Self::Sum;
}

/// The sum of each lane is finite.
fn each_lane<W: OfNodes<Sum = S>, S: Copy + Default + Answers>(
    found: &Found<'_, f32>,
    work: W,
) -> Vec<S::Answer> {
    let sums = match found.lanes {
        8 => lanes::<W, 8>(found.rows, &work),
        4 => lanes::<W, 4>(found.rows, &work),
        _ => lanes::<W, 1>(found.rows, &work),
    };
    sums.into_iter().map(Answers::answer).collect()
}

fn lanes<W: OfNodes, const LANES: usize>(rows: &[f32], work: &W) -> Vec<W::Sum> {
    let mut sums: [W::Sum; LANES] = core::array::from_fn(|lane| work.begin(lane));
    let nodes: [usize; LANES] = core::array::from_fn(|lane| work.nodes(lane));
    let most = nodes.iter().copied().max().unwrap_or(0);
    let (rows, _) = rows.as_chunks::<LANES>();
    for (node, numbers) in rows.chunks_exact(6).enumerate().take(most) {
        for numbers in numbers {
            for lane in 0..LANES {
                let next = W::add(sums[lane], numbers[lane]);
                sums[lane] = if node < nodes[lane] { next } else { sums[lane] };
            }
        }
    }
    sums.to_vec()
}

/// What is told of a sum.
trait Answers {
    type Answer;
    fn answer(self) -> Self::Answer;
}

impl Answers for f32 {
    type Answer = bool;
    fn answer(self) -> bool {
        self == 0.0
    }
}

impl Answers for u32 {
    type Answer = u32;
    fn answer(self) -> u32 {
        self
    }
}

/// x · 0 is NaN exactly if x is not finite, and the sum keeps NaN.
struct Finite<'a>(&'a [usize]);

impl OfNodes for Finite<'_> {
    type Sum = f32;
    fn begin(&self, _lane: usize) -> f32 {
        0.0
    }
    fn nodes(&self, lane: usize) -> usize {
        self.0.get(lane).copied().unwrap_or(0)
    }
    fn add(sum: f32, number: f32) -> f32 {
        sum + number * 0.0
    }
}

struct Digests<'a> {
    nodes: &'a [usize],
    digests: Vec<u32>,
}

impl OfNodes for Digests<'_> {
    type Sum = u32;
    fn begin(&self, lane: usize) -> u32 {
        self.digests.get(lane).copied().unwrap_or(0)
    }
    fn nodes(&self, lane: usize) -> usize {
        self.nodes.get(lane).copied().unwrap_or(0)
    }
    fn add(sum: u32, number: f32) -> u32 {
        crate::digest::mixed(sum, number.to_bits())
    }
}
