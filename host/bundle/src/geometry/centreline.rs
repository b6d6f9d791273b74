//! A vessel given as centrelines with radii: the union of swept round tubes.

use nalgebra::Vector3;
use thiserror::Error;

use super::wall::{Triangle, Wall, WallPoint};
use crate::place::Place;
use crate::table::{Table, TableCause};

/// Branches run into each other over about this width \[m\].
const BLEND_M: f64 = 1e-3;
/// Length of the straight pieces that stand for the curved centreline \[m\].
const PIECE_M: f64 = 0.25e-3;
/// A tube goes on straight for so long past an opening \[m\].
const EXTENSION_M: f64 = 0.02;
/// Sides of the prism from which places beside the wall are drawn.
const SIDES: usize = 16;

/// No rig is larger \[m\]; the model takes no entry that is farther away.
const FARTHEST_M: f64 = 10.0;
/// How much longer an arc may be than the chord of two stations: a half circle is π/2 times as long, and
/// stations that are farther apart do not describe a vessel.
const ARC_OVER_CHORD: f64 = 2.0;
/// How much shorter s_m may be than the way along the chords, and how far it may be off between two
/// stations \[m\]: both columns are rounded, and tools measure the arc on a finer line.
const SHORT: f64 = 0.9;
const ROUNDED_M: f64 = 2e-4;

/// A hint at the unit of s_m, by its ratio to the coordinates.
fn of_unit(ratio: f64) -> &'static str {
    match ratio {
        900.0..=1600.0 => ": is s_m in millimetres?",
        90.0..=160.0 => ": is s_m in centimetres?",
        0.0009..=0.0016 => ": are the coordinates in millimetres?",
        0.009..=0.016 => ": are the coordinates in centimetres?",
        _ => "",
    }
}

const COLUMNS: [&str; 6] = ["branch", "s_m", "x_m", "y_m", "z_m", "radius_m"];

/// Why `centreline.csv` is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CentrelineCause {
    #[error(transparent)]
    Table(#[from] TableCause),
    #[error("radius_m is {0}; a vessel has a radius above 0")]
    Radius(f64),
    #[error("s_m does not grow along branch `{0}`")]
    Order(String),
    #[error("s_m grows by {step_m} here, but the stations are {chord_m:.6} m apart{}", of_unit(step_m / chord_m))]
    ArcLength { step_m: f64, chord_m: f64 },
    #[error("branch `{branch}` is {arc_m:.6} m long by s_m, but {chords_m:.6} m by its stations{}", of_unit(arc_m / chords_m))]
    Length { branch: String, arc_m: f64, chords_m: f64 },
    #[error("{0:?} m is farther than {FARTHEST_M} m from the origin: millimetres for metres?")]
    Far(f64),
    #[error("two stations of branch `{0}` stand in one place")]
    Repeated(String),
    #[error("branch `{branch}` has {stations} station(s); a tube needs at least two")]
    TooShort { branch: String, stations: usize },
    #[error("there are no stations")]
    Empty,
}

impl CentrelineCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            CentrelineCause::Table(cause) => cause.fix(),
            CentrelineCause::Radius(_) => "give the radius of the lumen in metres".into(),
            CentrelineCause::ArcLength { .. } | CentrelineCause::Length { .. } => {
                "give s_m as the length along the stations, in metres like their coordinates".into()
            }
            CentrelineCause::Far(_) => {
                "give the coordinates in metres, from an origin near the vessel".into()
            }
            CentrelineCause::Order(_) | CentrelineCause::Repeated(_) => {
                "sort the rows of each branch by s_m, without repeats".into()
            }
            CentrelineCause::TooShort { .. } | CentrelineCause::Empty => {
                "add stations along the branch, about one every 2 mm".into()
            }
        }
    }
}

/// One station of a centreline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Arc length along the branch \[m\].
    pub s_m: f64,
    /// Vessel frame \[m\].
    pub position_m: Vector3<f64>,
    /// Radius of the lumen \[m\].
    pub radius_m: f64,
}

/// A named centreline.
#[derive(Clone, Debug, PartialEq)]
pub struct Branch {
    pub name: String,
    pub stations: Vec<Station>,
}

/// Branches, and remarks on what was left out of them.
type Read = (Vec<Branch>, Vec<(Place, String)>);

/// Reads the text of `centreline.csv`. A station that stands there twice, as tools write the end of a
/// branch, is left out with a remark.
pub fn read_centreline(text: &str) -> Result<Read, (Place, CentrelineCause)> {
    let table_fault = |(place, cause)| (place, CentrelineCause::Table(cause));
    let table = Table::parse(text).map_err(table_fault)?;
    table.check_columns(&COLUMNS, &COLUMNS, |_| false).map_err(table_fault)?;
    let column = |name| table.full_column(name).map_err(table_fault);
    let (s_m, x_m, y_m, z_m) = (column("s_m")?, column("x_m")?, column("y_m")?, column("z_m")?);
    let radius_m = column("radius_m")?;
    let field = |name| table.column(name).unwrap_or_default();
    let place = |row, name| Place::LineColumn(table.line(row), field(name) + 1);

    let mut branches: Vec<Branch> = Vec::new();
    let mut remarks = Vec::new();
    for row in 0..table.len() {
        let name = table.text(row, field("branch"));
        let station = Station {
            s_m: s_m[row],
            position_m: Vector3::new(x_m[row], y_m[row], z_m[row]),
            radius_m: radius_m[row],
        };
        if station.radius_m <= 0.0 {
            let cause = CentrelineCause::Radius(station.radius_m);
            return Err((place(row, "radius_m"), cause));
        }
        let far = ["x_m", "y_m", "z_m"].into_iter().zip(station.position_m.iter());
        let far = far.chain([("radius_m", &station.radius_m), ("s_m", &station.s_m)]);
        // In millimetres s_m alone is beyond it, which is said better below.
        let beyond = |(name, x): &(&str, &f64)| {
            x.abs() > if *name == "s_m" { 1e3 * FARTHEST_M } else { FARTHEST_M }
        };
        if let Some((name, x)) = far.into_iter().find(beyond) {
            return Err((place(row, name), CentrelineCause::Far(*x)));
        }
        let known = branches.iter().position(|branch| branch.name == name);
        let at = known.unwrap_or_else(|| {
            branches.push(Branch { name: name.to_owned(), stations: Vec::new() });
            branches.len() - 1
        });
        let stations = &mut branches[at].stations;
        if let Some(last) = stations.last() {
            if (last.s_m, last.position_m) == (station.s_m, station.position_m) {
                let remark = format!(
                    "this station of branch `{name}` is the one before it once more, and is left out"
                );
                remarks.push((Place::Line(table.line(row)), remark));
                continue;
            }
            if last.s_m >= station.s_m {
                return Err((place(row, "s_m"), CentrelineCause::Order(name.to_owned())));
            }
            if last.position_m == station.position_m {
                return Err((place(row, "x_m"), CentrelineCause::Repeated(name.to_owned())));
            }
        }
        stations.push(station);
    }
    if branches.is_empty() {
        return Err((Place::Whole, CentrelineCause::Empty));
    }
    if let Some(short) = branches.iter().find(|branch| branch.stations.len() < 2) {
        let (branch, stations) = (short.name.clone(), short.stations.len());
        return Err((Place::Whole, CentrelineCause::TooShort { branch, stations }));
    }
    for branch in &branches {
        let line = |station: &Station| {
            let is_it = |row: &usize| {
                table.text(*row, field("branch")) == branch.name && s_m[*row] == station.s_m
            };
            (0..table.len()).find(is_it).map_or(Place::Whole, |row| place(row, "s_m"))
        };
        check_arc_length(branch).map_err(|(station, cause)| (line(station), cause))?;
    }
    Ok((branches, remarks))
}

/// Holds s_m of a branch against the coordinates of its stations.
fn check_arc_length(branch: &Branch) -> Result<(), (&Station, CentrelineCause)> {
    let pairs = || branch.stations.windows(2).map(|pair| (&pair[0], &pair[1]));
    let chord_m = |a: &Station, b: &Station| (b.position_m - a.position_m).norm();
    let (arc_m, chords_m) = pairs().fold((0.0, 0.0), |(arc_m, chords_m), (a, b)| {
        (arc_m + b.s_m - a.s_m, chords_m + chord_m(a, b))
    });
    let is_off = |arc_m: f64, chord_m: f64| {
        arc_m > ARC_OVER_CHORD * chord_m + ROUNDED_M || arc_m < SHORT * chord_m - ROUNDED_M
    };
    if is_off(arc_m, chords_m)
        && let Some((_, second)) = pairs().next()
    {
        let branch = branch.name.clone();
        return Err((second, CentrelineCause::Length { branch, arc_m, chords_m }));
    }
    match pairs().find(|(a, b)| is_off(b.s_m - a.s_m, chord_m(a, b))) {
        None => Ok(()),
        Some((a, b)) => {
            let (step_m, chord_m) = (b.s_m - a.s_m, chord_m(a, b));
            Err((b, CentrelineCause::ArcLength { step_m, chord_m }))
        }
    }
}

/// A short straight piece whose radius changes evenly.
#[derive(Clone, Copy, Debug)]
struct Piece {
    start: Vector3<f64>,
    axis: Vector3<f64>,
    length_m: f64,
    radius_m: f64,
    /// Change of the radius per length.
    taper: f64,
    /// How far past an opening the piece begins and ends \[m\]; both 0 along the tube.
    beyond_m: [f64; 2],
}

impl Piece {
    fn between(a: (Vector3<f64>, f64), b: (Vector3<f64>, f64), beyond_m: [f64; 2]) -> Option<Self> {
        let length_m = (b.0 - a.0).norm();
        let axis = (b.0 - a.0).try_normalize(1e-12)?;
        let taper = (b.1 - a.1) / length_m;
        Some(Self { start: a.0, axis, length_m, radius_m: a.1, taper, beyond_m })
    }

    /// How far along the piece its nearest point is \[m\], and the way from there.
    fn off_axis(&self, p: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let from_start = p - self.start;
        let s = from_start.dot(&self.axis).clamp(0.0, self.length_m);
        (s, from_start - self.axis * s)
    }

    /// Distance to the wall of the tube. `radius_m` is measured across the axis, so a tapering wall
    /// leans by its taper.
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        let (s, from_axis) = self.off_axis(p);
        let across_m = from_axis.norm();
        let inwards = if across_m > 1e-12 { -from_axis / across_m } else { Vector3::zeros() };
        let lean = (1.0 + self.taper * self.taper).sqrt();
        let share = s / self.length_m;
        WallPoint {
            distance_m: (self.radius_m + self.taper * s - across_m) / lean,
            normal: (inwards + self.axis * self.taper).try_normalize(1e-9).unwrap_or(self.axis),
            beyond_m: self.beyond_m[0] + (self.beyond_m[1] - self.beyond_m[0]) * share,
        }
    }
}

impl Piece {
    /// One of the facets of its hull, a prism.
    fn facet(&self, index: usize) -> Triangle {
        let least = Vector3::ith(self.axis.iamin(), 1.0);
        let across = self.axis.cross(&least).normalize();
        let beside = self.axis.cross(&across);
        let corner = |along_m: f64, side: usize| {
            let angle = std::f64::consts::TAU * side as f64 / SIDES as f64;
            let out = across * angle.cos() + beside * angle.sin();
            self.start + self.axis * along_m + out * (self.radius_m + self.taper * along_m)
        };
        let (side, far_m) = (index / 2, self.length_m);
        match index % 2 {
            0 => [corner(0.0, side), corner(far_m, side), corner(far_m, side + 1)],
            _ => [corner(0.0, side), corner(far_m, side + 1), corner(0.0, side + 1)],
        }
    }
}

/// Pieces in a [`Run`]: about the square root of the pieces of a branch.
const RUN: usize = 16;
/// Rounding of distances in a vessel \[m\], with a margin of a thousand.
const ROUNDING_M: f64 = 1e-12;

/// A few pieces that follow each other, and a ball around them.
#[derive(Clone, Debug)]
struct Run {
    pieces: Vec<Piece>,
    centre: Vector3<f64>,
    radius_m: f64,
}

impl Run {
    fn of(pieces: &[Piece]) -> Self {
        let ends = || pieces.iter().flat_map(|p| [p.start, p.start + p.axis * p.length_m]);
        let centre = ends().sum::<Vector3<f64>>() / (2 * pieces.len()) as f64;
        let radius_m = ends().map(|end| (end - centre).norm()).fold(0.0, f64::max);
        Self { pieces: pieces.to_vec(), centre, radius_m }
    }

    /// No piece is nearer \[m\].
    fn bound_m(&self, p: &Vector3<f64>) -> f64 {
        (p - self.centre).norm() - self.radius_m - ROUNDING_M
    }

    /// The piece whose axis is nearest, and how near it is \[m\].
    fn nearest(&self, p: &Vector3<f64>) -> Option<(f64, &Piece)> {
        let distances = self.pieces.iter().map(|piece| (piece.off_axis(p).1.norm(), piece));
        distances.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// The pieces of a branch.
#[derive(Clone, Debug)]
struct Tube(Vec<Run>);

impl Tube {
    fn of(pieces: &[Piece]) -> Self {
        Self(pieces.chunks(RUN).map(Run::of).collect())
    }

    fn pieces(&self) -> impl Iterator<Item = &Piece> {
        self.0.iter().flat_map(|run| &run.pieces)
    }

    /// The wall around the piece whose axis is nearest; around the first one of several.
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        let bounds: Vec<f64> = self.0.iter().map(|run| run.bound_m(p)).collect();
        let first = (0..bounds.len()).min_by(|&a, &b| bounds[a].total_cmp(&bounds[b]));
        let near = first.and_then(|first| self.0[first].nearest(p));
        let within_m = near.map_or(f64::INFINITY, |(distance_m, _)| distance_m);
        let near = self.0.iter().zip(&bounds).filter(|(_, bound_m)| **bound_m <= within_m);
        let nearest = near.filter_map(|(run, _)| run.nearest(p)).min_by(|a, b| a.0.total_cmp(&b.0));
        let none =
            WallPoint { distance_m: f64::NEG_INFINITY, normal: Vector3::zeros(), beyond_m: 0.0 };
        nearest.map_or(none, |(_, piece)| piece.sample(p))
    }
}

/// The union of swept round tubes, open at the ends that lie in no other tube.
#[derive(Clone, Debug)]
pub struct TubeWall {
    branches: Vec<Tube>,
}

impl TubeWall {
    /// `branches`: at least one, of at least two stations each, as [`read_centreline`] gives.
    pub fn new(branches: &[Branch]) -> Self {
        let pieces: Vec<_> = branches.iter().map(|branch| pieces(&branch.stations)).collect();
        let tubes: Vec<_> = pieces.iter().map(|pieces| Tube::of(pieces)).collect();
        let mut open_tubes = pieces;
        for (index, branch) in branches.iter().enumerate() {
            let is_open = |station: &Station| {
                let others = tubes.iter().enumerate().filter(|(other, _)| *other != index);
                others.map(|(_, tube)| tube.sample(&station.position_m)).all(|w| w.distance_m < 0.0)
            };
            let end = |station: &Station, inner: &Station| {
                let away = (station.position_m - inner.position_m).normalize();
                let far = station.position_m + away * EXTENSION_M;
                let (from, to) = ((station.position_m, station.radius_m), (far, station.radius_m));
                Piece::between(from, to, [0.0, EXTENSION_M])
            };
            if let [first, second, ..] = &branch.stations[..]
                && is_open(first)
            {
                open_tubes[index].extend(end(first, second));
            }
            if let [.., before, last] = &branch.stations[..]
                && is_open(last)
            {
                open_tubes[index].extend(end(last, before));
            }
        }
        Self { branches: open_tubes.iter().map(|pieces| Tube::of(pieces)).collect() }
    }
}

/// Straight pieces along the cubic through the stations (Catmull–Rom over arc length).
fn pieces(stations: &[Station]) -> Vec<Piece> {
    let slope = |at: usize| {
        let (before, after) = (at.saturating_sub(1), (at + 1).min(stations.len() - 1));
        let (a, b) = (&stations[before], &stations[after]);
        let ds = b.s_m - a.s_m;
        ((b.position_m - a.position_m) / ds, (b.radius_m - a.radius_m) / ds)
    };
    let mut pieces = Vec::new();
    for at in 1..stations.len() {
        let (a, b) = (&stations[at - 1], &stations[at]);
        let ((va, ra), (vb, rb)) = (slope(at - 1), slope(at));
        let ds = b.s_m - a.s_m;
        let point = |t: f64| {
            let (t2, t3) = (t * t, t * t * t);
            let (h0, h1) = (2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t);
            let (h2, h3) = (3.0 * t2 - 2.0 * t3, t3 - t2);
            let position = a.position_m * h0 + va * (h1 * ds) + b.position_m * h2 + vb * (h3 * ds);
            (position, a.radius_m * h0 + ra * (h1 * ds) + b.radius_m * h2 + rb * (h3 * ds))
        };
        let count = (ds / PIECE_M).ceil().clamp(1.0, 1000.0) as usize;
        let share = |k: usize| k as f64 / count as f64;
        pieces.extend(
            (0..count)
                .filter_map(|k| Piece::between(point(share(k)), point(share(k + 1)), [0.0; 2])),
        );
    }
    pieces
}

impl Wall for TubeWall {
    /// Where two tubes meet, the larger distance wins over a blend of [`BLEND_M`], as a
    /// casting would round the edge.
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        let mut union: Option<WallPoint> = None;
        for tube in &self.branches {
            let here = tube.sample(p);
            union = Some(match union {
                None => here,
                Some(so_far) => blend(&so_far, &here),
            });
        }
        union.unwrap_or_else(|| Tube(Vec::new()).sample(p))
    }

    fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        let infinite = Vector3::repeat(f64::INFINITY);
        let pieces =
            self.branches.iter().flat_map(Tube::pieces).filter(|piece| piece.beyond_m == [0.0; 2]);
        pieces.fold((infinite, -infinite), |(low, high), piece| {
            let reach = Vector3::repeat(piece.radius_m + piece.length_m);
            (low.inf(&(piece.start - reach)), high.sup(&(piece.start + reach)))
        })
    }

    fn facets(&self) -> usize {
        self.branches.iter().map(|tube| tube.pieces().count() * 2 * SIDES).sum()
    }

    fn facet(&self, index: usize) -> Option<Triangle> {
        let piece = self.branches.iter().flat_map(Tube::pieces).nth(index / (2 * SIDES))?;
        (piece.beyond_m == [0.0; 2]).then(|| piece.facet(index % (2 * SIDES)))
    }
}

/// Smooth maximum: quadratic over a band of [`BLEND_M`], the maximum itself outside it.
fn blend(a: &WallPoint, b: &WallPoint) -> WallPoint {
    let (deep, shallow) = if a.distance_m >= b.distance_m { (a, b) } else { (b, a) };
    let band = (1.0 - (deep.distance_m - shallow.distance_m) / BLEND_M).max(0.0);
    let share = 0.5 * band;
    let normal = deep.normal * (1.0 - share) + shallow.normal * share;
    WallPoint {
        distance_m: deep.distance_m + 0.25 * BLEND_M * band * band,
        normal: normal.try_normalize(1e-9).unwrap_or(deep.normal),
        beyond_m: deep.beyond_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &str) -> String {
        format!("branch,s_m,x_m,y_m,z_m,radius_m\n{rows}")
    }

    #[test]
    fn arc_length_is_held_against_the_stations() {
        let rows = |s: [f64; 4]| {
            let row = |(k, s): (usize, f64)| format!("a,{s},{},0,0,0.003\n", 0.002 * k as f64);
            table(&s.into_iter().enumerate().map(row).collect::<String>())
        };
        assert!(read_centreline(&rows([0.0, 0.002, 0.004, 0.006])).is_ok());
        assert!(
            read_centreline(&rows([1.0, 1.0021, 1.004, 1.0061])).is_ok(),
            "it may begin anywhere"
        );
        let (place, cause) = read_centreline(&rows([0.0, 2.0, 4.0, 6.0])).unwrap_err();
        assert_eq!(place, Place::LineColumn(3, 2));
        assert!(cause.to_string().contains("millimetres"), "{cause}");
        let (place, cause) = read_centreline(&rows([0.0, 0.002, 0.008, 0.010])).unwrap_err();
        assert_eq!(place, Place::LineColumn(4, 2));
        assert!(cause.to_string().contains("s_m grows by 0.006"), "{cause}");
        let (_, cause) = read_centreline(&rows([0.0, 2e-6, 4e-6, 6e-6])).unwrap_err();
        assert!(cause.to_string().contains("coordinates in millimetres"), "{cause}");
    }

    #[test]
    fn a_station_that_is_there_twice_is_left_out_and_said() {
        let text = table("a,0,0,0,0,0.003\na,0.02,0.02,0,0,0.003\na,0.02,0.02,0,0,0.003\n");
        let (branches, remarks) = read_centreline(&text).unwrap();
        assert_eq!(branches[0].stations.len(), 2);
        let [(place, remark)] = &remarks[..] else { panic!("{remarks:?}") };
        assert!(*place == Place::Line(4) && remark.contains("branch `a`"), "{remarks:?}");
        let moved = table("a,0,0,0,0,0.003\na,0.02,0.02,0,0,0.003\na,0.03,0.02,0,0,0.003\n");
        assert!(matches!(read_centreline(&moved), Err((_, CentrelineCause::Repeated(_)))));
    }

    #[test]
    fn a_coordinate_beyond_any_rig_is_refused() {
        for wrong in ["1e308", "-11", "20"] {
            let text = table(&format!("a,0,0,0,0,0.003\na,0.02,0.02,{wrong},0,0.003\n"));
            let (place, cause) = read_centreline(&text).unwrap_err();
            assert_eq!(place, Place::LineColumn(3, 4), "{wrong}");
            assert!(matches!(cause, CentrelineCause::Far(_)), "{cause}");
        }
    }

    #[test]
    fn the_search_by_runs_finds_the_nearest_piece() {
        let station = |k: u8| {
            let turn = 0.4 * f64::from(k);
            let position_m =
                Vector3::new(0.02 * turn.cos(), 0.02 * turn.sin(), 1e-3 * f64::from(k));
            Station { s_m: 8e-3 * f64::from(k), position_m, radius_m: 3e-3 }
        };
        let stations: Vec<_> = (0..40).map(station).collect();
        let pieces = pieces(&stations);
        let tube = Tube::of(&pieces);
        assert!(tube.0.len() > 10, "{} runs", tube.0.len());
        // Three irrational steps fill the box around the helix evenly.
        let share = |k: u16, step: f64| (f64::from(k) * step).fract();
        for k in 0..500 {
            let [x, y, z] = [2f64.sqrt(), 3f64.sqrt(), 5f64.sqrt()].map(|step| share(k, step));
            let p = Vector3::new(0.06 * x - 0.03, 0.06 * y - 0.03, 0.05 * z - 0.005);
            let distance_m = |piece: &&Piece| piece.off_axis(&p).1.norm();
            let nearest = pieces.iter().min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
            assert_eq!(tube.sample(&p), nearest.unwrap().sample(&p), "at {p}");
        }
    }
}
