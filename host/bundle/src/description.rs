//! The model's description of a rig.

use cathforce_config::image::most_links;
use cathforce_mechanics::{
    Description, Drag, DrivenTendon, Effects, Entry, Instrument, PrecurvePiece, Real, Section,
    Solver, Tendon, Wall,
};
use nalgebra::Vector3;

use crate::bundle::{
    Bundle, CatheterRig, RigDrivenTendon, RigInstrument, RigSection, RigTendon, RigVessel,
};

/// Numbers that the model needs and a bundle does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverDefaults {
    /// Time of one tick \[s\].
    pub tick_s: f64,
    /// Least number of equal parts of a tick.
    pub substeps: u8,
    /// A wall that is stiffer than this (glass, metal) takes two parts a tick; otherwise contact that
    /// opens and closes within a tick chatters \[N/m²\].
    pub near_rigid_n_per_m2: f64,
    /// Solves in each part of a tick.
    pub solves: u8,
    /// Share of a new rate that enters the predictor \[1\].
    pub predictor_gain: f64,
    /// Viscous time of bending \[s\].
    pub bending_damping_s: f64,
    /// Drag on every node against all motion but that of the feed.
    pub drag: Drag<f64>,
    /// Tangential stiffness of the wall before slip over the normal one, unless
    /// `wall_tangential_ratio` is given \[1\].
    pub tangential_ratio: f64,
    /// Indentation over which the normal force sets in \[m\].
    pub onset_m: f64,
    /// Normal damping of the wall, as a time \[s\].
    pub wall_damping_s: f64,
    /// The links reach this much farther than the largest insertion of any trial \[m\].
    pub reach_margin_m: f64,
    /// No link of the shaft is shorter \[m\].
    pub shortest_link_m: f64,
    /// Number of links at the tip that are half as long.
    pub tip_links: usize,
}

impl Default for SolverDefaults {
    fn default() -> Self {
        Self {
            tick_s: 1e-3,
            substeps: 1,
            near_rigid_n_per_m2: 1e7,
            solves: 1,
            predictor_gain: 0.15,
            bending_damping_s: 1e-3,
            drag: Drag { at_rest_n_s_per_m2: 0.155, swift_n_s_per_m2: 8.0, swift_m_per_s: 0.16 },
            tangential_ratio: 3.0,
            onset_m: 10e-6,
            wall_damping_s: 8e-4,
            reach_margin_m: 5e-3,
            shortest_link_m: 1e-3,
            tip_links: 10,
        }
    }
}

impl SolverDefaults {
    /// Length of a link of the shaft at which a chain of `links` links reaches `insertion_m` and the
    /// margin, with one link to spare \[m\].
    pub fn link_length_m(&self, insertion_m: f64, links: usize) -> f64 {
        let reach_m = insertion_m + self.reach_margin_m;
        self.link_length_over(reach_m, (links - 1) as f64).max(self.shortest_link_m)
    }

    /// Length of a link of the shaft at which `links` links, those of the tip included, span `arc_m` \[m\].
    pub fn link_length_over(&self, arc_m: f64, links: f64) -> f64 {
        arc_m / self.reach_m(1.0, links)
    }

    /// Reach of `links` links if those of the shaft have this length \[m\].
    pub fn reach_m(&self, link_length_m: f64, links: f64) -> f64 {
        link_length_m * (links - 0.5 * links.min(self.tip_links as f64))
    }

    /// Arc of the short links at the tip if those of the shaft have this length \[m\]. It is slightly
    /// longer than their sum, so that rounding loses none of them.
    pub fn fine_tip_m(&self, link_length_m: f64) -> f64 {
        const SPARE: f64 = 0.25;
        if self.tip_links == 0 {
            0.0
        } else {
            0.5 * link_length_m * (self.tip_links as f64 + SPARE)
        }
    }

    /// Number of links that the device has time for in this vessel, without effects.
    pub fn links_in(&self, vessel: &RigVessel) -> usize {
        self.links_at(vessel.stiffest_n_per_m2())
    }

    /// The same at a wall of this line stiffness \[N/m²\].
    pub fn links_at(&self, line_stiffness_n_per_m2: f64) -> usize {
        most_links(self.solves, self.substeps_for(line_stiffness_n_per_m2), false)
    }

    /// [`Self::drag`], in the model's precision.
    pub fn drag<T: Real>(&self) -> Drag<T> {
        Drag {
            at_rest_n_s_per_m2: T::lit(self.drag.at_rest_n_s_per_m2),
            swift_n_s_per_m2: T::lit(self.drag.swift_n_s_per_m2),
            swift_m_per_s: T::lit(self.drag.swift_m_per_s),
        }
    }

    /// Parts of a tick for a wall of this line stiffness \[N/m²\].
    pub fn substeps_for(&self, line_stiffness_n_per_m2: f64) -> u8 {
        let least = if line_stiffness_n_per_m2 > self.near_rigid_n_per_m2 { 2 } else { 1 };
        self.substeps.max(least)
    }
}

/// The model's description of a catheter's rig.
///
/// `link_length_m`: as [`SolverDefaults::link_length_m`] gives it. Rounding to `T` is the
/// only loss.
pub fn describe<T: Real>(
    rig: &CatheterRig,
    defaults: &SolverDefaults,
    link_length_m: f64,
) -> Description<T> {
    let lit = T::lit;
    let vector = |v: [f64; 3]| v.map(lit);
    let vessel = &rig.vessel;
    Description {
        instrument: describe_instrument(&rig.instrument),
        guidewire: rig.guidewire.as_ref().map(describe_instrument),
        tendon: rig.tendon.as_ref().map_or_else(Tendon::none, describe_tendon),
        // Reading the bundle has checked their number.
        tendons: rig.tendons.iter().map(describe_driven_tendon).collect(),
        entry: Entry {
            position_m: vector(rig.entry.position_m),
            direction: vector(rig.entry.direction),
            up: vector(rig.entry.up),
        },
        wall: Wall {
            line_stiffness_n_per_m2: lit(vessel.line_stiffness_n_per_m2()),
            end_stiffness_n_per_m: lit(0.5 * vessel.wall_stiffness_n_per_m),
            tangential_ratio: lit(vessel
                .wall_tangential_ratio
                .unwrap_or(defaults.tangential_ratio)),
            friction_coefficient: lit(vessel.friction_coefficient),
            onset_m: lit(defaults.onset_m),
            damping_s: lit(defaults.wall_damping_s),
        },
        effects: Effects::off(),
        gravity_m_per_s2: vector(effective_gravity(rig).into()),
        solver: Solver {
            link_length_m: lit(link_length_m),
            fine_tip_m: lit(defaults.fine_tip_m(link_length_m)),
            tick_s: lit(defaults.tick_s),
            substeps: defaults.substeps_for(vessel.stiffest_n_per_m2()),
            solves: defaults.solves,
            predictor_gain: lit(defaults.predictor_gain),
            bending_damping_s: lit(defaults.bending_damping_s),
            drag: defaults.drag(),
        },
    }
}

/// [`describe`] with links that reach the largest insertion of the bundle's trials.
/// `None` for a drive, or without trials, when the largest insertion is not known.
pub fn to_description<T: Real>(
    bundle: &Bundle,
    defaults: &SolverDefaults,
) -> Option<Description<T>> {
    let rig = bundle.catheter()?;
    let links = defaults.links_in(&rig.vessel);
    let link_length_m = defaults.link_length_m(bundle.largest_insertion_m()?, links);
    Some(describe(rig, defaults, link_length_m))
}

/// Cross-section of a tube: I = π/4 (r_o⁴ − r_i⁴), J = 2 I, A = π (r_o² − r_i²).
struct CrossSection {
    second_moment_m4: f64,
    area_m2: f64,
}

impl CrossSection {
    fn of(instrument: &RigInstrument) -> Self {
        use std::f64::consts::PI;
        let (outer, inner) = (0.5 * instrument.outer_diameter_m, 0.5 * instrument.inner_diameter_m);
        Self {
            second_moment_m4: 0.25 * PI * (outer.powi(4) - inner.powi(4)),
            area_m2: PI * (outer * outer - inner * inner),
        }
    }
}

fn describe_instrument<T: Real>(instrument: &RigInstrument) -> Instrument<T> {
    let precurve = instrument.tip_precurve.iter().map(|piece| PrecurvePiece {
        length_m: T::lit(piece.length_m),
        curvature_per_m: T::lit(piece.curvature_per_m),
        lateral_curvature_per_m: T::zero(),
        torsion_per_m: T::zero(),
    });
    let sections = instrument.sections.iter().rev();
    Instrument {
        outer_radius_m: T::lit(0.5 * instrument.outer_diameter_m),
        // Reading the bundle has checked their number.
        sections: sections.map(|section| describe_section(instrument, section)).collect(),
        precurve: precurve.collect(),
    }
}

fn describe_section<T: Real>(instrument: &RigInstrument, section: &RigSection) -> Section<T> {
    let tube = CrossSection::of(instrument);
    let youngs = section.youngs_modulus_pa;
    let shear = youngs / (2.0 * (1.0 + instrument.poissons_ratio));
    Section {
        length_m: T::lit(section.length_m),
        bending_stiffness_n_m2: T::lit(youngs * tube.second_moment_m4),
        torsional_stiffness_n_m2: T::lit(shear * 2.0 * tube.second_moment_m4),
        axial_stiffness_n: T::lit(youngs * tube.area_m2),
        mass_kg_per_m: T::lit(instrument.density_kg_per_m3 * tube.area_m2),
    }
}

fn describe_tendon<T: Real>(tendon: &RigTendon) -> Tendon<T> {
    Tendon {
        pull_m: T::lit(tendon.pull_m),
        stiffness_n_per_m: T::lit(tendon.stiffness_n_per_m),
        offset_m: T::lit(tendon.offset_m),
        length_m: T::lit(tendon.length_m),
        angle_rad: T::lit(tendon.angle_rad),
    }
}

fn describe_driven_tendon<T: Real>(tendon: &RigDrivenTendon) -> DrivenTendon<T> {
    DrivenTendon {
        angle_rad: T::lit(tendon.angle_rad),
        offset_m: T::lit(tendon.offset_m),
        anchor_m: T::lit(tendon.anchor_m),
        stiffness_n_per_m: T::lit(tendon.stiffness_n_per_m),
        slack_m: T::lit(tendon.slack_m),
        static_friction: T::lit(tendon.static_friction),
        sliding_friction: T::lit(tendon.sliding_friction),
        bend_behind_rad: T::lit(tendon.bend_behind_rad),
    }
}

/// Gravity less buoyancy, as an acceleration of the instrument's own mass \[m/s²\]. The
/// instrument displaces its outer area: its ends are closed and its bore holds no fluid.
///
/// The model has one acceleration. With a guidewire it is that of both where the wire lies in the
/// catheter, which is nearly everywhere.
fn effective_gravity(rig: &CatheterRig) -> Vector3<f64> {
    let gravity = Vector3::from(rig.environment.gravity_m_per_s2);
    let Some(fluid) = rig.environment.fluid else { return gravity };
    let radius_m = 0.5 * rig.instrument.outer_diameter_m;
    let displaced = fluid.density_kg_per_m3 * std::f64::consts::PI * radius_m * radius_m;
    let mass = |i: &RigInstrument| i.density_kg_per_m3 * CrossSection::of(i).area_m2;
    let both = mass(&rig.instrument) + rig.guidewire.as_ref().map_or(0.0, mass);
    gravity * (1.0 - displaced / both)
}
