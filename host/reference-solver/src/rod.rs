//! The instrument: elastic properties and unloaded curvature over its arc.

/// A piece of the instrument with constant properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Length along the arc \[m\].
    pub length_m: f64,
    /// E I \[N·m²\].
    pub bending_n_m2: f64,
    /// G J \[N·m²\].
    pub torsion_n_m2: f64,
    /// E A \[N\].
    pub axial_n: f64,
    /// Mass per length \[kg/m\].
    pub mass_kg_per_m: f64,
}

impl Section {
    /// A round tube of one material; `outer_m` and `inner_m` are diameters.
    pub fn tube(
        length_m: f64,
        outer_m: f64,
        inner_m: f64,
        youngs_pa: f64,
        poisson: f64,
        density_kg_per_m3: f64,
    ) -> Self {
        use std::f64::consts::PI;
        let second_moment_m4 = PI / 64.0 * (outer_m.powi(4) - inner_m.powi(4));
        let area_m2 = PI / 4.0 * (outer_m * outer_m - inner_m * inner_m);
        Self {
            length_m,
            bending_n_m2: youngs_pa * second_moment_m4,
            torsion_n_m2: youngs_pa / (1.0 + poisson) * second_moment_m4,
            axial_n: youngs_pa * area_m2,
            mass_kg_per_m: density_kg_per_m3 * area_m2,
        }
    }
}

/// A piece of the unloaded centre line's curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Length along the arc \[m\].
    pub length_m: f64,
    /// Towards the entry's `up` at rotation 0 \[1/m\].
    pub up_per_m: f64,
    /// Towards `direction × up` at rotation 0 \[1/m\].
    pub side_per_m: f64,
}

/// A catheter or guidewire, described from its tip backwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Rod {
    /// Outer radius: where it touches the wall \[m\].
    pub radius_m: f64,
    /// Sections from the tip to the base, at least one; the last one has no end.
    pub sections: Vec<Section>,
    /// Curvature from the tip backwards; straight after the last piece.
    pub curves: Vec<Curve>,
}

/// Properties of a stretch of the rod, integrated over its arc.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stretch {
    /// 1/∫ds/EI \[N·m/rad\].
    pub bending: f64,
    /// 1/∫ds/GJ \[N·m/rad\].
    pub torsion: f64,
    /// 1/∫ds/EA \[N/m\].
    pub axial: f64,
    /// ∫ρA ds \[kg\].
    pub mass: f64,
    /// Angles of the unloaded stretch towards up and side \[rad\].
    pub unloaded: [f64; 2],
}

impl Rod {
    /// Integrals over the arc from `low_m` to `high_m`, measured from the tip.
    pub(crate) fn stretch(&self, low_m: f64, high_m: f64) -> Stretch {
        let (mut bending, mut torsion, mut axial, mut mass) = (0.0, 0.0, 0.0, 0.0);
        let mut start = 0.0;
        for (i, s) in self.sections.iter().enumerate() {
            let last = i + 1 == self.sections.len();
            let end = if last { f64::INFINITY } else { start + s.length_m };
            let length = (high_m.min(end) - low_m.max(start)).max(0.0);
            bending += length / s.bending_n_m2;
            torsion += length / s.torsion_n_m2;
            axial += length / s.axial_n;
            mass += length * s.mass_kg_per_m;
            start = end;
        }
        let mut unloaded = [0.0; 2];
        let mut start = 0.0;
        for c in &self.curves {
            let end = start + c.length_m;
            let length = (high_m.min(end) - low_m.max(start)).max(0.0);
            unloaded[0] += c.up_per_m * length;
            unloaded[1] += c.side_per_m * length;
            start = end;
        }
        Stretch {
            bending: 1.0 / bending,
            torsion: 1.0 / torsion,
            axial: 1.0 / axial,
            mass,
            unloaded,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compliances_add_across_a_joint_of_sections() {
        let section = |length_m, scale: f64| Section {
            length_m,
            bending_n_m2: scale,
            torsion_n_m2: 2.0 * scale,
            axial_n: 3.0 * scale,
            mass_kg_per_m: scale,
        };
        let curve = Curve { length_m: 0.1, up_per_m: 5.0, side_per_m: -1.0 };
        let rod = Rod {
            radius_m: 1e-3,
            sections: vec![section(0.1, 1.0), section(0.1, 4.0)],
            curves: vec![curve],
        };
        let cell = rod.stretch(0.05, 0.25);
        assert!((1.0 / cell.bending - (0.05 + 0.15 / 4.0)).abs() < 1e-12);
        assert!((cell.mass - 0.65).abs() < 1e-12);
        assert!((cell.unloaded[0] - 0.25).abs() < 1e-12);
    }
}
