//! The band of the forces in words.

use cathforce_gap::Coverage;
use cathforce_gap::rounding::{percent, significant};

/// Channels of a band, in its order.
pub const CHANNELS: [&str; 4] = ["fx", "fy", "fz", "drive"];

/// Of the samples of a force, those for which a band is stated.
pub fn stated(coverage: &Coverage) -> String {
    let share = coverage.all().stated_share().unwrap_or_default();
    format!("{} of the samples have a band", percent(share))
}

/// A half width of two digits: that of a force that hardly changes is micronewtons.
pub fn half_width(n: f64) -> String {
    format!("{} mN", significant(1e3 * n, 2))
}

/// Shares and half widths in a line.
pub fn text(coverage: &Coverage) -> String {
    let own = CHANNELS.iter().zip(&coverage.channels).filter_map(|(name, own)| {
        let (share, width) = own.share().zip(own.half_width_n())?;
        Some(format!("{name} {:.0} % (±{})", 100.0 * share, half_width(width)))
    });
    own.collect::<Vec<_>>().join(", ")
}
