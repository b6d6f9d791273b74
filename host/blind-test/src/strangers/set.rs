//! The split: what tunes a diagnosis never scores it.

use serde::{Deserialize, Serialize};

use super::instruments::Device;
use super::vessels::Vessel;

/// A set of strangers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Set {
    /// To be looked at while the diagnosis is developed.
    Tuning,
    /// To be answered once.
    Sealed,
}

impl Set {
    /// The vessels of this set.
    pub(crate) fn vessels(self) -> [Vessel; 4] {
        match self {
            Self::Tuning => {
                [Vessel::TaperedBend, Vessel::DoubleBend, Vessel::Wye, Vessel::ScannedArch]
            }
            Self::Sealed => [Vessel::Aneurysm, Vessel::Iliac, Vessel::Hook, Vessel::ScannedSiphon],
        }
    }

    /// The instruments of this set.
    pub(crate) fn instruments(self) -> [Device; 3] {
        match self {
            Self::Tuning => [Device::HockeyStick, Device::NitinolWire, Device::Microcatheter],
            Self::Sealed => [Device::GuidingCatheter, Device::JWire, Device::BalloonShaft],
        }
    }

    /// Every vessel with every instrument.
    pub(crate) fn families(self) -> Vec<(Vessel, Device)> {
        let of = |vessel| self.instruments().map(|instrument| (vessel, instrument));
        self.vessels().into_iter().flat_map(of).collect()
    }

    /// In words, as the plan of a blind test names it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Tuning => "strangers: tuning",
            Self::Sealed => "strangers: sealed",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_vessel_and_no_instrument_both_tunes_and_scores() {
        let (tuning, sealed) = (Set::Tuning, Set::Sealed);
        assert!(tuning.vessels().iter().all(|own| !sealed.vessels().contains(own)));
        assert!(tuning.instruments().iter().all(|own| !sealed.instruments().contains(own)));
        let all = [tuning.families(), sealed.families()].concat();
        let names: std::collections::BTreeSet<_> =
            all.iter().map(|(vessel, device)| (vessel.name(), device.name())).collect();
        assert_eq!(names.len(), 2 * 4 * 3);
        // Each set has a vessel that divides, and one whose geometry is a scan.
        for set in [tuning, sealed] {
            assert_eq!(set.vessels().iter().filter(|vessel| vessel.is_scanned()).count(), 1);
            assert_eq!(set.vessels().iter().filter(|vessel| vessel.divides()).count(), 1);
        }
    }
}
