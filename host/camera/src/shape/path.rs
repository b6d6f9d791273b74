//! Orders the pixels of a skeleton from the entry to the tip.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::Vector2;

use super::mask::{Mask, neighbours};

/// A gap in the catheter is bridged up to this length, in widths: a reflection or a seam of the phantom.
const MOST_GAP_WIDTHS: f64 = 8.0;
/// What goes on behind a gap lies ahead within this angle \[rad\].
const MOST_GAP_TURN_RAD: f64 = 0.5;
/// Length over which the direction at an end is taken, in widths.
const DIRECTION_WIDTHS: f64 = 3.0;
/// More gaps are no catheter.
const MOST_GAPS: usize = 8;

/// The pixels of the catheter's middle in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// From the entry to the tip.
    pub pixels: Vec<[f64; 2]>,
    /// Length of the gaps that were bridged \[px\].
    pub bridged_px: f64,
    /// Length of the skeleton's longest branch that is not on the path \[px\].
    pub side_branch_px: f64,
}

/// The longest way along a skeleton from the pixel nearest to `entry`; side branches are left out.
/// Gaps are bridged where the skeleton goes on straight ahead.
///
/// `Err`: the distance of the nearest pixel from the entry \[px\], which is more than `most_px`.
pub fn longest_path(
    skeleton: &Mask,
    entry: [f64; 2],
    most_px: f64,
    width_px: f64,
) -> Result<Path, f64> {
    let width = skeleton.width;
    let place = |i: usize| Vector2::new((i % width) as f64, (i / width) as f64);
    let pixels: Vec<usize> = (0..skeleton.part.len()).filter(|i| skeleton.part[*i] != 0).collect();
    let from_entry = |i: &usize| (place(*i) - Vector2::from(entry)).norm();
    let nearest = pixels.iter().copied().min_by(|a, b| from_entry(a).total_cmp(&from_entry(b)));
    let Some(start) = nearest.filter(|start| from_entry(start) <= most_px) else {
        return Err(nearest.map_or(f64::INFINITY, |i| from_entry(&i)));
    };
    let mut graph = Graph { skeleton, length: vec![f64::INFINITY; skeleton.part.len()] };
    let mut path = graph.farthest_from(start);
    let mut bridged_px = 0.0;
    for _ in 0..MOST_GAPS {
        let Some(end) = path.last().map(|i| place(*i)) else { break };
        let back = path.len().saturating_sub((DIRECTION_WIDTHS * width_px) as usize);
        let behind = place(path[back.min(path.len() - 1)]);
        let Some(ahead) = (end - behind).try_normalize(1e-9) else { break };
        let goes_on = |i: &usize| {
            let to = place(*i) - end;
            let is_new = graph.length[*i].is_infinite();
            is_new
                && to.norm() < MOST_GAP_WIDTHS * width_px
                && to.normalize().dot(&ahead) > MOST_GAP_TURN_RAD.cos()
        };
        let distance = |i: &usize| (place(*i) - end).norm();
        let next = pixels.iter().copied().filter(goes_on);
        let Some(next) = next.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { break };
        let rest = graph.farthest_from(next);
        // The edge of a vessel lies across, and the catheter goes on.
        let begins = rest.get((DIRECTION_WIDTHS * width_px) as usize).or(rest.last());
        let along = begins.and_then(|i| (place(*i) - place(next)).try_normalize(1e-9));
        if along.is_some_and(|along| along.dot(&ahead) > MOST_GAP_TURN_RAD.cos()) {
            bridged_px += distance(&next);
            path.extend(rest);
        }
    }
    let side_branch_px = graph.longest_branch(&path);
    let pixels = path.into_iter().map(|i| place(i).into()).collect();
    Ok(Path { pixels, bridged_px, side_branch_px })
}

/// A skeleton with the length of the way to each pixel that was reached \[px\].
struct Graph<'a> {
    skeleton: &'a Mask,
    length: Vec<f64>,
}

/// A pixel to go on from, the nearest first.
struct Open(f64, usize);

impl Graph<'_> {
    /// The shortest way from a pixel to the one that is farthest away along the skeleton.
    fn farthest_from(&mut self, start: usize) -> Vec<usize> {
        let far = self.spread(&[start]);
        let mut path = vec![far];
        let mut here = far;
        // Downhill to the start; every pixel but it has a neighbour that is nearer.
        while here != start {
            let near = neighbours(here, self.skeleton.width).into_iter();
            let Some(next) = near.min_by(|a, b| self.length[*a].total_cmp(&self.length[*b])) else {
                break;
            };
            if self.length[next] >= self.length[here] {
                break;
            }
            path.push(next);
            here = next;
        }
        path.reverse();
        path
    }

    /// Finds the length of the way from the starts to each pixel. Returns the farthest.
    fn spread(&mut self, starts: &[usize]) -> usize {
        let mut open: BinaryHeap<Open> = starts.iter().map(|i| Open(0.0, *i)).collect();
        starts.iter().for_each(|i| self.length[*i] = 0.0);
        let mut far = (0.0, starts.first().copied().unwrap_or_default());
        while let Some(Open(length, here)) = open.pop() {
            if length > self.length[here] {
                continue;
            }
            if length > far.0 {
                far = (length, here);
            }
            for (k, next) in neighbours(here, self.skeleton.width).into_iter().enumerate() {
                let step = if k % 2 == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
                if self.skeleton.part[next] != 0 && length + step < self.length[next] {
                    self.length[next] = length + step;
                    open.push(Open(length + step, next));
                }
            }
        }
        far.1
    }

    /// The greatest distance from the path along what else was reached \[px\].
    fn longest_branch(&mut self, path: &[usize]) -> f64 {
        if path.is_empty() {
            return 0.0;
        }
        let mut from_path =
            Graph { skeleton: self.skeleton, length: vec![f64::INFINITY; self.length.len()] };
        let far = from_path.spread(path);
        from_path.length[far]
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    /// A heap gives the greatest first; the nearest is wanted.
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skeleton(pixels: impl IntoIterator<Item = (usize, usize)>) -> Mask {
        let mut mask = Mask { width: 100, height: 50, part: vec![0; 5000] };
        pixels.into_iter().for_each(|(x, y)| mask.part[y * 100 + x] = 1);
        mask
    }

    #[test]
    fn the_path_is_ordered_from_the_entry_and_leaves_branches_out() {
        let line = (10..80).map(|x| (x, 20));
        let branch = (0..8).map(|k| (40 + k, 20 + k));
        let found = longest_path(&skeleton(line.chain(branch)), [8.0, 22.0], 10.0, 4.0).unwrap();
        assert_eq!(found.pixels.first(), Some(&[10.0, 20.0]));
        assert_eq!(found.pixels.last(), Some(&[79.0, 20.0]));
        assert_eq!((found.pixels.len(), found.bridged_px), (70, 0.0));
        assert!((5.0..12.0).contains(&found.side_branch_px), "{}", found.side_branch_px);
    }

    #[test]
    fn a_gap_is_bridged_ahead_and_not_aside() {
        let ahead = (10..40).chain(50..80).map(|x| (x, 20));
        let aside = (0..20).map(|k| (42, 25 + k));
        let found = longest_path(&skeleton(ahead.chain(aside)), [10.0, 20.0], 5.0, 4.0).unwrap();
        assert_eq!((found.pixels.last(), found.bridged_px), (Some(&[79.0, 20.0]), 11.0));
    }

    #[test]
    fn a_line_across_the_way_is_not_taken_for_the_catheter() {
        let catheter = (10..40).map(|x| (x, 20));
        let edge = (5..45).map(|y| (50, y));
        let found = longest_path(&skeleton(catheter.chain(edge)), [10.0, 20.0], 5.0, 4.0).unwrap();
        assert_eq!((found.pixels.last(), found.bridged_px), (Some(&[39.0, 20.0]), 0.0));
    }

    #[test]
    fn far_from_the_entry_nothing_is_taken() {
        let line = skeleton((30..80).map(|x| (x, 20)));
        assert_eq!(longest_path(&line, [10.0, 20.0], 10.0, 4.0), Err(20.0));
    }
}
