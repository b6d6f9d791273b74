//! A tensile test in numbers.

/// The area that a stress is related to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StressMeasure {
    /// Of the unloaded specimen (engineering stress, first Piola–Kirchhoff).
    Nominal,
    /// Of the stretched specimen (Cauchy stress).
    True,
}

impl StressMeasure {
    pub fn name(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::True => "true",
        }
    }
}

/// One row of a tensile test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Length over unloaded length \[1\].
    pub stretch: f64,
    /// \[Pa\], in the curve's measure.
    pub stress_pa: f64,
}

/// A tensile test, in the order of growing stretch.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    pub measure: StressMeasure,
    pub points: Vec<Point>,
}

impl Curve {
    /// Smallest and largest stretch \[1\].
    pub fn range(&self) -> [f64; 2] {
        let of = |point: Option<&Point>| point.map_or(1.0, |point| point.stretch);
        [of(self.points.first()), of(self.points.last())]
    }
}
