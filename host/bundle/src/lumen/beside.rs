//! Random places beside a wall.

use nalgebra::Vector3;

use crate::geometry::{Triangle, Wall};

/// A small generator of uniform numbers in [0, 1): xorshift64*.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Places beside a wall, drawn on its facets and off them along their normals.
pub(super) struct Beside<'a> {
    wall: &'a dyn Wall,
    /// Cumulative areas of the facets; facets past openings have none.
    up_to: Vec<f64>,
    random: Random,
}

impl<'a> Beside<'a> {
    pub(super) fn new(wall: &'a dyn Wall) -> Self {
        let area = |[a, b, c]: Triangle| (b - a).cross(&(c - a)).norm();
        let mut sum = 0.0;
        let up_to = (0..wall.facets())
            .map(|index| {
                sum += wall.facet(index).map_or(0.0, area);
                sum
            })
            .collect();
        Self { wall, up_to, random: Random(0x9E37_79B9_7F4A_7C15) }
    }

    /// A place on a facet, and the unit normal there into the lumen; `None` without facets.
    fn facet(&mut self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let at = self.random.next() * self.up_to.last()?;
        let [a, b, c] = self.wall.facet(self.up_to.partition_point(|&sum| sum <= at))?;
        let (mut u, mut v) = (self.random.next(), self.random.next());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        Some((a + (b - a) * u + (c - a) * v, normal))
    }

    /// A place between these distances from a facet \[m\].
    pub(super) fn place(&mut self, from_m: f64, to_m: f64) -> Option<Vector3<f64>> {
        let (on_facet, normal) = self.facet()?;
        Some(on_facet + normal * (from_m + (to_m - from_m) * self.random.next()))
    }
}

/// Radius of the widest place, searched along the normals of a few hundred facets \[m\].
pub fn widest_m(wall: &dyn Wall) -> f64 {
    const FACETS: usize = 200;
    const FIRST_M: f64 = 10e-6;
    const STEP: f64 = 1.2;
    let (low, high) = wall.bounds_m();
    let span_m = (high - low).norm();
    let mut beside = Beside::new(wall);
    let mut widest_m = 0.0_f64;
    for _ in 0..FACETS {
        let Some((on_facet, normal)) = beside.facet() else { continue };
        let mut off_m = FIRST_M;
        while off_m < span_m {
            let here = wall.sample(&(on_facet + normal * off_m));
            if here.beyond_m <= 0.0 {
                widest_m = widest_m.max(here.distance_m);
            }
            off_m *= STEP;
        }
    }
    widest_m
}
