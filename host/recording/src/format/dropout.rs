//! Frames that a recording lacks, and why.

use std::fmt;

use cathforce_bus::{Counter, Rejection};
use serde::Serialize;

/// Why frames are missing or could not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DropoutCause {
    /// The counter of an id jumped.
    Lost,
    Repeat,
    Reordered,
    Masquerade,
    Corrupt,
    WrongLength,
    BadValue,
    /// Frames came faster than this host could write them.
    HostOverload,
    /// The part of the recording's file that held them is damaged.
    DamagedFile,
}

impl DropoutCause {
    const ALL: [Self; 9] = [
        Self::Lost,
        Self::Repeat,
        Self::Reordered,
        Self::Masquerade,
        Self::Corrupt,
        Self::WrongLength,
        Self::BadValue,
        Self::HostOverload,
        Self::DamagedFile,
    ];

    /// Its name in a recording; causes that a counter counts have the counter's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lost => Counter::Lost.name(),
            Self::Repeat => Counter::Repeat.name(),
            Self::Reordered => Counter::Reordered.name(),
            Self::Masquerade => Counter::Masquerade.name(),
            Self::Corrupt => Counter::Corrupt.name(),
            Self::WrongLength => Counter::WrongLength.name(),
            Self::BadValue => Counter::BadValue.name(),
            Self::HostOverload => "host_overload",
            Self::DamagedFile => "damaged_file",
        }
    }

    pub(crate) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Its meaning, and what to do about it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Lost => {
                "sent and never seen here: the bus was overfull or this host did not read in time; \
                 look at `ip -details -statistics link`"
            }
            Self::Repeat => {
                "the same frame twice: two senders of one identifier, or an adapter \
                             that repeats"
            }
            Self::Reordered => "older than the frame before: an adapter that reorders",
            Self::Masquerade => "made for another identifier: something between rewrites frames",
            Self::Corrupt => {
                "the check does not fit: disturbed wiring, or another sender uses the \
                              identifier"
            }
            Self::WrongLength => "not 8 bytes: another sender uses the identifier",
            Self::BadValue => {
                "intact, but its values mean nothing: device and host differ in \
                               version"
            }
            Self::HostOverload => {
                "the disk or this computer was too slow: record to a local disk, with nothing else \
                 running"
            }
            Self::DamagedFile => {
                "a part of the recording's file is damaged and left out: copy the file again from \
                 where it was recorded"
            }
        }
    }
}

impl fmt::Display for DropoutCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl From<Rejection> for DropoutCause {
    fn from(rejection: Rejection) -> Self {
        match rejection {
            Rejection::WrongLength => Self::WrongLength,
            Rejection::Corrupt => Self::Corrupt,
            Rejection::Masquerade(_) => Self::Masquerade,
            Rejection::Repeat => Self::Repeat,
            Rejection::Reordered => Self::Reordered,
            Rejection::BadValue => Self::BadValue,
        }
    }
}

/// Frames that are missing or could not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Dropout {
    /// When the first was missed, time of the bus \[ns\].
    pub from_ns: u64,
    /// When the last was missed \[ns\].
    pub to_ns: u64,
    pub cause: DropoutCause,
    /// Identifier of the frames, marked as [`Frame::id`](cathforce_bus::Frame::id) is; `None` if there were several.
    pub id: Option<u32>,
    pub frames: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_found_by_its_name() {
        for cause in DropoutCause::ALL {
            assert_eq!(DropoutCause::from_name(cause.name()), Some(cause));
        }
        assert_eq!(DropoutCause::from_name("sloth"), None);
    }
}
