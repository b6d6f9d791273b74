//! Named counts of what was received.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Defines [`Counter`] and its names in one place.
macro_rules! counters {
    ($($(#[$doc:meta])* $variant:ident = $name:literal,)*) => {
        /// An outcome of something that was received.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Counter {
            $($(#[$doc])* $variant,)*
        }

        impl Counter {
            /// All counters, in the order in which a device reports them.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// Name in reports and recordings.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

counters! {
    // Process frames: each received frame adds to exactly one of these.
    /// Intact, and the next one of its id.
    Accepted = "accepted",
    /// Intact and newer, but frames before it are missing; these add to [`Counter::Lost`].
    AfterLoss = "after_loss",
    /// The same counter as the frame before.
    Repeat = "repeat",
    /// Older than the frame before.
    Reordered = "reordered",
    /// Its CRC was made for another id of ours.
    Masquerade = "masquerade",
    /// Its CRC fits no id of ours.
    Corrupt = "corrupt",
    /// Not 8 bytes.
    WrongLength = "wrong_length",
    /// Intact, but with an invalid payload.
    BadValue = "bad_value",
    /// Not an id of ours, or not from this side; also extended and remote frames.
    Foreign = "foreign",

    // Consequences, counted in addition to the above.
    /// Frames that were sent but never arrived, by the gaps in their counters.
    Lost = "lost",
    /// Valid, but replaced by a later one of the same kind before the tick.
    Superseded = "superseded",
    /// Dropped because a queue was full.
    QueueFull = "queue_full",
    /// Not sent, because the bus controller was off.
    BusOff = "bus_off",

    // Text of the SLCAN carrier.
    /// A line that is not a command of the SLCAN protocol.
    LineUnknown = "line_unknown",
    /// A malformed command.
    LineBroken = "line_broken",
    /// Longer than any line can be.
    LineTooLong = "line_too_long",

    // Segmented transfers of service messages.
    /// An accepted segment.
    Segment = "segment",
    /// A segment out of order, or without a first one; the message is dropped.
    SegmentSequence = "segment_sequence",
    /// A malformed segment.
    SegmentBroken = "segment_broken",
    /// A message longer than the buffer.
    MessageTooLong = "message_too_long",
    /// A complete message with a wrong CRC or invalid contents.
    MessageBroken = "message_broken",
    /// A repeated request, whose response was sent again.
    MessageRepeat = "message_repeat",
}

impl Counter {
    /// Number of counters.
    pub const COUNT: usize = Self::ALL.len();

    /// Outcomes of a process frame. Each frame has exactly one of them.
    pub const FRAME_KINDS: [Self; 9] = [
        Self::Accepted,
        Self::AfterLoss,
        Self::Repeat,
        Self::Reordered,
        Self::Masquerade,
        Self::Corrupt,
        Self::WrongLength,
        Self::BadValue,
        Self::Foreign,
    ];
}

/// One saturating count for each [`Counter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub struct Counters([u32; Counter::COUNT]);

impl Counters {
    /// Adds one.
    pub fn count(&mut self, counter: Counter) {
        self.add(counter, 1);
    }

    /// Adds `n`.
    pub fn add(&mut self, counter: Counter, n: u32) {
        if let Some(count) = self.0.get_mut(counter as usize) {
            *count = count.saturating_add(n);
        }
    }

    /// The count.
    pub fn get(&self, counter: Counter) -> u32 {
        self.0.get(counter as usize).copied().unwrap_or(0)
    }

    /// All counters with their counts.
    pub fn iter(&self) -> impl Iterator<Item = (Counter, u32)> + '_ {
        Counter::ALL.into_iter().zip(self.0)
    }

    /// Saturating sums of both; the two halves of a device count separately.
    pub fn merged(mut self, other: &Self) -> Self {
        for (counter, n) in other.iter() {
            self.add(counter, n);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_differ_and_counts_saturate() {
        let names: HashSet<_> = Counter::ALL.iter().map(|c| c.name()).collect();
        assert_eq!(names.len(), Counter::COUNT);
        let mut counters = Counters::default();
        counters.add(Counter::Lost, u32::MAX);
        counters.count(Counter::Lost);
        assert_eq!(counters.get(Counter::Lost), u32::MAX);
        assert_eq!(counters.merged(&counters).get(Counter::Lost), u32::MAX);
        assert_eq!(counters.iter().filter(|&(_, n)| n > 0).count(), 1);
    }
}
