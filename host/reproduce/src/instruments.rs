//! The catheters of the publications, with all their dimensions.

use cathforce_bundle::tips::Tip;
use cathforce_reference_solver::{Curve, Rod, Section};

/// A catheter of a publication.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instrument {
    /// Its maker's number.
    pub number: &'static str,
    pub doc: &'static str,
    /// Name of its tip in `cathforce tips`.
    pub tip: &'static str,
    /// Length of the straight shaft \[m\].
    pub shaft_m: f64,
    /// Size in French.
    pub french: f64,
    /// Outer diameter \[m\].
    pub outer_m: f64,
    /// Inner diameter \[m\]; `None` where it is not printed.
    pub inner_m: Option<f64>,
    /// Where the dimensions are printed.
    pub source: &'static str,
}

/// Every catheter of the publications.
pub const INSTRUMENTS: &[Instrument] = &[
    Instrument {
        number: "48038MHK-H",
        doc: "Merit Impress, modified hook",
        tip: "hook",
        shaft_m: 0.8,
        french: 4.0,
        outer_m: 1.32e-3,
        inner_m: None,
        source: "Li 2023, tables 2.1 and 3.1; Pescio et al. 2025",
    },
    Instrument {
        number: "56535RIM",
        doc: "Merit Impress, rim",
        tip: "rim",
        shaft_m: 0.65,
        french: 5.0,
        outer_m: 1.65e-3,
        inner_m: Some(1.02e-3),
        source: "CathBot thesis, tables 2, 4 and 6",
    },
    Instrument {
        number: "565382CB1",
        doc: "Merit Impress, Cobra 1; its bore is taken to be that of the Cobra 2",
        tip: "cobra-1",
        shaft_m: 0.65,
        french: 5.0,
        outer_m: 1.65e-3,
        inner_m: Some(1.17e-3),
        source: "CathBot thesis, section 7.1",
    },
    Instrument {
        number: "565382CB2",
        doc: "Merit Impress, Cobra 2",
        tip: "cobra-2",
        shaft_m: 0.65,
        french: 5.0,
        outer_m: 1.65e-3,
        inner_m: Some(1.17e-3),
        source: "CathBot thesis, table 2",
    },
];

/// Poisson's ratio of the polymers that these shafts are made of \[1\]; none is printed.
const POISSON: f64 = 0.4;

impl Instrument {
    /// The catheter of that number.
    pub fn find(number: &str) -> Option<&'static Self> {
        INSTRUMENTS.iter().find(|own| own.number == number)
    }

    /// Its tip's shape.
    pub fn tip(&self) -> Option<&'static Tip> {
        Tip::find(self.tip)
    }

    /// Length of the curved tip \[m\].
    pub fn tip_length_m(&self) -> f64 {
        self.tip().map_or(0.0, Tip::length_m)
    }

    /// The rod of this catheter. `tip_pa`, `shaft_pa`: Young's moduli of the curved tip and of the
    /// shaft \[Pa\]; `density_kg_per_m3`: of the wall. Without a printed bore the rod is solid, as the
    /// beams of the publications are.
    pub fn rod(&self, tip_pa: f64, shaft_pa: f64, density_kg_per_m3: f64) -> Rod {
        let inner_m = self.inner_m.unwrap_or(0.0);
        let section = |length_m, youngs_pa| {
            Section::tube(length_m, self.outer_m, inner_m, youngs_pa, POISSON, density_kg_per_m3)
        };
        let curves = self.tip().into_iter().flat_map(|tip| tip.precurve::<f64>());
        Rod {
            radius_m: 0.5 * self.outer_m,
            sections: vec![section(self.tip_length_m(), tip_pa), section(self.shaft_m, shaft_pa)],
            curves: curves
                .map(|c| Curve {
                    length_m: c.length_m,
                    up_per_m: c.curvature_per_m,
                    side_per_m: c.lateral_curvature_per_m,
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_catheter_has_its_tip_and_a_french_is_a_third_of_a_millimetre() {
        for own in INSTRUMENTS {
            assert!(own.tip().is_some_and(|tip| !tip.pieces.is_empty()), "{}", own.number);
            assert!((1e3 * own.outer_m - own.french / 3.0).abs() < 0.02, "{}", own.number);
            assert!(own.inner_m.is_none_or(|inner| inner < own.outer_m), "{}", own.number);
            assert_eq!(Instrument::find(own.number), Some(own));
        }
    }

    /// 825 mm in all, and the 8.9e-5 N·m² that 600 MPa give.
    #[test]
    fn the_hooked_catheter_is_as_long_and_as_stiff_as_printed() {
        let own = Instrument::find("48038MHK-H").unwrap();
        assert!((own.shaft_m + own.tip_length_m() - 0.825).abs() < 0.3e-3);
        let rod = own.rod(600e6, 600e6, 1550.0);
        assert!((rod.sections[0].bending_n_m2 - 8.94e-5).abs() < 0.01e-5);
        assert!((rod.sections[1].mass_kg_per_m - 2.121e-3).abs() < 0.002e-3);
    }
}
