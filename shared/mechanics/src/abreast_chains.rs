//! The chains of several catheters with one catheter in each lane, and how they come from their states and go
//! back.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cathforce_scalar::{Abreast, Gather, Number, PlainPack, Vector3};

use crate::algebra::{LdltFactor, Matrix3, Rotation, Sym3};
use crate::chain::Body;
use crate::contact::{ContactState, LinearContact};
use crate::joint::JointLoad;
use crate::proximity::Proximity;
use crate::state::{Elimination, LinkLoads, LinkState, Span, Stretch};
use crate::tables::{Joint, Link, Tables};
use crate::{Model, Real, State, Wall};

/// Links and eliminations of catheters abreast.
pub(crate) struct Chains<P, const LINKS: usize>
where
    P: Number,
{
    pub links: Box<[LinkState<Abreast<P>>; LINKS]>,
    pub eliminations: Box<[Elimination<Abreast<P>>; LINKS]>,
}

/// What is read of their models.
pub(crate) struct Bodies<P: Number, const LINKS: usize> {
    pub tables: Tables<Abreast<P>, LINKS>,
    pub wall: Wall<Abreast<P>>,
    pub gravity: Vector3<Abreast<P>>,
    pub radius_m: Abreast<P>,
    pub is_viscous: bool,
}

impl<P: Number, const LINKS: usize> Bodies<P, LINKS> {
    /// `model`: of a lane.
    #[inline(always)]
    pub fn gather<'a, T: Real>(model: impl Fn(usize) -> &'a Model<T, LINKS>) -> Self
    where
        P: PlainPack<T>,
    {
        let each = |of: fn(&Model<T, LINKS>) -> T| Abreast::<P>::from_lanes(|lane| of(model(lane)));
        let joint = |j: usize| Joint::gather(|lane| &model(lane).tables.joints[j]);
        let link = |j: usize| Link {
            axial: Abreast::from_lanes(|lane| model(lane).tables.links[j].axial),
            mass: Abreast::from_lanes(|lane| model(lane).tables.links[j].mass),
        };
        Self {
            tables: Tables {
                joints: core::array::from_fn(joint),
                links: core::array::from_fn(link),
            },
            wall: Wall {
                line_stiffness_n_per_m2: each(|model| model.wall.line_stiffness_n_per_m2),
                end_stiffness_n_per_m: each(|model| model.wall.end_stiffness_n_per_m),
                tangential_ratio: each(|model| model.wall.tangential_ratio),
                friction_coefficient: each(|model| model.wall.friction_coefficient),
                onset_m: each(|model| model.wall.onset_m),
                damping_s: each(|model| model.wall.damping_s),
            },
            gravity: Abreast::gather_vectors(|lane| model(lane).gravity),
            radius_m: each(|model| model.description().instrument.outer_radius_m),
            is_viscous: model(0).bending_damping_s > T::zero(),
        }
    }

    #[inline(always)]
    pub fn body(&self) -> Body<'_, Abreast<P>, LINKS> {
        let Self { tables, wall, gravity, radius_m, is_viscous } = self;
        Body { tables, wall, gravity, radius_m: *radius_m, is_viscous: *is_viscous }
    }
}

impl<P: Number, const LINKS: usize> Chains<P, LINKS> {
    /// `state`: of a lane.
    #[inline(always)]
    pub fn gather<'a, T: Real>(state: impl Fn(usize) -> &'a State<T, LINKS>) -> Self
    where
        P: PlainPack<T>,
    {
        let longest = (0..P::LANES).map(|lane| state(lane).count).max().unwrap_or(0);
        let (mut links, mut eliminations) = (Vec::with_capacity(LINKS), Vec::with_capacity(LINKS));
        let (no_link, nothing) = (LinkState::new(), Proximity::none());
        for j in 0..LINKS {
            let is_there = j < longest;
            let link = |lane: usize| if is_there { &state(lane).links[j] } else { &no_link };
            links.push(LinkState::gather(link));
            eliminations.push(Elimination::of_nothing([0, 1].map(|which| {
                Proximity::gather(|lane| match is_there {
                    true => &state(lane).eliminations[j].proximity[which],
                    false => &nothing,
                })
            })));
        }
        // They were pushed one by one, because the whole array is too large for a thread's stack.
        let (Ok(links), Ok(eliminations)) = (links.try_into(), eliminations.try_into()) else {
            unreachable!("LINKS of each were pushed");
        };
        Self { links, eliminations }
    }

    /// Writes the chains back of the lanes for which `state` has a state.
    #[inline(always)]
    pub fn scatter<T: Real>(
        &self,
        longest: usize,
        mut to: impl FnMut(usize, usize, LinkState<T>, [Proximity<T>; 2]),
    ) where
        P: PlainPack<T>,
    {
        let chain = self.links.iter().zip(self.eliminations.iter()).take(longest);
        for (j, (link, elimination)) in chain.enumerate() {
            let links = link.split::<T>();
            let [nodes, middles] = &elimination.proximity;
            let (nodes, middles) = (nodes.split::<T>(), middles.split::<T>());
            for lane in 0..P::LANES {
                to(lane, j, links[lane], [nodes[lane], middles[lane]]);
            }
        }
    }
}

impl<P: Number> LinkState<Abreast<P>> {
    #[inline(always)]
    fn gather<'a, T: Real>(of: impl Fn(usize) -> &'a LinkState<T>) -> Self
    where
        P: PlainPack<T>,
    {
        let vector = |get: fn(&LinkState<T>) -> Vector3<T>| {
            Abreast::<P>::gather_vectors(|lane| get(of(lane)))
        };
        let number = |get: fn(&LinkState<T>) -> T| Abreast::<P>::from_lanes(|lane| get(of(lane)));
        Self {
            rotation: Rotation::gather(|lane| &of(lane).rotation),
            tangent: vector(|link| link.tangent),
            rate: vector(|link| link.rate),
            span: Span {
                length: number(|link| link.span.length),
                share: number(|link| link.span.share),
                inverse_length: number(|link| link.span.inverse_length),
            },
            strain: number(|link| link.strain),
            position: vector(|link| link.position),
            velocity: vector(|link| link.velocity),
            displacement: vector(|link| link.displacement),
            turn: vector(|link| link.turn),
            force: vector(|link| link.force),
            memory: [0, 1].map(|which| ContactState::gather(|lane| &of(lane).memory[which])),
        }
    }

    #[inline(always)]
    fn split<T: Real>(&self) -> P::Lanes<LinkState<T>>
    where
        P: PlainPack<T>,
    {
        let vector = |of: &Vector3<Abreast<P>>| Abreast::split::<T>(of);
        let (w, v) = (self.rotation.w.numbers(), vector(&self.rotation.v));
        let [tangent, rate, position, velocity] =
            [self.tangent, self.rate, self.position, self.velocity].map(|of| vector(&of));
        let [displacement, turn, force] =
            [self.displacement, self.turn, self.force].map(|of| vector(&of));
        let span = &self.span;
        let [length, share, inverse_length, strain] =
            [span.length, span.share, span.inverse_length, self.strain].map(Abreast::numbers);
        let slip = [0, 1].map(|which| vector(&self.memory[which].slip));
        let rest = [0, 1].map(|which| {
            let ContactState { trial_slip_m, normal_n, relaxed, .. } = self.memory[which];
            [trial_slip_m, normal_n, relaxed].map(Abreast::numbers)
        });
        P::per_lane(|lane| LinkState {
            rotation: Rotation { w: w[lane], v: v[lane] },
            tangent: tangent[lane],
            rate: rate[lane],
            span: Span {
                length: length[lane],
                share: share[lane],
                inverse_length: inverse_length[lane],
            },
            strain: strain[lane],
            position: position[lane],
            velocity: velocity[lane],
            displacement: displacement[lane],
            turn: turn[lane],
            force: force[lane],
            memory: [0, 1].map(|which| {
                let [trial_slip_m, normal_n, relaxed] = &rest[which];
                ContactState {
                    slip: slip[which][lane],
                    trial_slip_m: trial_slip_m[lane],
                    normal_n: normal_n[lane],
                    relaxed: relaxed[lane],
                }
            }),
        })
    }

    /// Replaces the span of the catheters of a mask.
    #[inline(always)]
    pub fn put_span<T: Real>(&mut self, only: P::Mask, span: &Span<T>)
    where
        P: PlainPack<T>,
    {
        self.span.length.put(only, span.length);
        self.span.share.put(only, span.share);
        self.span.inverse_length.put(only, span.inverse_length);
    }

    /// Replaces the link of the catheters of a mask.
    #[inline(always)]
    pub fn put<T: Real>(&mut self, only: P::Mask, link: &LinkState<T>)
    where
        P: PlainPack<T>,
    {
        self.put_span(only, &link.span);
        self.rotation.w.put(only, link.rotation.w);
        self.strain.put(only, link.strain);
        for (to, vector) in [
            (&mut self.rotation.v, link.rotation.v),
            (&mut self.tangent, link.tangent),
            (&mut self.rate, link.rate),
            (&mut self.position, link.position),
            (&mut self.velocity, link.velocity),
            (&mut self.displacement, link.displacement),
            (&mut self.turn, link.turn),
            (&mut self.force, link.force),
        ] {
            Abreast::put_vector(to, only, vector);
        }
        for (to, memory) in self.memory.iter_mut().zip(&link.memory) {
            Abreast::put_vector(&mut to.slip, only, memory.slip);
            to.trial_slip_m.put(only, memory.trial_slip_m);
            to.normal_n.put(only, memory.normal_n);
            to.relaxed.put(only, memory.relaxed);
        }
    }
}

impl<P: Number> Proximity<Abreast<P>> {
    #[inline(always)]
    fn gather<'a, T: Real>(of: impl Fn(usize) -> &'a Proximity<T>) -> Self
    where
        P: PlainPack<T>,
    {
        Self {
            arm: Abreast::gather_vectors(|lane| of(lane).arm),
            normal: Abreast::gather_vectors(|lane| of(lane).normal),
            gap: Abreast::from_lanes(|lane| of(lane).gap),
            stiffness: Abreast::from_lanes(|lane| of(lane).stiffness),
            sampled_at: Abreast::gather_vectors(|lane| of(lane).sampled_at),
            distance: Abreast::from_lanes(|lane| of(lane).distance),
        }
    }

    #[inline(always)]
    fn split<T: Real>(&self) -> P::Lanes<Proximity<T>>
    where
        P: PlainPack<T>,
    {
        let [arm, normal, sampled_at] =
            [self.arm, self.normal, self.sampled_at].map(|of| Abreast::split::<T>(&of));
        let [gap, stiffness, distance] =
            [self.gap, self.stiffness, self.distance].map(Abreast::numbers);
        P::per_lane(|lane| Proximity {
            arm: arm[lane],
            normal: normal[lane],
            gap: gap[lane],
            stiffness: stiffness[lane],
            sampled_at: sampled_at[lane],
            distance: distance[lane],
        })
    }

    /// Replaces the wall of the catheters of a mask.
    #[inline(always)]
    pub fn put<T: Real>(&mut self, only: P::Mask, seen: &Proximity<T>)
    where
        P: PlainPack<T>,
    {
        Abreast::put_vector(&mut self.arm, only, seen.arm);
        Abreast::put_vector(&mut self.normal, only, seen.normal);
        Abreast::put_vector(&mut self.sampled_at, only, seen.sampled_at);
        self.gap.put(only, seen.gap);
        self.stiffness.put(only, seen.stiffness);
        self.distance.put(only, seen.distance);
    }
}

impl<S: Number> Elimination<S> {
    /// Everything but the wall is computed anew in each solve.
    #[inline(always)]
    fn of_nothing(proximity: [Proximity<S>; 2]) -> Self {
        let (o, v) = (S::lit(0.0), Vector3::zeros());
        let contact = LinearContact {
            normal_n: o,
            tangential_stiffness: o,
            normal_excess: o,
            slip: v,
            sticking_stiffness: o,
            friction_limit_n: o,
            relaxed: o,
        };
        Self {
            loads: LinkLoads { force: v, moment: v, stiffness: o },
            joint: JointLoad { moment: v, stiffness: Sym3::nothing(), smallest_eigenvalue: o },
            turn: v,
            by_displacement: Matrix3::nothing(),
            by_rotation: Matrix3::nothing(),
            factor: LdltFactor::new(&Sym3::nothing(), S::lit(1.0)),
            stretch: Stretch { free: o, by_displacement: v, by_rotation: v },
            proximity,
            contacts: [contact; 2],
        }
    }
}
