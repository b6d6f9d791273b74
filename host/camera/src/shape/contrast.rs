//! How much darker or brighter a thin thing is than the ground beside it.

use crate::filter::{blur, closing, opening, quantile};
use crate::picture::Picture;

/// What the catheter looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polarity {
    /// A dark catheter on lighter ground.
    #[default]
    Dark,
    /// A light catheter on darker ground.
    Light,
}

/// Grey value that is added to both sides of a ratio, so that the noise of dark places does not count
/// as contrast: a webcam's noise is about 2.
const DARK_GREY: f32 = 8.0;
/// The square of the ground's filter is this much wider than the catheter, so that a bend of it does not
/// fill the square.
const GROUND_WIDTHS: f64 = 3.0;

/// Contrast of each pixel, from 0 for ground to 1 for black on white.
#[derive(Clone, Debug)]
pub struct Contrast {
    /// Blurred by a quarter of the catheter's width, for what is found by threshold.
    pub smooth: Picture,
    /// Not blurred, for where an edge is.
    pub sharp: Picture,
    /// Contrast of the ground: its median, and the standard deviation of its noise.
    pub ground: [f64; 2],
}

/// The blur by which a catheter of a width is smoothed \[px\].
pub fn blur_px(width_px: f64) -> f64 {
    (0.25 * width_px).max(0.8)
}

/// A background picture, blurred as the frames will be.
pub fn background(picture: &Picture, width_px: f64) -> Picture {
    blur(picture, blur_px(width_px))
}

/// The contrast of things up to `width_px` wide.
///
/// The ground is what is left when things so narrow are filtered away, so that uneven light, which
/// changes slowly, cancels in the ratio to it. `background`, from [`background`], shows the ground
/// without the catheter: edges that are in both pictures cancel too.
pub fn contrast(
    frame: &Picture,
    background: Option<&Picture>,
    polarity: Polarity,
    width_px: f64,
) -> Contrast {
    let mut sharp = frame.clone();
    let mut smooth = blur(frame, blur_px(width_px));
    if let Some(background) = background {
        let all = sharp.grey.iter_mut().zip(&mut smooth.grey).zip(&background.grey);
        all.for_each(|((sharp, smooth), ground)| {
            // A mean of 128 keeps the meaning of DARK_GREY.
            *sharp = 128.0 * (*sharp + DARK_GREY) / (ground + DARK_GREY);
            *smooth = 128.0 * (*smooth + DARK_GREY) / (ground + DARK_GREY);
        });
    }
    let reach = (0.5 * GROUND_WIDTHS * width_px).ceil().max(2.0) as usize;
    let ground = match polarity {
        Polarity::Dark => closing(&smooth, reach),
        Polarity::Light => opening(&smooth, reach),
    };
    let of = |thing: f32, ground: f32| {
        let (thing, ground) = (thing + DARK_GREY, ground + DARK_GREY);
        match polarity {
            Polarity::Dark => 1.0 - thing / ground,
            Polarity::Light => 1.0 - ground / thing,
        }
    };
    for picture in [&mut sharp, &mut smooth] {
        picture.grey.iter_mut().zip(&ground.grey).for_each(|(x, ground)| *x = of(*x, *ground));
    }
    let ground = noise(&smooth);
    Contrast { smooth, sharp, ground }
}

/// Median of the contrast, and the spread of its lower half, in which there is no catheter.
fn noise(smooth: &Picture) -> [f64; 2] {
    // Each eleventh pixel is enough for a median, and no row or column is preferred.
    let mut values: Vec<f32> = smooth.grey.iter().copied().step_by(11).collect();
    let median = quantile(&mut values, 0.5);
    // 15.9 % of normal noise lie more than one standard deviation below the median.
    let low = quantile(&mut values, 0.159);
    [f64::from(median), f64::from(median - low)]
}
