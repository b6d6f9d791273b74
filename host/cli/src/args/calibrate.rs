//! Arguments of `cathforce calibrate`.

use std::path::PathBuf;

use cathforce_calibration::Method;
use clap::{Args, ValueEnum};

use super::JsonFile;

#[derive(Debug, Args)]
pub struct CalibrateArguments {
    /// Trial bundles and recordings; all their trials are fitted together.
    #[arg(required = true, value_name = "BUNDLE|FILE.mcap")]
    pub sources: Vec<PathBuf>,
    /// Settings of the model to fit, or effects whose parameters are, each with bounds of your own if
    /// need be: `wall.friction_coefficient=0.1..0.6,instrument.stiffness`. `cathforce config list` lists
    /// settings, `cathforce gap effects` effects.
    #[arg(
        long,
        required = true,
        value_name = "NAME[=LOW..HIGH]",
        value_delimiter = ',',
        value_parser = Asked::parse
    )]
    pub parameters: Vec<Asked>,
    /// How to search.
    #[arg(long, value_enum, default_value_t = Search::Auto)]
    pub method: Search,
    /// Evaluations of the search at most, each of which simulates every trial once [default: 60 for
    /// each parameter and two more]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub budget: Option<u32>,
    /// Seed of the search; the same seed gives the same answer.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Do not fit this trial, and report the error on it. May be repeated. Without it, every trial is
    /// held out in turn.
    #[arg(long, value_name = "TRIAL")]
    pub hold_back: Vec<u32>,
    /// Go on with a calibration that was interrupted.
    #[arg(long)]
    pub resume: bool,
    /// File that keeps what is known until the calibration has come to its end [default:
    /// NAME.calibration-state.json in this folder, after the first bundle]
    #[arg(long, value_name = "FILE.json")]
    pub state: Option<PathBuf>,
    /// Settings file to write the result into, for `cathforce config apply` and --settings. What else it
    /// holds stays.
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

/// A parameter or an effect as it was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    pub name: String,
    pub bounds: Option<(f64, f64)>,
}

impl Asked {
    fn parse(text: &str) -> Result<Self, String> {
        let Some((name, bounds)) = text.split_once('=') else {
            return Ok(Self { name: text.trim().to_owned(), bounds: None });
        };
        let wrong = || format!("`{text}`: write NAME or NAME=LOW..HIGH, such as {name}=0.5..2");
        let (low, high) = bounds.split_once("..").ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let (low, high) = number(low).zip(number(high)).ok_or_else(wrong)?;
        if low >= high {
            return Err(format!(
                "the bounds of {} are reversed: {low} is not below {high}; write {}={high}..{low} if you \
                 meant that",
                name.trim(),
                name.trim()
            ));
        }
        Ok(Self { name: name.trim().to_owned(), bounds: Some((low, high)) })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Search {
    /// The method that fits the number of parameters and the budget; it is said which and why.
    Auto,
    /// Agents whose distribution narrows around the best of them.
    CrossEntropy,
    /// An evolution strategy that learns how parameters go together.
    CmaEs,
    /// Local searches from the best of many samples.
    MultiStart,
}

impl Search {
    pub fn method(self) -> Option<Method> {
        match self {
            Self::Auto => None,
            Self::CrossEntropy => Some(Method::CrossEntropy),
            Self::CmaEs => Some(Method::CmaEs),
            Self::MultiStart => Some(Method::MultiStart),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_may_follow_a_name_and_are_not_reversed() {
        let bare = Asked::parse("contact.friction").unwrap();
        assert_eq!((bare.name.as_str(), bare.bounds), ("contact.friction", None));
        let own = Asked::parse("tendon.angle_rad=-1.5..2e-1").unwrap();
        assert_eq!((own.name.as_str(), own.bounds), ("tendon.angle_rad", Some((-1.5, 0.2))));
        for (text, why) in [
            ("a=2..1", "reversed: 2 is not below 1; write a=1..2"),
            ("a=1..1", "reversed"),
            ("a=1", "write NAME or NAME=LOW..HIGH"),
            ("a=x..1", "write NAME or NAME=LOW..HIGH"),
            ("a=nan..1", "write NAME or NAME=LOW..HIGH"),
        ] {
            let said = Asked::parse(text).unwrap_err();
            assert!(said.contains(why), "{text}: {said}");
        }
    }
}
