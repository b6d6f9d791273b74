//! Links in the lanes of a pack.

use core::marker::PhantomData;

use cathforce_scalar::Number;

/// Neighbouring links, one in each lane of `N`. Lanes beyond the base link repeat it.
pub(crate) struct LinkGroup<N> {
    first: usize,
    count: usize,
    lanes: PhantomData<N>,
}

impl<N: Number> LinkGroup<N> {
    /// Groups of all `count` links, from the tip on.
    #[inline(always)]
    pub fn all(count: usize) -> impl DoubleEndedIterator<Item = Self> {
        let group = move |group| Self { first: group * N::LANES, count, lanes: PhantomData };
        (0..count.div_ceil(N::LANES)).map(group)
    }

    /// The lane holds a link of its own, and does not repeat the base link.
    #[inline(always)]
    pub fn has(&self, lane: usize) -> bool {
        lane == 0 || self.first + lane < self.count
    }

    /// Index of the link in a lane.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> usize {
        if self.has(lane) { self.first + lane } else { self.count - 1 }
    }

    /// Lanes with a link of their own, from the guide to the tip.
    #[inline(always)]
    pub fn guide_to_tip(&self) -> impl Iterator<Item = usize> {
        (0..N::LANES).rev().filter(|&lane| self.has(lane))
    }

    /// Calls `of` with each link and its lane, in order and once for each link.
    #[inline(always)]
    pub fn map_in_order<U: Copy>(&self, mut of: impl FnMut(usize, usize) -> U) -> N::Lanes<U> {
        let mut last = None;
        N::per_lane(|lane| match last {
            Some(base) if !self.has(lane) => base,
            _ => *last.insert(of(self.at(lane), lane)),
        })
    }
}
