//! Six instruments. Every case has its own lengths, stiffnesses, diameters and bends.

use rand::Rng;

use crate::rigs::Instrument;

/// An instrument's kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Device {
    /// A braided 4 F catheter whose soft end is bent once, sharply.
    HockeyStick,
    /// A 0.018 inch wire of nickel and titanium that is ground thinner at its end.
    NitinolWire,
    /// A 2.8 F microcatheter with a soft, bent end.
    Microcatheter,
    /// A wide 6 F catheter with a soft end and two bends.
    GuidingCatheter,
    /// A coiled 0.028 inch wire whose floppy end is a J.
    JWire,
    /// A 3.5 F tube of one polymer, stiffer at its end, as good as straight.
    BalloonShaft,
}

/// Lengths, curvatures and Young's moduli vary by this share from case to case …
const VARIES: f64 = 0.15;
/// … and diameters, whose fourth power stiffness goes with, by this one.
const DIAMETERS_VARY: f64 = 0.04;

impl Device {
    /// As the rig of a label ends.
    pub fn name(self) -> &'static str {
        match self {
            Self::HockeyStick => "hockey-stick",
            Self::NitinolWire => "nitinol-wire",
            Self::Microcatheter => "microcatheter",
            Self::GuidingCatheter => "guiding-catheter",
            Self::JWire => "j-wire",
            Self::BalloonShaft => "balloon-shaft",
        }
    }

    /// What the kind is like on the whole. Wall stiffnesses are of phantoms of silicone to rigid resin: the
    /// stiffer the instrument, the stiffer the wall that it is tried in.
    fn typical(self) -> Instrument {
        let own = |outer_mm: f64, inner_mm: f64, density, poissons_ratio| Instrument {
            name: self.name(),
            outer_diameter_m: 1e-3 * outer_mm,
            inner_diameter_m: 1e-3 * inner_mm,
            density_kg_per_m3: density,
            poissons_ratio,
            sections: [(0.0, 0.0); 2],
            precurve: Vec::new(),
            wall_stiffness_n_per_m: 0.0,
        };
        match self {
            Self::HockeyStick => Instrument {
                sections: [(0.60, 260e6), (0.030, 150e6)],
                precurve: vec![(3e-3, 0.0), (9e-3, 75.0)],
                wall_stiffness_n_per_m: 600.0,
                ..own(1.35, 0.95, 1250.0, 0.42)
            },
            Self::NitinolWire => Instrument {
                sections: [(0.65, 38e9), (0.060, 14e9)],
                precurve: vec![(14e-3, 32.0)],
                wall_stiffness_n_per_m: 150.0,
                ..own(0.46, 0.0, 6450.0, 0.33)
            },
            Self::Microcatheter => Instrument {
                sections: [(0.60, 620e6), (0.040, 330e6)],
                precurve: vec![(2e-3, 0.0), (11e-3, 55.0)],
                wall_stiffness_n_per_m: 250.0,
                ..own(0.93, 0.55, 1150.0, 0.40)
            },
            Self::GuidingCatheter => Instrument {
                sections: [(0.58, 170e6), (0.035, 90e6)],
                precurve: vec![(6e-3, 0.0), (12e-3, 38.0), (18e-3, 14.0)],
                wall_stiffness_n_per_m: 900.0,
                ..own(2.0, 1.72, 1300.0, 0.42)
            },
            Self::JWire => Instrument {
                sections: [(0.62, 4.6e9), (0.045, 1.5e9)],
                precurve: vec![(13e-3, 95.0)],
                wall_stiffness_n_per_m: 180.0,
                ..own(0.71, 0.30, 5200.0, 0.30)
            },
            Self::BalloonShaft => Instrument {
                sections: [(0.60, 300e6), (0.020, 480e6)],
                precurve: vec![(22e-3, 12.0)],
                wall_stiffness_n_per_m: 400.0,
                ..own(1.15, 0.42, 1050.0, 0.45)
            },
        }
    }

    /// One of its kind.
    pub fn draw(self, rng: &mut impl Rng) -> Instrument {
        let mut own = self.typical();
        let mut vary = |value: &mut f64, by: f64| *value *= rng.random_range(1.0 - by..1.0 + by);
        vary(&mut own.outer_diameter_m, DIAMETERS_VARY);
        vary(&mut own.inner_diameter_m, DIAMETERS_VARY);
        vary(&mut own.wall_stiffness_n_per_m, 2.0 * VARIES);
        for (length_m, youngs_pa) in &mut own.sections {
            vary(length_m, VARIES);
            vary(youngs_pa, VARIES);
        }
        for (length_m, per_m) in &mut own.precurve {
            vary(length_m, VARIES);
            vary(per_m, VARIES);
        }
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn instruments_are_as_stiff_as_catheters_and_wires_are() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for device in [
            Device::HockeyStick,
            Device::NitinolWire,
            Device::Microcatheter,
            Device::GuidingCatheter,
            Device::JWire,
            Device::BalloonShaft,
        ] {
            let own = device.draw(&mut rng);
            let area = |diameter_m: f64| std::f64::consts::PI / 64.0 * diameter_m.powi(4);
            let area_m4 = area(own.outer_diameter_m) - area(own.inner_diameter_m);
            for (length_m, youngs_pa) in own.sections {
                let bending_n_m2 = youngs_pa * area_m4;
                assert!((5e-6..2e-4).contains(&bending_n_m2), "{device:?}: {bending_n_m2:e}");
                assert!(length_m > 0.01);
            }
            let bent_m = own.precurve.iter().map(|(length_m, _)| length_m).sum::<f64>();
            assert!(bent_m < 0.05 && own.inner_diameter_m < own.outer_diameter_m);
            assert_ne!(own, device.draw(&mut rng), "no two are alike");
        }
    }
}
