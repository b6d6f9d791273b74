//! What a page draws beside the rows.

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// The truth or what its sensor measured.
    Truth,
    /// The device's model.
    Ours,
    /// A second solution of the model.
    Other,
}

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    pub name: String,
    pub style: Style,
    /// Points (x, y), in the units of the plot's axes.
    pub points: Vec<[f64; 2]>,
}

/// Curves over the same axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    pub title: String,
    /// Names of the axes with their units.
    pub axes: [&'static str; 2],
    /// Whether both axes have the same scale, as in a drawing.
    pub equal: bool,
    pub curves: Vec<Curve>,
}
