//! Lens and poses that fit all corners of all pictures best.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use crate::least_squares::{Linear, Problem, minimise};
use crate::lens::model::{Lens, PARAMETERS};
use crate::lens::pose::{Pose, squared};

/// A lens, and the pose of the board in each picture.
#[derive(Clone, Debug)]
pub struct Views {
    pub lens: Lens,
    pub poses: Vec<Pose>,
}

/// The corners that were seen.
pub struct Corners<'a> {
    /// The board's corners \[m\], in its plane z = 0.
    pub points_m: &'a [Vector3<f64>],
    /// The pixels of those corners, for each picture.
    pub pixels: &'a [Vec<[f64; 2]>],
    /// How many of the lens's numbers are fitted; the others keep their values.
    pub fitted: usize,
}

impl Corners<'_> {
    /// Fits lens and poses.
    pub fn fit(&self, start: Views) -> Views {
        minimise(self, start)
    }

    /// Root of the mean squared distance between corners and their expected pixels, of each picture \[px\].
    pub fn errors_px(&self, views: &Views) -> Vec<f64> {
        let of = |(pose, pixels): (&Pose, &Vec<[f64; 2]>)| {
            let corners = self.points_m.iter().zip(pixels);
            let sum: f64 = corners.map(|(m, px)| squared(&views.lens, pose, *m, *px)).sum();
            (sum / self.points_m.len() as f64).sqrt()
        };
        views.poses.iter().zip(self.pixels).map(of).collect()
    }

    /// Standard deviations of the lens's numbers, from the scatter of the corners.
    pub fn lens_sd(&self, views: &Views) -> [f64; PARAMETERS] {
        let Linear { square, cost, .. } = self.linear(views);
        let residuals = 2 * self.points_m.len() * self.pixels.len();
        let freedom = residuals.saturating_sub(square.nrows()).max(1) as f64;
        let spread = square.try_inverse();
        std::array::from_fn(|k| match &spread {
            Some(spread) if k < self.fitted => (spread[(k, k)] * cost / freedom).sqrt(),
            Some(_) => 0.0,
            None => f64::INFINITY,
        })
    }
}

impl Problem for Corners<'_> {
    type State = Views;

    fn linear(&self, views: &Views) -> Linear {
        let size = self.fitted + 6 * views.poses.len();
        let (mut square, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let mut cost = 0.0;
        for (view, (pose, pixels)) in views.poses.iter().zip(self.pixels).enumerate() {
            let at = self.fitted + 6 * view;
            for (point, pixel) in self.points_m.iter().zip(pixels) {
                let (found, by_pose, by_lens) = pose.seen(&views.lens, *point);
                let by_lens = by_lens.columns(0, self.fitted);
                let residual = Vector2::new(found[0] - pixel[0], found[1] - pixel[1]);
                let mut add = |row: usize, column: usize, block: DMatrix<f64>| {
                    let (rows, columns) = block.shape();
                    let mut place = square.view_mut((row, column), (rows, columns));
                    place += block;
                };
                let turned = by_pose.transpose();
                let mixed =
                    DMatrix::from_iterator(6, self.fitted, (turned * by_lens).iter().copied());
                add(at, 0, mixed.clone());
                add(0, at, mixed.transpose());
                let own = turned * by_pose;
                add(at, at, DMatrix::from_iterator(6, 6, own.iter().copied()));
                add(0, 0, by_lens.transpose() * by_lens);
                let mut of_lens = gradient.rows_mut(0, self.fitted);
                of_lens += by_lens.transpose() * residual;
                let mut of_pose = gradient.rows_mut(at, 6);
                of_pose += turned * residual;
                cost += residual.norm_squared();
            }
        }
        Linear { square, gradient, cost }
    }

    fn moved(&self, views: &Views, step: &DVector<f64>) -> Views {
        let mut parameters = views.lens.parameters();
        parameters.iter_mut().zip(step.iter()).take(self.fitted).for_each(|(p, d)| *p += d);
        let part = |from: usize| Vector3::new(step[from], step[from + 1], step[from + 2]);
        let poses = views.poses.iter().enumerate().map(|(view, pose)| {
            let at = self.fitted + 6 * view;
            pose.moved(part(at), part(at + 3))
        });
        Views { lens: views.lens.with_parameters(parameters), poses: poses.collect() }
    }

    fn cost(&self, views: &Views) -> f64 {
        let pictures = views.poses.iter().zip(self.pixels);
        pictures
            .flat_map(|(pose, pixels)| {
                let corners = self.points_m.iter().zip(pixels);
                corners.map(|(m, px)| squared(&views.lens, pose, *m, *px))
            })
            .sum()
    }
}
