//! Arguments of `cathforce filter`.

use std::path::PathBuf;

use cathforce_filter::{Family, Pipeline};
use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
pub struct FilterArguments {
    /// Table (CSV), trial bundle or recording.
    #[arg(value_name = "FILE_OR_BUNDLE")]
    pub source: PathBuf,
    /// Filter this column [default: what the sensors of a trial measured: forces, tip, shape]. May be
    /// repeated.
    #[arg(long = "column", value_name = "NAME")]
    pub columns: Vec<String>,
    /// Column that holds the time in seconds.
    #[arg(long, value_name = "NAME", default_value = "t_s")]
    pub time: String,
    /// Look back only, as a device has to. The delay of the result is stated.
    #[arg(long)]
    pub causal: bool,
    /// Rows of the window in which a value is compared with the others; 0 replaces no outliers.
    #[arg(long, value_name = "ROWS", default_value_t = Pipeline::default().outlier_rows, value_parser = rows)]
    pub outlier_rows: usize,
    /// Standard deviations from the median of the window from which on a value is an outlier.
    #[arg(long, value_name = "N", default_value_t = Pipeline::default().outlier_sd, value_parser = standard_deviations)]
    pub outlier_sd: f64,
    /// Wavelet whose small details are taken for noise. With --causal it is Haar's.
    #[arg(long, value_enum, default_value_t = Wavelet::Sym4)]
    pub wavelet: Wavelet,
    /// Levels of the wavelet, each of half the frequency [default: down to 20 Hz, at most 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=12))]
    pub levels: Option<u8>,
    /// Length of the moving average; 0 for none.
    #[arg(long, value_name = "SECONDS", default_value_t = Pipeline::default().average_s, value_parser = seconds)]
    pub average: f64,
    /// Filter the rows before and after a gap apart, in place of refusing it.
    #[arg(long)]
    pub split_at_gaps: bool,
    /// Write nothing; say what would be done.
    #[arg(long)]
    pub dry_run: bool,
    /// New file, or new folder of a bundle or recording [default: the name with `-filtered`, beside it].
    /// What was done is written beside a file as NAME.filter.json, and into a folder as filter.json.
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Wavelet {
    /// No wavelet.
    None,
    /// Steps.
    Haar,
    /// Daubechies, four vanishing moments.
    Db4,
    /// Daubechies' least asymmetric one, four vanishing moments.
    Sym4,
}

impl FilterArguments {
    /// What is done to every column.
    pub fn pipeline(&self) -> Pipeline {
        Pipeline {
            outlier_rows: self.outlier_rows,
            outlier_sd: self.outlier_sd,
            wavelet: match self.wavelet {
                Wavelet::None => None,
                Wavelet::Haar => Some(Family::Haar),
                Wavelet::Db4 => Some(Family::Db4),
                Wavelet::Sym4 => Some(Family::Sym4),
            },
            levels: self.levels.map(usize::from),
            average_s: self.average,
            causal: self.causal,
            split_at_gaps: self.split_at_gaps,
        }
    }
}

fn rows(text: &str) -> Result<usize, String> {
    const MOST: usize = 10_001;
    let rows = text.parse().ok().filter(|rows| *rows == 0 || (3..=MOST).contains(rows));
    rows.ok_or_else(|| format!("give a number of rows from 3 to {MOST}, or 0"))
}

fn standard_deviations(text: &str) -> Result<f64, String> {
    super::positive(text, "a number of standard deviations above 0")
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s| (0.0..=60.0).contains(s));
    seconds.ok_or_else(|| "give a number of seconds from 0 to 60".to_owned())
}
