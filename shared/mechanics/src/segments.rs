//! Instruments as segments of constant properties, and two of them on one centre line.

use core::ops::{Add, Mul};

use cathforce_scalar::Vector3;
use heapless::Vec;

use crate::effects::StoredCurvature;
use crate::math::minimum;
use crate::{Instrument, MAX_PRECURVE, MAX_SECTIONS, Real};

/// Every section and every piece of pre-curvature ends one segment.
const MAX_SEGMENTS: usize = MAX_SECTIONS + MAX_PRECURVE + 1;
/// End of the last segment \[m\]: beyond any insertion.
const UNBOUNDED_M: f64 = 1e6;

/// Part of one instrument with constant properties.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment<T: Real> {
    /// Its end, as an arc from the instrument's tip \[m\].
    pub end_m: T,
    /// E I \[N·m²\].
    pub bending: T,
    /// G J \[N·m²\].
    pub torsion: T,
    /// E A \[N\].
    pub axial: T,
    /// Mass per length \[kg/m\].
    pub mass: T,
    /// Unloaded curvature and twist κ₀: rotation per length, material axes (up, side, tangent)
    /// \[rad/m\].
    pub unloaded: Vector3<T>,
}

impl<T: Real> Segment<T> {
    fn nothing() -> Self {
        let o = T::zero();
        Self { end_m: o, bending: o, torsion: o, axial: o, mass: o, unloaded: Vector3::zeros() }
    }
}

/// One instrument from its tip backwards. The last segment is unbounded.
#[derive(Clone, Debug)]
pub(crate) struct Segments<T: Real>(Vec<Segment<T>, MAX_SEGMENTS>);

impl<T: Real> Segments<T> {
    /// `stored`: curvature of the shaft behind the pre-curved tip.     docs/explanation/model.md (31)
    pub fn of(instrument: &Instrument<T>, stored: &StoredCurvature<T>) -> Self {
        let unbounded = T::lit(UNBOUNDED_M);
        let mut pieces = Vec::new();
        let (mut sections, mut curves) = (&instrument.sections[..], &instrument.precurve[..]);
        let (mut section_end, mut curve_end) = (T::zero(), T::zero());
        while let [section, later @ ..] = sections {
            let section_ends =
                if later.is_empty() { unbounded } else { section_end + section.length_m };
            let curve_ends = curves.first().map_or(unbounded, |curve| curve_end + curve.length_m);
            // Curvature towards `up` turns about `side`, towards `side` about −`up`.
            let (up, side, torsion) = curves
                .first()
                .map_or((stored.curvature_per_m, stored.lateral_curvature_per_m, T::zero()), |c| {
                    (c.curvature_per_m, c.lateral_curvature_per_m, c.torsion_per_m)
                });
            let end_m = minimum(section_ends, curve_ends);
            // Cannot fail: each segment ends a section or a piece of pre-curvature.
            let _ = pieces.push(Segment {
                end_m,
                bending: section.bending_stiffness_n_m2,
                torsion: section.torsional_stiffness_n_m2,
                axial: section.axial_stiffness_n,
                mass: section.mass_kg_per_m,
                unloaded: Vector3::new(-side, up, torsion),
            });
            if section_ends <= end_m {
                (sections, section_end) = (later, section_ends);
            }
            if let ([_, later @ ..], true) = (curves, curve_ends <= end_m) {
                (curves, curve_end) = (later, curve_ends);
            }
        }
        Self(pieces)
    }

    /// Torsional stiffness G J of the shaft \[N·m²\].
    pub fn shaft_torsion(&self) -> T {
        self.0.last().map_or(T::one(), |piece| piece.torsion)
    }
}

/// Position of an instrument in the chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxialPosition<T> {
    /// Arc from the chain's tip back to the instrument's \[m\].
    pub behind_m: T,
    /// Sine and cosine of its roll in the chain's material axes.
    pub roll: (T, T),
}

impl<T: Real> AxialPosition<T> {
    /// At the chain's tip, with no roll.
    pub const fn leading() -> Self {
        Self { behind_m: T::ZERO, roll: (T::ZERO, T::ONE) }
    }
}

/// One instrument, segment by segment from the chain's tip to the guide.
#[derive(Clone)]
struct Cursor<'a, T: Real> {
    rest: core::slice::Iter<'a, Segment<T>>,
    placed: AxialPosition<T>,
    /// The segment here in the chain's axes; without stiffness distal to the instrument's tip.
    piece: Segment<T>,
    /// Its end, as an arc from the chain's tip \[m\].
    end_m: T,
}

impl<'a, T: Real> Cursor<'a, T> {
    fn new(pieces: &'a [Segment<T>], placed: AxialPosition<T>) -> Self {
        let end_m = if pieces.is_empty() { T::lit(UNBOUNDED_M) } else { placed.behind_m };
        let mut cursor = Self { rest: pieces.iter(), placed, piece: Segment::nothing(), end_m };
        if end_m <= T::zero() {
            cursor.advance();
        }
        cursor
    }

    fn advance(&mut self) {
        let Some(piece) = self.rest.next() else {
            self.end_m = T::lit(UNBOUNDED_M);
            return;
        };
        let ((sin, cos), u) = (self.placed.roll, &piece.unloaded);
        self.piece = Segment {
            unloaded: Vector3::new(cos * u.x() - sin * u.y(), sin * u.x() + cos * u.y(), u.z()),
            ..*piece
        };
        self.end_m = self.placed.behind_m + piece.end_m;
    }
}

/// Properties per length of both instruments at one place: their stiffnesses add.
/// docs/explanation/model.md (24)
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Density<T: Real> {
    /// 1/EI \[1/(N·m²)\].
    pub bending_compliance: T,
    /// 1/GJ \[1/(N·m²)\].
    pub torsion_compliance: T,
    /// 1/EA \[1/N\].
    pub axial_compliance: T,
    /// Mass per length \[kg/m\].
    pub mass: T,
    /// Unloaded curvature and twist \[rad/m\].
    pub unloaded: Vector3<T>,
}

impl<T: Real> Density<T> {
    fn of(catheter: &Segment<T>, wire: &Segment<T>) -> Self {
        let bending = T::one() / (catheter.bending + wire.bending);
        let torsion = T::one() / (catheter.torsion + wire.torsion);
        // In this form, a guidewire without stiffness changes no bit.
        let (bent, twisted) = (wire.bending * bending, wire.torsion * torsion);
        let between = wire.unloaded - catheter.unloaded;
        Self {
            bending_compliance: bending,
            torsion_compliance: torsion,
            axial_compliance: T::one() / (catheter.axial + wire.axial),
            mass: catheter.mass + wire.mass,
            unloaded: catheter.unloaded
                + Vector3::new(between.x() * bent, between.y() * bent, between.z() * twisted),
        }
    }
}

impl<T: Real> Mul<T> for Density<T> {
    type Output = Self;
    fn mul(self, length: T) -> Self {
        Self {
            bending_compliance: self.bending_compliance * length,
            torsion_compliance: self.torsion_compliance * length,
            axial_compliance: self.axial_compliance * length,
            mass: self.mass * length,
            unloaded: self.unloaded * length,
        }
    }
}

impl<T: Real> Add for Density<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            bending_compliance: self.bending_compliance + other.bending_compliance,
            torsion_compliance: self.torsion_compliance + other.torsion_compliance,
            axial_compliance: self.axial_compliance + other.axial_compliance,
            mass: self.mass + other.mass,
            unloaded: self.unloaded + other.unloaded,
        }
    }
}

/// One of the two instruments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum InstrumentRole {
    Catheter,
    Guidewire,
}

/// Both instruments from the chain's tip to the guide, by stretches in which the properties of both
/// are constant.
#[derive(Clone)]
pub(crate) struct Walk<'a, T: Real> {
    catheter: Cursor<'a, T>,
    wire: Cursor<'a, T>,
    pub density: Density<T>,
    /// Position of the walk and end of its stretch, as arcs from the chain's tip \[m\].
    pub at_m: T,
    pub end_m: T,
}

impl<'a, T: Real> Walk<'a, T> {
    pub fn new(
        catheter: (&'a Segments<T>, AxialPosition<T>),
        wire: Option<(&'a Segments<T>, AxialPosition<T>)>,
    ) -> Self {
        let catheter = Cursor::new(&catheter.0.0, catheter.1);
        let wire = wire.map_or(Cursor::new(&[], AxialPosition::leading()), |(pieces, placed)| {
            Cursor::new(&pieces.0, placed)
        });
        Self {
            density: Density::of(&catheter.piece, &wire.piece),
            at_m: T::zero(),
            end_m: minimum(catheter.end_m, wire.end_m),
            catheter,
            wire,
        }
    }

    /// Segment of one instrument at the walk's position.
    pub fn segment(&self, which: InstrumentRole) -> &Segment<T> {
        match which {
            InstrumentRole::Catheter => &self.catheter.piece,
            InstrumentRole::Guidewire => &self.wire.piece,
        }
    }

    /// Moves past the end of the stretch; returns the instrument whose segment ends there.
    pub fn advance(&mut self) -> InstrumentRole {
        let which = if self.catheter.end_m <= self.wire.end_m {
            self.catheter.advance();
            InstrumentRole::Catheter
        } else {
            self.wire.advance();
            InstrumentRole::Guidewire
        };
        self.density = Density::of(&self.catheter.piece, &self.wire.piece);
        self.end_m = minimum(self.catheter.end_m, self.wire.end_m);
        which
    }

    /// Moves to the arc `high_m` \[m\]; returns the integral of the densities up to there.
    pub fn integral_to(&mut self, high_m: T) -> Density<T> {
        let mut before = None;
        while self.end_m < high_m {
            let (end_m, density) = (self.end_m, self.density);
            self.advance();
            // A boundary at which no property changes does not split the sum.
            if self.density != density {
                let stretch = density * (end_m - self.at_m);
                before = Some(before.map_or(stretch, |sum| sum + stretch));
                self.at_m = end_m;
            }
        }
        let stretch = self.density * (high_m - self.at_m);
        self.at_m = high_m;
        before.map_or(stretch, |sum| sum + stretch)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::grid::Grid;
    use crate::tables::Tables;
    use crate::{PrecurvePiece, Section};

    fn curve(length_m: f32, curvature_per_m: f32) -> PrecurvePiece<f32> {
        PrecurvePiece {
            length_m,
            curvature_per_m,
            lateral_curvature_per_m: -0.5 * curvature_per_m,
            torsion_per_m: 0.1 * curvature_per_m,
        }
    }

    fn instrument(sections: &[(f32, f32)], curves: &[PrecurvePiece<f32>]) -> Instrument<f32> {
        let section = |&(length_m, stiffness): &(f32, f32)| Section {
            length_m,
            bending_stiffness_n_m2: stiffness,
            torsional_stiffness_n_m2: 0.7 * stiffness,
            axial_stiffness_n: 3e6 * stiffness,
            mass_kg_per_m: 100.0 * stiffness,
        };
        Instrument {
            outer_radius_m: 0.8e-3,
            sections: sections.iter().map(section).collect(),
            precurve: curves.iter().copied().collect(),
        }
    }

    fn pieces(sections: &[(f32, f32)], curves: &[PrecurvePiece<f32>]) -> Segments<f32> {
        Segments::of(&instrument(sections, curves), &StoredCurvature::off())
    }

    fn bits(walk: Walk<'_, f32>) -> std::vec::Vec<u32> {
        let mut tables = Tables::<f32, 32>::new();
        tables.fill(32, &Grid::uniform(1.7e-3), walk);
        let joints = tables
            .joints
            .iter()
            .flat_map(|j| [j.bending, j.torsion, j.unloaded.x(), j.unloaded.y(), j.unloaded.z()]);
        let links = tables.links.iter().flat_map(|link| [link.axial, link.mass]);
        joints.chain(links).map(|x| (x + 0.0).to_bits()).collect()
    }

    #[test]
    fn a_wire_without_stiffness_changes_no_bit() {
        let catheter =
            pieces(&[(0.0113, 3e-5), (0.2, 1e-5)], &[curve(0.007, 83.0), curve(0.02, -31.0)]);
        let wire = pieces(&[(0.0101, 0.0), (0.01, 0.0)], &[curve(0.0033, 120.0)]);
        let alone = bits(Walk::new((&catheter, AxialPosition::leading()), None));
        for behind_m in [0.0, 0.0004, 0.0171, 0.05, 1.0] {
            let placed = AxialPosition { behind_m, roll: (0.6, 0.8) };
            let both = Walk::new((&catheter, AxialPosition::leading()), Some((&wire, placed)));
            assert_eq!(bits(both), alone, "{behind_m} m behind");
        }
    }

    #[test]
    fn integrals_over_cells_are_those_over_pieces() {
        // By hand: stretches of the overlap, from the tip.
        let catheter = pieces(&[(0.004, 2e-5), (0.1, 1e-5)], &[curve(0.006, 50.0)]);
        let wire = pieces(&[(0.1, 3e-5)], &[]);
        let placed = AxialPosition { behind_m: 0.003, roll: (0.0, 1.0) };
        let mut walk = Walk::new((&catheter, AxialPosition::leading()), Some((&wire, placed)));
        let whole = walk.integral_to(0.01);
        let bending = 0.003 / 2e-5 + 0.001 / 5e-5 + 0.006 / 4e-5;
        assert!(
            (whole.bending_compliance / bending - 1.0).abs() < 1e-5,
            "{}",
            whole.bending_compliance
        );
        let turn = 50.0 * (0.003 + 0.001 * 2.0 / 5.0 + 0.002 / 4.0);
        assert!((whole.unloaded.y() / turn - 1.0).abs() < 1e-5, "{}", whole.unloaded.y());
        let mass = 2e-3 * 0.004 + 1e-3 * 0.006 + 3e-3 * 0.007;
        assert!((whole.mass / mass - 1.0).abs() < 1e-5, "{}", whole.mass);
    }
}
