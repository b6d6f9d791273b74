//! One printed figure and what it comes to here.

use serde::Serialize;

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the published system.
    pub system: &'static str,
    /// What the figure is of.
    pub figure: String,
    /// As printed; `None` where the publication shows it without a number, or not at all.
    pub published: Option<f64>,
    /// As computed here; `None` where it cannot be had, for the reason in `why_not`.
    pub ours: Option<f64>,
    /// Unit of both.
    pub unit: &'static str,
    /// How `ours` was obtained.
    pub how: String,
    /// Why there is no `ours`.
    pub why_not: Option<String>,
}

impl Row {
    /// A figure that was computed. One that is not finite becomes a row without `ours`, so that no
    /// table ever shows it.
    pub(crate) fn of(figure: impl Into<String>, unit: &'static str, ours: f64) -> Self {
        let finite = ours.is_finite();
        Self {
            system: "",
            figure: figure.into(),
            published: None,
            ours: finite.then_some(ours),
            unit,
            how: String::new(),
            why_not: (!finite).then(|| "the computation gave no finite number".to_owned()),
        }
    }

    /// A figure that cannot be had, and why.
    pub(crate) fn without(
        figure: impl Into<String>,
        unit: &'static str,
        why_not: impl Into<String>,
    ) -> Self {
        Self {
            system: "",
            figure: figure.into(),
            published: None,
            ours: None,
            unit,
            how: String::new(),
            why_not: Some(why_not.into()),
        }
    }

    /// With the printed number.
    pub(crate) fn published(mut self, published: f64) -> Self {
        self.published = Some(published);
        self
    }

    /// With how it was obtained.
    pub(crate) fn how(mut self, how: impl Into<String>) -> Self {
        self.how = how.into();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_that_is_not_finite_is_not_shown() {
        let row = Row::of("error", "N", f64::NAN).published(0.1);
        assert_eq!((row.ours, row.published), (None, Some(0.1)));
        assert!(row.why_not.is_some());
        assert_eq!(Row::of("error", "N", 0.2).why_not, None);
    }
}
