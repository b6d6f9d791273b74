//! How many measured forces lie within the band that a device states for its own.

use serde::{Deserialize, Serialize};

/// Channels of a band: force on the vessel x, y, z, and force behind the guide.
pub const COLUMNS: usize = 4;

/// Half width of the interval that holds 90 % of a normal distribution, in standard deviations.
pub const NORMAL_NINETY: f64 = 1.645;

/// How many samples lie within their bands, by channel.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Coverage {
    pub channels: [Covered; COLUMNS],
}

/// Samples of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Covered {
    /// Samples for which a band is stated.
    pub stated: usize,
    /// Samples within the stated band, widened by the sensor's noise.
    pub within: usize,
    /// Samples for which no band is stated.
    pub unknown: usize,
    /// Sum of the squares of the stated half widths \[N²\].
    pub squares_n2: f64,
}

impl Covered {
    /// Counts a sample.
    ///
    /// `half_width_n`: of the band at that sample, `None` where none is stated; `error_n`: measured
    /// less estimated; `noise_n`: standard deviation of the sensor, all in newtons.
    pub fn count(&mut self, half_width_n: Option<f64>, error_n: f64, noise_n: f64) {
        let Some(width) = half_width_n else {
            self.unknown += 1;
            return;
        };
        self.stated += 1;
        self.within += usize::from(error_n.abs() <= width.hypot(NORMAL_NINETY * noise_n));
        self.squares_n2 += width * width;
    }

    /// Share of the samples with a band that lie within it \[1\]; `None` without any.
    pub fn share(&self) -> Option<f64> {
        (self.stated > 0).then(|| self.within as f64 / self.stated as f64)
    }

    /// Share of the samples that have a band \[1\]; `None` without any sample.
    pub fn stated_share(&self) -> Option<f64> {
        let samples = self.stated + self.unknown;
        (samples > 0).then(|| self.stated as f64 / samples as f64)
    }

    /// Root mean square of the stated half widths \[N\].
    pub fn half_width_n(&self) -> Option<f64> {
        (self.stated > 0).then(|| (self.squares_n2 / self.stated as f64).sqrt())
    }

    /// Adds the samples of another run.
    pub fn add(&mut self, other: &Self) {
        self.stated += other.stated;
        self.within += other.within;
        self.unknown += other.unknown;
        self.squares_n2 += other.squares_n2;
    }
}

impl Coverage {
    /// All channels as one.
    pub fn all(&self) -> Covered {
        let mut all = Covered::default();
        self.channels.iter().for_each(|own| all.add(own));
        all
    }

    /// Adds the samples of another run, channel by channel.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.channels.iter_mut().zip(&other.channels) {
            own.add(other);
        }
    }
}
