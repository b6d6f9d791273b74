//! Links side by side.

use core::marker::PhantomData;

use cathforce_scalar::Number;

/// As many neighbouring links as `N` has lanes; lanes beyond the base link repeat it.
pub(crate) struct LinkGroup<N> {
    first: usize,
    count: usize,
    lanes: PhantomData<N>,
}

impl<N: Number> LinkGroup<N> {
    /// All of `count` links, from the tip on.
    #[inline(always)]
    pub fn all(count: usize) -> impl DoubleEndedIterator<Item = Self> {
        let group = move |group| Self { first: group * N::LANES, count, lanes: PhantomData };
        (0..count.div_ceil(N::LANES)).map(group)
    }

    /// A link of its own is in the lane; in the first one always.
    #[inline(always)]
    pub fn has(&self, lane: usize) -> bool {
        lane == 0 || self.first + lane < self.count
    }

    /// The link in a lane.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> usize {
        if self.has(lane) { self.first + lane } else { self.count - 1 }
    }

    /// Lanes that have a link of their own, from the guide to the tip.
    #[inline(always)]
    pub fn guide_to_tip(&self) -> impl Iterator<Item = usize> {
        (0..N::LANES).rev().filter(|&lane| self.has(lane))
    }

    /// What `of` says of each link and its lane, asked once for each of them and in turn.
    #[inline(always)]
    pub fn map_in_order<U: Copy>(&self, mut of: impl FnMut(usize, usize) -> U) -> N::Lanes<U> {
        let mut last = None;
        N::per_lane(|lane| match last {
            Some(base) if !self.has(lane) => base,
            _ => *last.insert(of(self.at(lane), lane)),
        })
    }
}
