//! Tips of common catheters, for rigs whose own pre-curvature has not been measured.
//!
//! Each is a row of straight pieces and arcs in one plane, from the tip backwards. Apart from
//! the hook, whose half circle of 16 mm was published with its experiments, the lengths and
//! angles approximate how makers draw these shapes in their catalogues; every maker's differ
//! by some millimetres and degrees. Trace your own tip where it matters.

use cathforce_mechanics::{PrecurvePiece, Real};

/// The unloaded shape of a tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// Name for `--tip`.
    pub name: &'static str,
    /// What it looks like.
    pub doc: &'static str,
    /// Pieces from the tip backwards.
    pub pieces: &'static [TipArc],
}

/// A straight piece or an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipArc {
    /// Along the centre line \[m\].
    pub length_m: f64,
    /// Angle that it turns, towards `up` at rotation 0 when positive \[°\].
    pub turn_deg: f64,
}

impl Tip {
    /// The tip of that name.
    pub fn find(name: &str) -> Option<&'static Self> {
        TIPS.iter().find(|tip| tip.name == name)
    }

    /// Length of the shaped part \[m\].
    pub fn length_m(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.length_m).sum()
    }

    /// Angle between the shaft and where the tip points \[°\].
    pub fn turn_deg(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.turn_deg).sum()
    }

    /// Pieces in the form of a description.
    pub fn precurve<T: Real>(&self) -> impl Iterator<Item = PrecurvePiece<T>> {
        self.pieces.iter().map(|piece| PrecurvePiece {
            length_m: T::lit(piece.length_m),
            curvature_per_m: T::lit(piece.turn_deg.to_radians() / piece.length_m),
            lateral_curvature_per_m: T::zero(),
            torsion_per_m: T::zero(),
        })
    }
}

const fn straight(length_m: f64) -> TipArc {
    TipArc { length_m, turn_deg: 0.0 }
}

const fn arc(radius_m: f64, turn_deg: f64) -> TipArc {
    let angle_deg = if turn_deg < 0.0 { -turn_deg } else { turn_deg };
    TipArc { length_m: radius_m * angle_deg * (std::f64::consts::PI / 180.0), turn_deg }
}

/// Every tip, the simplest first.
pub const TIPS: &[Tip] = &[
    Tip { name: "straight", doc: "No curve.", pieces: &[] },
    Tip {
        name: "vertebral",
        doc: "One short bend of 40° close to the tip.",
        pieces: &[straight(8e-3), arc(10e-3, 40.0)],
    },
    Tip {
        name: "multipurpose",
        doc: "One open bend of 65° behind a straight end.",
        pieces: &[straight(12e-3), arc(20e-3, 65.0)],
    },
    Tip {
        name: "j",
        doc: "Guidewire's J: half a circle of 3 mm radius.",
        pieces: &[arc(3e-3, 180.0)],
    },
    Tip { name: "hook", doc: "Half a circle of 16 mm diameter.", pieces: &[arc(8e-3, 180.0)] },
    Tip {
        name: "rim",
        doc: "Hook that looks back along the shaft, its end bent a little outwards.",
        pieces: &[straight(4e-3), arc(6e-3, -25.0), straight(4e-3), arc(9e-3, 165.0)],
    },
    Tip {
        name: "cobra-1",
        doc: "Narrow bend at the tip, wide one of small radius behind it.",
        pieces: &[straight(5e-3), arc(7e-3, 80.0), straight(5e-3), arc(20e-3, 60.0)],
    },
    Tip {
        name: "cobra-2",
        doc: "Narrow bend at the tip, wide one of medium radius behind it.",
        pieces: &[straight(5e-3), arc(7e-3, 80.0), straight(8e-3), arc(30e-3, 60.0)],
    },
    Tip {
        name: "simmons-1",
        doc: "Turned back by 180°, with a limb of 20 mm whose end bends outwards.",
        pieces: &[straight(6e-3), arc(7e-3, -50.0), straight(20e-3), arc(9e-3, 180.0)],
    },
    Tip {
        name: "simmons-2",
        doc: "Turned back by 180°, with a limb of 40 mm whose end bends outwards.",
        pieces: &[straight(8e-3), arc(8e-3, -50.0), straight(40e-3), arc(12e-3, 180.0)],
    },
    Tip {
        name: "simmons-3",
        doc: "Turned back by 180°, with a limb of 65 mm whose end bends outwards.",
        pieces: &[straight(8e-3), arc(8e-3, -50.0), straight(65e-3), arc(15e-3, 180.0)],
    },
    Tip { name: "pigtail", doc: "A full circle of 11 mm diameter.", pieces: &[arc(5.5e-3, 360.0)] },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tip_is_a_description_that_the_model_accepts() {
        for tip in TIPS {
            assert_eq!(Tip::find(tip.name), Some(tip));
            assert!(tip.pieces.len() <= cathforce_mechanics::MAX_PRECURVE, "{}", tip.name);
            let turned: f64 = tip.precurve::<f64>().map(|p| p.curvature_per_m * p.length_m).sum();
            assert!((turned.to_degrees() - tip.turn_deg()).abs() < 1e-9, "{}", tip.name);
            for piece in tip.precurve::<f64>() {
                assert!(piece.length_m > 0.0 && piece.curvature_per_m.abs() <= 1000.0);
            }
        }
    }

    #[test]
    fn the_published_hook_is_half_a_circle() {
        let hook = Tip::find("hook").expect("in the list");
        let [piece] = hook.precurve::<f64>().collect::<Vec<_>>()[..] else { panic!("one arc") };
        assert!((piece.length_m - 8e-3 * std::f64::consts::PI).abs() < 1e-12);
        assert!((piece.curvature_per_m - 125.0).abs() < 1e-9);
    }
}
