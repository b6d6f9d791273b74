//! Declaration of every effect beyond the nominal model: parameters, units, off values and ranges.
//! The section "Effects" of docs/explanation/model.md has the equations.

use cathforce_scalar::Real;
use serde::{Deserialize, Serialize};

use super::declare::{EffectInfo, ParameterInfo, effects, parameter_key};

/// Largest phase \[rad\]. It exceeds 2π, because a phase may wander while it is fitted.
const PHASE: f64 = 7.0;

effects! {
    /// Between the encoder and the instrument at the entry plane.
    drive: DriveEffects {
        /// Insertion speed that goes up and down with the drive's rollers.
        ripple: Ripple {
            /// Amplitude over the commanded speed.
            ratio: "1", 0.0, -0.9, 0.9;
            /// Periods per length of feed.
            cycles_per_m: "1/m", 100.0, 0.0, 5000.0;
            /// Periods per time.
            cycles_per_s: "Hz", 0.0, 0.0, 50.0;
            /// Phase where the run begins.
            phase_rad: "rad", 0.0, -PHASE, PHASE;
        }
        /// Feed that the rollers lose in proportion to the axial force.
        slip: Slip {
            /// Share of the feed that is lost per newton of drive force against it.
            per_n: "1/N", 0.0, 0.0, 100.0;
        }
        /// Dead zone at reversal.
        backlash: Backlash {
            /// Feed that is lost when its direction changes.
            insertion_m: "m", 0.0, 0.0, 0.02;
            /// Rotation that is lost when its direction changes.
            rotation_rad: "rad", 0.0, 0.0, 3.0;
            /// Share of the motion that comes through at the end of the dead zone, and evenly less
            /// before it: 0 is a gap, 1 is taken up without a knock.
            gradual: "1", 0.0, 0.0, 1.0;
        }
        /// Motion at the entry plane over what the encoder says.
        encoder_scale: EncoderScale {
            /// Of the feed since the run began.
            insertion: "1", 1.0, 0.5, 2.0;
            /// Of the rotation since the run began.
            rotation: "1", 1.0, 0.5, 2.0;
        }
        /// Time by which the instrument follows the encoder's samples late.
        latency: Latency {
            /// Delay; no longer than the model remembers at its tick.
            time_s: "s", 0.0, 0.0, 0.12;
        }
    }
    /// Where the instrument enters the vessel.
    entry: EntryEffects {
        /// Friction of the introducer or direction-limiting guide along the instrument.
        drag: EntryDrag {
            /// Sliding friction.
            coulomb_n: "N", 0.0, 0.0, 5.0;
            /// Friction per speed of the feed.
            viscous_n_s_per_m: "N·s/m", 0.0, 0.0, 50.0;
            /// Feed over which the friction turns round at reversal.
            presliding_m: "m", 2e-5, 1e-6, 1e-2;
            /// Share that the vessel's sensor feels, because it carries the introducer.
            phantom_share: "1", 0.0, 0.0, 1.0;
        }
        /// A guide that goes on past the entry plane and straightens the pre-curved tip.
        guide: EntryGuide {
            /// How far the tight guide reaches past the entry plane.
            length_m: "m", 0.0, 0.0, 0.2;
            /// Arc past the mouth over which the pre-curvature comes back.
            straightened_m: "m", 0.0, 0.0, 0.2;
        }
    }
    /// Friction at the wall; its coefficient is `wall.friction_coefficient`.
    contact: ContactEffects {
        /// Static above kinetic friction.
        stribeck: Stribeck {
            /// Coefficient at rest over the one in fast sliding.
            static_ratio: "1", 1.0, 0.2, 5.0;
            /// Speed of the drive, feed and turn together, at which half of the difference is gone.
            speed_m_per_s: "m/s", 5e-3, 1e-5, 0.2;
            /// Relative growth of the coefficient per speed of the drive.
            viscous_s_per_m: "s/m", 0.0, 0.0, 50.0;
        }
        /// Friction that depends on load or wear.
        load_friction: LoadFriction {
            /// Coefficient at no load over the nominal one.
            light_load_ratio: "1", 1.0, 0.05, 10.0;
            /// Coefficient at high load over the nominal one.
            high_load_ratio: "1", 1.0, 0.05, 10.0;
            /// Normal force per length half-way between the two.
            load_n_per_m: "N/m", 10.0, 0.5, 1e3;
            /// Coefficient after long sliding over the one at first.
            worn_ratio: "1", 1.0, 0.05, 10.0;
            /// Feed, either way, after which half of that has happened.
            wear_length_m: "m", 0.5, 1e-3, 100.0;
        }
    }
    /// The vessel's wall.
    wall: WallEffects {
        /// Wall stiffness other than nominal.
        stiffness: WallStiffness {
            /// Over the nominal one, at the line and at the free end.
            factor: "1", 1.0, 0.01, 100.0;
        }
        /// Force that grows faster (or slower) than the indentation.
        hyperelastic: Hyperelastic {
            /// Compression of the wall's material per indentation, 1/thickness; negative softens.
            strain_per_m: "1/m", 0.0, -5e3, 1e5;
            /// C01/(C10 + C01): 0 neo-Hookean, above it Mooney–Rivlin.
            mooney_share: "1", 0.0, 0.0, 1.0;
        }
        /// Wall that relaxes under load: a standard linear solid.
        viscoelastic: WallViscoelastic {
            /// Stiffness that relaxes over the one that stays.
            ratio: "1", 0.0, 0.0, 20.0;
            /// Relaxation time.
            time_s: "s", 0.5, 1e-3, 100.0;
        }
        /// Wall that moves to and fro as a whole: respiration, pulse.
        motion: WallMotion {
            /// Amplitude along x of the vessel frame.
            x_m: "m", 0.0, -0.03, 0.03;
            /// Amplitude along y of the vessel frame.
            y_m: "m", 0.0, -0.03, 0.03;
            /// Amplitude along z of the vessel frame.
            z_m: "m", 0.0, -0.03, 0.03;
            /// Frequency.
            frequency_hz: "Hz", 0.25, 0.0, 5.0;
            /// Phase where the run begins; at 0 the wall is in the middle.
            phase_rad: "rad", 0.0, -PHASE, PHASE;
        }
        /// Phantom that stands elsewhere than the rig says.
        registration: Registration {
            /// Displacement of the phantom along x.
            x_m: "m", 0.0, -0.03, 0.03;
            /// Displacement of the phantom along y.
            y_m: "m", 0.0, -0.03, 0.03;
            /// Displacement of the phantom along z.
            z_m: "m", 0.0, -0.03, 0.03;
            /// Tilt about x through the entry point.
            tilt_x_rad: "rad", 0.0, -0.3, 0.3;
            /// Tilt about y through the entry point.
            tilt_y_rad: "rad", 0.0, -0.3, 0.3;
            /// Tilt about z through the entry point.
            tilt_z_rad: "rad", 0.0, -0.3, 0.3;
        }
        /// Lumen that is narrower than its model over a short length.
        narrowing: Narrowing {
            /// Loss of radius at its middle; negative widens.
            depth_m: "m", 0.0, -5e-3, 5e-3;
            /// Half of its length along the vessel.
            half_length_m: "m", 8e-3, 1e-3, 0.1;
            /// Its middle on the vessel's centre line.
            x_m: "m", 0.0, -10.0, 10.0;
            /// Its middle on the vessel's centre line.
            y_m: "m", 0.0, -10.0, 10.0;
            /// Its middle on the vessel's centre line.
            z_m: "m", 0.0, -10.0, 10.0;
        }
    }
    /// The catheter or guidewire.
    instrument: InstrumentEffects {
        /// Elastic moduli other than nominal.
        stiffness: InstrumentStiffness {
            /// Of every section but the tip's, over the nominal one.
            shaft_factor: "1", 1.0, 0.05, 20.0;
            /// Of the section at the tip, over the nominal one; with a single section of the
            /// pre-curved length.
            tip_factor: "1", 1.0, 0.05, 20.0;
        }
        /// Curvature that the shaft keeps from its packaging.
        stored_curvature: StoredCurvature {
            /// Behind the pre-curved tip, towards `up` at rotation 0.
            curvature_per_m: "1/m", 0.0, -50.0, 50.0;
            /// Behind the pre-curved tip, towards `direction × up`.
            lateral_curvature_per_m: "1/m", 0.0, -50.0, 50.0;
        }
        /// Tip whose pre-curvature is other than nominal.
        tip_precurve: TipPrecurve {
            /// Curvature over the nominal one.
            factor: "1", 1.0, -1.0, 3.0;
        }
        /// Shaft between the drive's clamp and the entry plane that twists.
        torsional_windup: TorsionalWindup {
            /// Length that is free to twist.
            free_length_m: "m", 0.0, 0.0, 5.0;
        }
        /// Bending moment that follows the rate of bending (Kelvin–Voigt), or that relaxes (standard linear solid).
        viscoelastic: InstrumentViscoelastic {
            /// Moment = stiffness · (bend + time · rate of bend).
            time_s: "s", 0.0, 0.0, 2.0;
            /// Bending stiffness that relaxes over the one that stays.
            ratio: "1", 0.0, 0.0, 20.0;
            /// Relaxation time.
            relaxation_s: "s", 0.5, 1e-3, 100.0;
            /// Share of the pre-curvature from which the part that relaxes has crept away in the package.
            packed_share: "1", 0.0, 0.0, 1.0;
        }
        /// Instrument that grows softer in the warm vessel.
        softening: Softening {
            /// Share of bending and torsional stiffness that is lost in the end.
            share: "1", 0.0, -2.0, 0.95;
            /// Time in which 63 % of it is lost.
            time_s: "s", 30.0, 0.1, 1e5;
        }
        /// Weight and buoyancy other than nominal.
        weight: Weight {
            /// Over the nominal weight in its fluid.
            factor: "1", 1.0, -100.0, 100.0;
        }
    }
    /// The tendon of a steerable instrument, which `tendon` of the description describes.
    tendon: TendonEffects {
        /// Friction along the tendon's lumen.
        friction: TendonFriction {
            /// Coefficient: the pull fades with it times the angle turned (capstan).
            coefficient: "1", 0.0, 0.0, 2.0;
        }
        /// Tendon that has to be taken up before it pulls.
        slack: TendonSlack {
            /// Pull that does nothing.
            length_m: "m", 0.0, 0.0, 0.02;
        }
    }
    /// The fluid in the vessel.
    fluid: FluidEffects {
        /// Drag of the stream, steady and with the pulse, of parabolic profile.
        drag: FluidDrag {
            /// In mid-stream, along the instrument towards its tip, per length.
            along_n_per_m: "N/m", 0.0, -2.0, 2.0;
            /// In mid-stream along x, on the part of it across the instrument, per length.
            x_n_per_m: "N/m", 0.0, -2.0, 2.0;
            /// In mid-stream along y, on the part of it across the instrument, per length.
            y_n_per_m: "N/m", 0.0, -2.0, 2.0;
            /// In mid-stream along z, on the part of it across the instrument, per length.
            z_n_per_m: "N/m", 0.0, -2.0, 2.0;
            /// Amplitude of the pulse over the steady part.
            pulse_ratio: "1", 0.0, 0.0, 5.0;
            /// Pulses per time.
            frequency_hz: "Hz", 1.2, 0.0, 5.0;
            /// Phase where the run begins.
            phase_rad: "rad", 0.0, -PHASE, PHASE;
            /// Distance from the wall at which the stream is fastest.
            lumen_radius_m: "m", 5e-3, 5e-4, 5e-2;
        }
    }
    /// The force sensor under the vessel; they change what it reads, nothing else.
    sensor: SensorEffects {
        /// Reading without a force.
        bias: SensorBias {
            /// Along x.
            x_n: "N", 0.0, -5.0, 5.0;
            /// Along y.
            y_n: "N", 0.0, -5.0, 5.0;
            /// Along z.
            z_n: "N", 0.0, -5.0, 5.0;
        }
        /// Bias that grows with time.
        drift: SensorDrift {
            /// Along x.
            x_n_per_s: "N/s", 0.0, -0.5, 0.5;
            /// Along y.
            y_n_per_s: "N/s", 0.0, -0.5, 0.5;
            /// Along z.
            z_n_per_s: "N/s", 0.0, -0.5, 0.5;
        }
        /// Reading over force.
        gain: SensorGain {
            /// The same for the three axes.
            factor: "1", 1.0, 0.1, 10.0;
        }
        /// Sensor whose axes are turned against the vessel's.
        // Up to a quarter turn: a sensor may be mounted with another side up.
        misalignment: SensorMisalignment {
            /// Rotation about x.
            x_rad: "rad", 0.0, -1.6, 1.6;
            /// Rotation about y.
            y_rad: "rad", 0.0, -1.6, 1.6;
            /// Rotation about z.
            z_rad: "rad", 0.0, -1.6, 1.6;
        }
        /// Sensor that follows the force late (first order).
        time_constant: SensorTimeConstant {
            /// Time to 63 % of a step.
            time_s: "s", 0.0, 0.0, 2.0;
        }
    }
}
