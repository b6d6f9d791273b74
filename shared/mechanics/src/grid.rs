//! Nodes of the chain along its arc. Links are shorter at the tip.     docs/explanation/model.md (1)

use crate::math::minimum;
use crate::{Real, Solver};

/// Lengths of the chain's links. Arcs and lengths without a unit are multiples of the length of a link
/// of the shaft.
///
/// Link j reaches from node j to joint j + 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid<T> {
    /// Length of a link of the shaft \[m\].
    pub link_length_m: T,
    /// Number of links at the tip that are half as long.
    tip_links: usize,
}

impl<T: Real> Grid<T> {
    pub fn new(solver: &Solver<T>) -> Self {
        let halves = solver.fine_tip_m * T::int(2) / solver.link_length_m;
        Self { link_length_m: solver.link_length_m, tip_links: halves.floor_int().max(0) as usize }
    }

    #[cfg(test)]
    pub fn uniform(link_length_m: T) -> Self {
        Self { link_length_m, tip_links: 0 }
    }

    /// Length of a link.
    pub fn link(&self, link: usize) -> T {
        if link < self.tip_links { T::lit(0.5) } else { T::one() }
    }

    /// Length of a link \[m\].
    pub fn link_m(&self, link: usize) -> T {
        self.link_length_m * self.link(link)
    }

    /// Arc from the tip to a node.
    pub fn node(&self, node: usize) -> T {
        let shorter = node.min(self.tip_links);
        T::int(node as i32) - T::int(shorter as i32) * T::lit(0.5)
    }

    /// Arc from the tip to the middle of a link.
    pub fn middle(&self, link: usize) -> T {
        self.node(link) + self.link(link) * T::lit(0.5)
    }

    /// Arc of the cell around the joint at the proximal end of a link, from the middle of the link to the
    /// middle of the next one.
    pub fn cell(&self, link: usize) -> T {
        (self.link(link) + self.link(link + 1)) * T::lit(0.5)
    }

    /// [`Grid::cell`] in metres \[m\].
    pub fn cell_m(&self, link: usize) -> T {
        self.link_length_m * self.cell(link)
    }

    /// Arc from the tip to a sample: the node of link `sample / 2` if even, else its middle.
    pub fn sample(&self, sample: usize) -> T {
        if sample.is_multiple_of(2) { self.node(sample / 2) } else { self.middle(sample / 2) }
    }

    /// Links from the tip to the end of an arc \[m\].
    pub fn links_in(&self, arc_m: T) -> T {
        let arc = arc_m / self.link_length_m;
        let tip = minimum(arc, self.node(self.tip_links));
        // Each short link at the tip counts as a whole one.
        arc + tip
    }

    /// The link in which an arc from the tip ends \[m\].
    pub fn link_at(&self, arc_m: T) -> usize {
        self.links_in(arc_m).floor_int().max(0) as usize
    }
}

impl<T: Real> Solver<T> {
    /// Arc of a number of links \[m\].
    pub fn reach_m(&self, links: usize) -> T {
        self.link_length_m * Grid::new(self).node(links)
    }

    /// Links from the tip to the end of an arc \[m\].
    pub fn links_in(&self, arc_m: T) -> T {
        Grid::new(self).links_in(arc_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_end_where_the_next_ones_begin_and_are_found_by_their_arc() {
        for tip_links in [0, 1, 5, 16] {
            let grid = Grid { link_length_m: 2e-3, tip_links };
            for link in 0..40 {
                assert_eq!(grid.node(link) + grid.link(link), grid.node(link + 1));
                assert_eq!(grid.middle(link) + grid.cell(link), grid.middle(link + 1));
                let [node_m, middle_m] =
                    [grid.node(link), grid.middle(link)].map(|x: f64| 2e-3 * x);
                assert_eq!(grid.link_at(node_m + 1e-9), link, "{tip_links}");
                assert_eq!(grid.link_at(middle_m), link, "{tip_links}");
                assert_eq!(grid.sample(2 * link + 1) * 2e-3, middle_m);
            }
            assert_eq!(grid.node(tip_links), 0.5 * tip_links as f64);
        }
    }
}
