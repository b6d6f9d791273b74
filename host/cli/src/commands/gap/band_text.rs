//! The band of the forces in words.

use cathforce_gap::Coverage;
use cathforce_gap::rounding::percent;

/// Channels of a band, in its order.
pub const CHANNELS: [&str; 4] = ["fx", "fy", "fz", "drive"];

/// Of the samples of a force, those for which a band is stated.
pub fn stated(coverage: &Coverage) -> String {
    let share = coverage.all().stated_share().unwrap_or_default();
    format!("{} of the samples have a band", percent(share))
}

/// Shares and half widths in a line.
pub fn text(coverage: &Coverage) -> String {
    let own = CHANNELS.iter().zip(&coverage.channels).filter_map(|(name, own)| {
        let (share, width) = own.share().zip(own.half_width_n())?;
        Some(format!("{name} {:.0} % (±{:.1} mN)", 100.0 * share, 1e3 * width))
    });
    own.collect::<Vec<_>>().join(", ")
}
