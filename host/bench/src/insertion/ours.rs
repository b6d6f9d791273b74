//! The insertion with the model of this project.

use std::time::Duration;

use cathforce_bundle::geometry::TubeWall;
use cathforce_bundle::lumen::{BuiltLumen, LumenOptions, build_lumen};
use cathforce_mechanics::{Compiled, Drive, Lumen, Model, State, settle, step};

use super::{Insertion, Series};
use crate::clock::Stopwatch;

impl Insertion {
    /// The tube's wall on a grid, in the device's form.
    pub fn lumen(&self, cell_m: f64) -> anyhow::Result<BuiltLumen> {
        let wall = TubeWall::new(&[self.tube.branch()]);
        let options = LumenOptions::for_instrument(self.radius_m, cell_m);
        build_lumen(&wall, options).ok_or_else(|| anyhow::anyhow!("the tube has too many bricks"))
    }
}

/// Plays the insertion with at most `LINKS` links; gives the forces and the
/// processor time of all ticks.
pub fn play<T: Compiled<LINKS>, const LINKS: usize>(
    insertion: &Insertion,
    link_length_m: f64,
    lumen: &Lumen<'_>,
) -> anyhow::Result<(Series, Duration)> {
    let description = insertion.description::<T>(link_length_m);
    let model = Model::<T, LINKS>::new(description)
        .map_err(|error| anyhow::anyhow!("the insertion's description: {error:?}"))?;
    let mut state = State::new();
    let at =
        |sample| Drive { insertion_m: T::lit(insertion.at_m(sample)), rotation_rad: T::zero() };
    while !settle(&model, lumen, &mut state, at(0)) {}
    let samples = insertion.samples();
    let mut outputs = Vec::with_capacity(samples);
    let watch = Stopwatch::start();
    for sample in 1..=samples {
        outputs.push(step(&model, lumen, &mut state, at(sample)).force_on_vessel_n);
    }
    let took = watch.elapsed();
    let forces = outputs.iter().map(|force| force.map(T::to_f64));
    let insertions = (1..=samples).map(|sample| insertion.at_m(sample));
    Ok((insertions.zip(forces).collect(), took))
}
