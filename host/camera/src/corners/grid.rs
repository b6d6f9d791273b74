//! Orders crossings into the grid of a board.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector2;

use super::candidates::Candidate;

/// Place in a grid, from any crossing of it.
type Cell = (i32, i32);

/// How far a corner may lie from where its neighbours expect it, in steps of the grid: perspective
/// and distortion change a step by less than that from one square to the next.
const MOST_ERROR: f64 = 0.3;
/// How far a first neighbour may lie beside the direction of an edge \[rad\].
const MOST_TURN_RAD: f64 = 0.35;
/// From so many crossings a grid is begun; any crossing of the board serves.
const MOST_SEEDS: usize = 40;

/// A grid of crossings without holes: `columns` × `rows` indices of candidates, row by row. Rows run
/// to the right of columns as y runs to the right of x in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub columns: usize,
    pub rows: usize,
    pub corners: Vec<usize>,
}

/// The largest grid that the candidates hold, at best one of `wanted` corners.
pub fn largest(candidates: &[Candidate], wanted: usize) -> Option<Grid> {
    let mut best: Option<Grid> = None;
    let mut seeds: Vec<usize> = (0..candidates.len()).collect();
    // The board's crossings have the most contrast.
    seeds.sort_by(|a, b| candidates[*b].contrast.total_cmp(&candidates[*a].contrast));
    let mut used = vec![false; candidates.len()];
    let mut tries = 0;
    for seed in seeds {
        if used[seed] || tries == MOST_SEEDS {
            continue;
        }
        tries += 1;
        let cells = grow(candidates, seed);
        cells.values().for_each(|corner| used[*corner] = true);
        let grid = without_holes(&cells);
        let size = |grid: &Grid| grid.corners.len();
        if best.as_ref().is_none_or(|best| size(&grid) > size(best)) {
            best = Some(grid);
        }
        if best.as_ref().is_some_and(|best| size(best) >= wanted) {
            break;
        }
    }
    best.filter(|grid| grid.columns > 1 && grid.rows > 1)
}

/// Crossings that are neighbours of neighbours of a seed.
fn grow(candidates: &[Candidate], seed: usize) -> BTreeMap<Cell, usize> {
    let mut cells = BTreeMap::from([((0, 0), seed)]);
    let mut taken = vec![false; candidates.len()];
    taken[seed] = true;
    let mut queue = VecDeque::from([(0, 0)]);
    while let Some(cell) = queue.pop_front() {
        for side in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let next = (cell.0 + side.0, cell.1 + side.1);
            if cells.contains_key(&next) {
                continue;
            }
            let found = neighbour(candidates, &cells, &taken, cell, side);
            if let Some(found) = found {
                taken[found] = true;
                cells.insert(next, found);
                queue.push_back(next);
            }
        }
    }
    cells
}

/// The crossing beside a cell of the grid.
fn neighbour(
    candidates: &[Candidate],
    cells: &BTreeMap<Cell, usize>,
    taken: &[bool],
    cell: Cell,
    side: Cell,
) -> Option<usize> {
    let place = |cell: Cell| cells.get(&cell).map(|i| Vector2::from(candidates[*i].pixel));
    let here = place(cell)?;
    let this = &candidates[*cells.get(&cell)?];
    let free = || (0..candidates.len()).filter(|i| !taken[*i]);
    // Neighbours have their dark sectors the other way round.
    let fits = |i: &usize, along: Vector2<f64>| {
        let other = &candidates[*i];
        let diagonal = along.normalize() + Vector2::new(-along.y, along.x).normalize();
        this.is_dark_towards(diagonal.into()) != other.is_dark_towards(diagonal.into())
    };
    let nearest = |expected: Vector2<f64>, step: Vector2<f64>| {
        let error = |i: &usize| (Vector2::from(candidates[*i].pixel) - expected).norm();
        let best = free().min_by(|a, b| error(a).total_cmp(&error(b)))?;
        (error(&best) < MOST_ERROR * step.norm() && fits(&best, step)).then_some(best)
    };
    if let Some(behind) = place((cell.0 - side.0, cell.1 - side.1)) {
        return nearest(2.0 * here - behind, here - behind);
    }
    // The row beside has made the same step.
    for beside in [(side.1, side.0), (-side.1, -side.0)] {
        let from = place((cell.0 + beside.0, cell.1 + beside.1));
        let to = place((cell.0 + beside.0 + side.0, cell.1 + beside.1 + side.1));
        if let Some((from, to)) = from.zip(to) {
            return nearest(here + to - from, to - from);
        }
    }
    // A first step: along one edge, to the nearest crossing there.
    let edge = if side.0 != 0 { this.edges_rad[0] } else { this.edges_rad[1] };
    let sign = f64::from(side.0 + side.1);
    let along = sign * Vector2::new(edge.cos(), edge.sin());
    let ahead = free().filter(|i| {
        let to = Vector2::from(candidates[*i].pixel) - here;
        to.normalize().dot(&along) > MOST_TURN_RAD.cos() && fits(i, along)
    });
    let distance = |i: &usize| (Vector2::from(candidates[*i].pixel) - here).norm();
    ahead.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The largest rectangle of a grid that has all its corners.
fn without_holes(cells: &BTreeMap<Cell, usize>) -> Grid {
    let mut low = (i32::MAX, i32::MAX);
    let mut high = (i32::MIN, i32::MIN);
    for (i, j) in cells.keys() {
        low = (low.0.min(*i), low.1.min(*j));
        high = (high.0.max(*i), high.1.max(*j));
    }
    // The side with the most missing corners goes, until none is missing.
    loop {
        let column = |i: i32| (low.1..=high.1).filter(|j| !cells.contains_key(&(i, *j))).count();
        let row = |j: i32| (low.0..=high.0).filter(|i| !cells.contains_key(&(*i, j))).count();
        let whole = (low.0..=high.0).all(|i| column(i) == 0);
        if whole || low.0 >= high.0 || low.1 >= high.1 {
            break;
        }
        let share = |missing: usize, of: i32| missing as f64 / f64::from(of + 1);
        let (tall, wide) = (high.1 - low.1, high.0 - low.0);
        let sides = [
            share(column(low.0), tall),
            share(column(high.0), tall),
            share(row(low.1), wide),
            share(row(high.1), wide),
        ];
        let worst = (0..4).max_by(|a, b| sides[*a].total_cmp(&sides[*b])).unwrap_or(0);
        // A hole in the middle: any side is as good.
        match worst {
            0 => low.0 += 1,
            1 => high.0 -= 1,
            2 => low.1 += 1,
            _ => high.1 -= 1,
        }
    }
    let cell = |i: i32, j: i32| cells.get(&(i, j)).copied();
    let corners = (low.1..=high.1).flat_map(|j| (low.0..=high.0).filter_map(move |i| cell(i, j)));
    let corners: Vec<usize> = corners.collect();
    let (columns, rows) = ((high.0 - low.0 + 1) as usize, (high.1 - low.1 + 1) as usize);
    Grid { columns, rows, corners }
}

impl Grid {
    /// The same corners counted from another side, so that there are `columns` in a row, y lies to the
    /// right of x as in a picture that is not mirrored, and, if it can be told, the square outside of
    /// the first corner is dark. Returns `None` if the size is another.
    pub fn oriented(&self, candidates: &[Candidate], size: [usize; 2]) -> Option<Vec<usize>> {
        let [columns, rows] = size;
        let same = [self.columns, self.rows] == size;
        if !same && [self.rows, self.columns] != size {
            return None;
        }
        let at = |i: usize, j: usize| self.corners[j * self.columns + i];
        let turned = |i: usize, j: usize| if same { at(i, j) } else { at(j, i) };
        let mut corners: Vec<usize> =
            (0..rows).flat_map(|j| (0..columns).map(move |i| turned(i, j))).collect();
        let place = |corners: &[usize], i: usize, j: usize| {
            Vector2::from(candidates[corners[j * columns + i]].pixel)
        };
        let axes = |corners: &[usize]| {
            let first = place(corners, 0, 0);
            [place(corners, columns - 1, 0) - first, place(corners, 0, rows - 1) - first]
        };
        let [x, y] = axes(&corners);
        if x.perp(&y) < 0.0 {
            corners.chunks_mut(columns).for_each(<[usize]>::reverse);
        }
        let [x, y] = axes(&corners);
        let outside = -(x.normalize() + y.normalize());
        let is_turned = if (columns + rows) % 2 == 1 {
            !candidates[corners[0]].is_dark_towards(outside.into())
        } else {
            // Any side will do: the one that looks upright.
            let (first, last) = (place(&corners, 0, 0), place(&corners, columns - 1, rows - 1));
            last.x + last.y < first.x + first.y
        };
        if is_turned {
            corners.reverse();
        }
        Some(corners)
    }
}
