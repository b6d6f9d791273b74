//! Random instruments, walls, solvers and drives, each from one seed.

use cathforce_mechanics::*;

/// A small random generator. A failure reports its seed, so that it can be repeated.
#[derive(Clone)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        // Neighbouring seeds must not give neighbouring numbers.
        let mut random = Self(seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        for _ in 0..4 {
            random.next();
        }
        random
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// Uniform in the logarithm.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next())
    }

    /// Zero in one of three, else uniform in the logarithm.
    pub fn sometimes(&mut self, low: f64, high: f64) -> f64 {
        if self.next() < 1.0 / 3.0 { 0.0 } else { self.scale(low, high) }
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.next() * count as f64) as usize).min(count - 1)
    }
}

/// A random description that [`Description::validate`] accepts and that is plausible for a vessel of
/// 300 mm: no instrument as stiff as an iron bar, no link longer than the vessel is wide.
pub fn any_description(random: &mut Random) -> Description<f32> {
    let f = |x: f64| x as f32;
    let shaft = random.scale(1e-7, 1e-3);
    let sections = (0..1 + random.below(3)).map(|_| {
        let bending = shaft * random.scale(0.1, 1.0);
        Section {
            length_m: f(random.scale(5e-3, 0.1)),
            bending_stiffness_n_m2: f(bending),
            torsional_stiffness_n_m2: f(bending * random.scale(0.2, 2.0)),
            axial_stiffness_n: f((bending * random.scale(1e5, 1e8)).max(0.1)),
            mass_kg_per_m: f(random.scale(1e-4, 3e-2)),
        }
    });
    let sections = sections.collect();
    let precurve = (0..random.below(4)).map(|_| PrecurvePiece {
        length_m: f(random.between(0.0, 0.03)),
        curvature_per_m: f(random.between(-150.0, 150.0)),
        lateral_curvature_per_m: f(random.between(-100.0, 100.0)),
        torsion_per_m: f(random.between(-50.0, 50.0)),
    });
    let precurve = precurve.collect();
    Description {
        instrument: Instrument {
            outer_radius_m: f(random.between(2e-4, 1.4e-3)),
            sections,
            precurve,
        },
        entry: Entry { position_m: [0.0; 3], direction: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0] },
        wall: Wall {
            line_stiffness_n_per_m2: f(random.scale(1e2, 1e8)),
            end_stiffness_n_per_m: f(random.sometimes(1.0, 1e6)),
            tangential_ratio: f(random.sometimes(1e-2, 100.0)),
            friction_coefficient: f(random.sometimes(0.05, 2.0)),
            onset_m: f(random.scale(1e-6, 1e-3)),
            damping_s: f(random.sometimes(1e-4, 0.1)),
        },
        guidewire: None,
        tendon: Tendon::none(),
        tendons: [].into_iter().collect(),
        effects: Effects::off(),
        gravity_m_per_s2: core::array::from_fn(|_| f(random.between(-10.0, 10.0))),
        solver: Solver {
            link_length_m: f(random.between(1.6e-3, 4e-3)),
            fine_tip_m: 0.0,
            tick_s: 1e-3,
            substeps: 1 + random.below(2) as u8,
            solves: 1 + random.below(2) as u8,
            predictor_gain: f(random.sometimes(0.05, 1.0)),
            bending_damping_s: f(random.sometimes(1e-4, 0.1)),
            drag: any_drag(random),
        },
    }
}

/// [`any_description`] with shorter links at the tip, as on devices. Later random draws do not change.
pub fn short_at_tip(random: &mut Random) -> Description<f32> {
    let mut description = any_description(random);
    description.solver.fine_tip_m = random.clone().scale(1e-3, 0.2) as f32;
    description
}

/// [`any_description`] with a guidewire in half of the cases, a pulled tendon in half of them, and one
/// effect in four at a random or a mild value.
pub fn laden(random: &mut Random) -> Description<f32> {
    let mut description = any_description(random);
    if random.below(2) == 0 {
        let mut wire = any_description(random).instrument;
        wire.outer_radius_m =
            description.instrument.outer_radius_m * random.between(0.1, 1.0) as f32;
        description.guidewire = Some(wire);
    }
    if random.below(2) == 0 {
        // Pulled at most as far as bends the free tip by a full turn, and at most 100 times as stiff as
        // the instrument, because a stiffer one would crush it.
        let sections = description.instrument.sections.iter();
        let softest = sections.map(|s| f64::from(s.bending_stiffness_n_m2)).fold(1.0, f64::min);
        let (offset_m, length_m) = (random.scale(1e-4, 2e-3), random.scale(0.02, 0.2));
        let balanced_n_per_m = softest / (offset_m * offset_m * length_m);
        description.tendon = Tendon {
            pull_m: (offset_m * random.between(0.0, core::f64::consts::TAU)) as f32,
            stiffness_n_per_m: (balanced_n_per_m * random.scale(0.1, 100.0)).min(1e5) as f32,
            offset_m: offset_m as f32,
            length_m: length_m as f32,
            angle_rad: random.between(-3.0, 3.0) as f32,
        };
    }
    for effect in EFFECTS {
        let most = match effect.id {
            // Not a parameter of the step.
            id if id.starts_with("sensor.") => continue,
            // Only millimetres, because a wall that moves through the instrument throws it.
            "wall.motion" | "wall.registration" => 0.05,
            _ => 1.0,
        };
        if random.below(4) > 0 {
            continue;
        }
        let share = most * if random.below(2) == 0 { 1.0 } else { random.scale(1e-3, 0.1) };
        for info in effect.parameters {
            let anywhere = random.between(info.min, info.max);
            let off = info.off.unwrap_or(anywhere);
            // After rounding to single precision it must stay within the range.
            let value = (off + share * (anywhere - off)) as f32;
            let value = value.clamp(info.min as f32, info.max as f32);
            description.set_parameter(info.key, value).unwrap();
        }
        if effect.id == "wall.narrowing" {
            description.effects.wall.narrowing.x_m = random.between(0.0, 0.12) as f32;
            description.effects.wall.narrowing.y_m = random.between(-0.01, 0.01) as f32;
            description.effects.wall.narrowing.z_m = 0.0;
        }
    }
    description
}

/// [`any_description`] with one to four tendons that drives pull, of one solve as on devices.
pub fn steered(random: &mut Random) -> Description<f32> {
    let mut description = any_description(random);
    description.solver.solves = 1;
    let sections = description.instrument.sections.iter();
    let softest = sections.map(|s| f64::from(s.bending_stiffness_n_m2)).fold(1.0, f64::min);
    for _ in 0..1 + random.below(MAX_TENDONS) {
        let offset_m = f64::from(description.instrument.outer_radius_m) * random.between(0.2, 0.99);
        let anchor_m = random.sometimes(1e-4, 0.05);
        // At most ten times as stiff as the instrument, because a stiffer one would crush it.
        let balanced_n_per_m = softest / (offset_m * offset_m * random.scale(0.02, 0.2));
        let static_friction = random.sometimes(0.01, 1.0);
        let most_behind_rad = (4.0 / static_friction.max(1e-3)).min(20.0);
        let tendon = DrivenTendon {
            angle_rad: random.between(-3.0, 3.0) as f32,
            offset_m: offset_m as f32,
            anchor_m: anchor_m as f32,
            stiffness_n_per_m: (balanced_n_per_m * random.scale(0.1, 10.0)).clamp(1.0, 1e5) as f32,
            slack_m: random.sometimes(1e-5, 1e-3) as f32,
            static_friction: static_friction as f32,
            sliding_friction: (static_friction * random.between(0.0, 1.0)) as f32,
            bend_behind_rad: (0.99 * most_behind_rad * random.between(0.0, 1.0)) as f32,
        };
        description.tendons.push(tendon).unwrap();
    }
    description
}

/// [`laden`] with shorter links at the tip in half of the cases.
pub fn finer(random: &mut Random) -> Description<f32> {
    let mut description = laden(random);
    let mut own = random.clone();
    if own.below(2) == 0 {
        description.solver.fine_tip_m = own.scale(1e-3, 0.2) as f32;
    }
    description
}

fn any_drag(random: &mut Random) -> Drag<f32> {
    let swift = random.sometimes(1e-3, 100.0);
    Drag {
        at_rest_n_s_per_m2: (random.between(0.0, 1.0) * swift) as f32,
        swift_n_s_per_m2: swift as f32,
        swift_m_per_s: random.scale(1e-3, 10.0) as f32,
    }
}

/// A realistic catheter in a realistic vessel: every number is plausible for a rig file.
pub fn catheter(random: &mut Random) -> Description<f32> {
    let f = |x: f64| x as f32;
    let mut description = any_description(random);
    let bending = random.scale(3e-6, 6e-5);
    let section = Section {
        length_m: 1.0,
        bending_stiffness_n_m2: f(bending),
        torsional_stiffness_n_m2: f(bending * random.between(0.6, 0.9)),
        axial_stiffness_n: f(bending * random.scale(2e6, 6e6)),
        mass_kg_per_m: f(random.scale(1e-3, 4e-3)),
    };
    description.instrument.sections = [section].into_iter().collect();
    for piece in &mut description.instrument.precurve {
        piece.lateral_curvature_per_m = 0.0;
        piece.torsion_per_m = 0.0;
    }
    description.instrument.outer_radius_m = f(random.between(4e-4, 9e-4));
    description.wall = Wall {
        line_stiffness_n_per_m2: f(random.scale(2e5, 4e6)),
        end_stiffness_n_per_m: f(random.scale(5e2, 5e3)),
        tangential_ratio: 3.0,
        friction_coefficient: f(random.between(0.0, 0.7)),
        onset_m: 1e-5,
        damping_s: f(random.between(0.0, 5e-3)),
    };
    description.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    description.solver.predictor_gain = 0.1;
    description.solver.bending_damping_s = 0.0;
    description.solver.drag = Drag {
        at_rest_n_s_per_m2: f(random.between(0.0, 0.4)),
        swift_n_s_per_m2: f(random.between(0.4, 4.0)),
        swift_m_per_s: f(random.scale(0.01, 1.0)),
    };
    description
}

/// Motion of a random drive for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    Rest,
    Cruise,
    /// The feed reverses at full speed.
    Reversal,
    /// The encoder jumps, as with a slipping drive or lost frames.
    Step,
    /// Out of the vessel and in again.
    Withdrawal,
    /// Rotation without feed.
    Turn,
    /// The last bits of the encoder flicker.
    Flicker,
}

/// A random drive, tick by tick.
pub struct Hand {
    random: Random,
    pub phase: Phase,
    phases: &'static [Phase],
    phase_ticks: usize,
    /// Largest feed \[m\] and rotation \[rad\] in a tick.
    fastest: [f64; 2],
    tick: usize,
    insertion_m: f64,
    rotation_rad: f64,
    feed_m: f64,
    spin_rad: f64,
    reach_m: f64,
}

impl Hand {
    /// Up to 200 mm/s and 15 rad/s, with jumps.
    pub fn any(seed: u64, reach_m: f64) -> Self {
        use Phase::*;
        const PHASES: [Phase; 10] =
            [Rest, Cruise, Cruise, Cruise, Reversal, Reversal, Step, Withdrawal, Turn, Flicker];
        Self::new(seed, reach_m, &PHASES, 500, [200e-6, 15e-3])
    }

    /// Motion of an operator: up to 30 mm/s and 3 rad/s.
    pub fn steady(seed: u64, reach_m: f64) -> Self {
        use Phase::*;
        const PHASES: [Phase; 5] = [Rest, Cruise, Cruise, Reversal, Turn];
        Self::new(seed, reach_m, &PHASES, 2000, [30e-6, 3e-3])
    }

    fn new(
        seed: u64,
        reach_m: f64,
        phases: &'static [Phase],
        phase_ticks: usize,
        fastest: [f64; 2],
    ) -> Self {
        Self {
            random: Random::new(!seed),
            phase: Phase::Cruise,
            phases,
            phase_ticks,
            fastest,
            tick: 0,
            insertion_m: 0.0,
            rotation_rad: 0.0,
            feed_m: fastest[0],
            spin_rad: 0.0,
            reach_m,
        }
    }

    fn begin_phase(&mut self) {
        use Phase::*;
        let (random, [feed_m, spin_rad]) = (&mut self.random, self.fastest);
        self.phase = self.phases[random.below(self.phases.len())];
        (self.feed_m, self.spin_rad) = match self.phase {
            Rest | Flicker => (0.0, 0.0),
            Cruise | Step => (
                random.between(-0.5 * feed_m, feed_m),
                random.between(-0.2 * spin_rad, 0.2 * spin_rad),
            ),
            Reversal => (-self.feed_m, -self.spin_rad),
            Withdrawal => (-2.0 * feed_m, 0.0),
            Turn => (0.0, random.between(-spin_rad, spin_rad)),
        };
        if self.phase == Step {
            self.insertion_m += random.between(-3e-3, 3e-3);
            self.rotation_rad += random.between(-0.5, 0.5);
        }
    }

    pub fn next(&mut self) -> Drive<f32> {
        if self.tick > 0 && self.tick.is_multiple_of(self.phase_ticks) {
            self.begin_phase();
        }
        self.tick += 1;
        if self.phase == Phase::Withdrawal && self.insertion_m <= 0.0 {
            self.feed_m = self.fastest[0];
        }
        self.insertion_m = (self.insertion_m + self.feed_m).clamp(0.0, self.reach_m);
        self.rotation_rad += self.spin_rad;
        let flickering = self.phase == Phase::Flicker;
        let flicker_m = if flickering { self.random.between(-2e-7, 2e-7) } else { 0.0 };
        Drive {
            insertion_m: (self.insertion_m + flicker_m).max(0.0) as f32,
            rotation_rad: self.rotation_rad as f32,
        }
    }
}
