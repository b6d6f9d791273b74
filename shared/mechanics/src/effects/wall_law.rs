//! Laws of wall and friction beyond the nominal ones.     docs/explanation/model.md (38)–(42)

use cathforce_scalar::Vector3;

use super::{Effects, Hyperelastic, LoadFriction, Narrowing, Stribeck};
use crate::Real;
use crate::math::maximum;

/// Smallest stretch at which the law of a compressed wall is evaluated \[1\]. Single precision may
/// require a larger one, see [`least_stretch`].
const LEAST_STRETCH: f64 = 0.2;
/// Largest distance along the normal at which a narrowing acts \[m\], so that it spares other branches.
const FARTHEST_WALL_M: f64 = 0.03;

/// The laws of wall and friction with the constants of one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallLaw<T: Real> {
    hyperelastic: Hyperelastic<T>,
    least_stretch: T,
    /// Relaxing over lasting stiffness \[1\].
    relaxing: T,
    /// Share of its deviation that the relaxing part loses in a step \[1\].
    relaxed_share: T,
    narrowing: Narrowing<T>,
    load: LoadFriction<T>,
    /// Factor on the friction coefficient by wear and speed \[1\].
    friction: T,
}

impl<T: Real> WallLaw<T> {
    /// `path_m`: accumulated feed in both directions; `speed_m_per_s`: of the drive.
    pub fn new(
        effects: &Effects<T>,
        least_stretch: T,
        path_m: T,
        speed_m_per_s: T,
        dt_s: T,
    ) -> Self {
        let load = effects.contact.load_friction;
        let steps = dt_s / effects.wall.viscoelastic.time_s;
        let worn = path_m / (path_m + load.wear_length_m);
        Self {
            hyperelastic: effects.wall.hyperelastic,
            least_stretch,
            relaxing: effects.wall.viscoelastic.ratio,
            relaxed_share: steps / (T::one() + steps),
            narrowing: effects.wall.narrowing,
            load,
            friction: (T::one() + (load.worn_ratio - T::one()) * worn)
                * speed_factor(&effects.contact.stribeck, speed_m_per_s),
        }
    }

    /// Distance \[m\] and normal of the wall with the narrowing.     docs/explanation/model.md (38)
    pub fn narrowed(
        &self,
        position: &Vector3<T>,
        distance_m: T,
        normal: Vector3<T>,
    ) -> (T, Vector3<T>) {
        let n = &self.narrowing;
        let from_middle = *position - Vector3::new(n.x_m, n.y_m, n.z_m);
        let outwards = normal.dot(&from_middle);
        // The part along the vessel, because the wall's normal points at the centre line.
        let along = from_middle - normal * outwards;
        let scale = T::one() / (n.half_length_m * n.half_length_m);
        let rest = T::one() - along.dot(&along) * scale;
        let reach = T::lit(FARTHEST_WALL_M);
        if rest <= T::zero() || outwards > reach || outwards < -reach {
            return (distance_m, normal);
        }
        let slope = T::lit(4.0) * n.depth_m * rest * scale;
        let tilted = normal + along * slope;
        let length = maximum(tilted.dot(&tilted).root(), T::lit(1e-3));
        (distance_m - n.depth_m * rest * rest, tilted * (T::one() / length))
    }

    /// Response of the wall to an indentation \[m\] with the derivative `slope` \[1\]. Arguments and results
    /// as those of `Law::indentation_response`.
    #[inline(always)]
    pub fn elastic_response(&self, indented: T, slope: T, relaxed: T) -> (T, T, T) {
        if slope <= T::zero() {
            // Without contact the wall is relaxed.
            return (T::zero(), T::zero(), T::zero());
        }
        let (lasting, lasting_slope) = self.hyperelastic_response(indented, slope);
        let (capstan_factor, fading_slope, relaxed) =
            self.viscoelastic_response(indented, slope, relaxed);
        let force = lasting + capstan_factor;
        if force > T::zero() {
            (force, lasting_slope + fading_slope, relaxed)
        } else {
            // The instrument retreats faster than the wall recovers; the wall cannot pull.
            (T::zero(), T::zero(), relaxed)
        }
    }

    /// Hyperelastic force over stiffness \[m\], and its derivative \[1\].     docs/explanation/model.md (39)
    fn hyperelastic_response(&self, indented: T, slope: T) -> (T, T) {
        let Hyperelastic { strain_per_m, .. } = self.hyperelastic;
        let stretch = maximum(T::one() - strain_per_m * indented, self.least_stretch);
        let (ratio, mooney, growth) = compression_factors(&self.hyperelastic, stretch);
        // Beyond the smallest stretch the law is continued linearly.
        let strain = T::one() - stretch;
        let within = if stretch > self.least_stretch { indented } else { strain / strain_per_m };
        (within * ratio * mooney + (indented - within) * growth, slope * growth)
    }

    /// Force of the relaxing part over the lasting stiffness \[m\], its derivative \[1\], and the new relaxed
    /// indentation \[m\].     docs/explanation/model.md (40)
    fn viscoelastic_response(&self, indented: T, slope: T, relaxed: T) -> (T, T, T) {
        let relaxed = relaxed + (indented - relaxed) * self.relaxed_share;
        let slope = slope * self.relaxing * (T::one() - self.relaxed_share);
        ((indented - relaxed) * self.relaxing, slope, relaxed)
    }

    /// Friction coefficient of a sample over the nominal one \[1\].     docs/explanation/model.md (42)
    ///
    /// `normal_n`: normal force in the last solve \[N\]; `arc_m`: tributary length \[m\].
    pub fn friction(&self, normal_n: T, arc_m: T) -> T {
        let LoadFriction { light_load_ratio: light, high_load_ratio: high, .. } = self.load;
        let half_way_n = self.load.load_n_per_m * arc_m;
        self.friction * ((light * half_way_n + high * normal_n) / (half_way_n + normal_n))
    }
}

/// Factors of a compressed wall at a stretch: stress over strain by neo-Hooke and by Mooney, and the
/// derivative of stress, each over its value without compression.     docs/explanation/model.md (39)
fn compression_factors<T: Real>(hyperelastic: &Hyperelastic<T>, stretch: T) -> (T, T, T) {
    let (one, third) = (T::one(), T::lit(1.0 / 3.0));
    let r = hyperelastic.mooney_share;
    let inverse = one / stretch;
    // (1/λ² − λ)/3 over 1 − λ, without cancellation.
    let ratio = (one + stretch + stretch * stretch) * inverse * inverse * third;
    let mooney = one - r + r * inverse;
    let growth = (T::lit(2.0) * inverse * inverse * inverse + one) * third * mooney
        + (one - stretch) * ratio * r * inverse * inverse;
    (ratio, mooney, growth)
}

/// Smallest stretch at which a compressed wall is at most `most` times as stiff \[1\].
pub(crate) fn least_stretch<T: Real>(hyperelastic: &Hyperelastic<T>, most: T) -> T {
    /// Bisections to the resolution of single precision.
    const HALVINGS: usize = 24;
    let (mut least, mut allowed) = (T::lit(LEAST_STRETCH), T::one());
    if hyperelastic.strain_per_m <= T::zero() || compression_factors(hyperelastic, least).2 <= most
    {
        return least;
    }
    for _ in 0..HALVINGS {
        let middle = (least + allowed) * T::lit(0.5);
        if compression_factors(hyperelastic, middle).2 <= most {
            allowed = middle;
        } else {
            least = middle;
        }
    }
    allowed
}

/// Factor on the friction coefficient by the speed of the drive (Stribeck).
/// docs/explanation/model.md (41)
fn speed_factor<T: Real>(stribeck: &Stribeck<T>, speed_m_per_s: T) -> T {
    let v = speed_m_per_s / stribeck.speed_m_per_s;
    T::one()
        + (stribeck.static_ratio - T::one()) / (T::one() + v * v)
        + stribeck.viscous_s_per_m * speed_m_per_s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(change: impl Fn(&mut Effects<f64>)) -> WallLaw<f64> {
        law_at(0.0, change)
    }

    fn law_at(speed_m_per_s: f64, change: impl Fn(&mut Effects<f64>)) -> WallLaw<f64> {
        let mut effects = Effects::off();
        change(&mut effects);
        WallLaw::new(&effects, LEAST_STRETCH, 0.2, speed_m_per_s, 1e-3)
    }

    #[test]
    fn off_changes_nothing() {
        let off = law(|_| ());
        assert_eq!(off.hyperelastic_response(1e-4, 0.7), (1e-4, 0.7));
        assert_eq!(off.viscoelastic_response(1e-4, 0.7, 0.0).0, 0.0);
        assert_eq!(off.friction(0.1, 5e-3), 1.0);
        let n = Vector3::new(0.0, 1.0, 0.0);
        assert_eq!(off.narrowed(&Vector3::new(0.0, -0.004, 0.001), 1e-3, n), (1e-3, n));
    }

    #[test]
    fn stiffening_is_neo_hookean_and_mooney_rivlin() {
        for (share, c) in [(0.0, 500.0), (0.6, 500.0), (0.3, -400.0)] {
            let law = law(|e| {
                e.wall.hyperelastic.strain_per_m = c;
                e.wall.hyperelastic.mooney_share = share;
            });
            for i in [1e-6, 2e-4, 1e-3] {
                // Uniaxial: σ = 2 (1/λ² − λ)(C10 + C01/λ) in compression, over 6 (C10 + C01).
                let stretch = 1.0 - c * i;
                let stress = (1.0 / (stretch * stretch) - stretch) / 3.0
                    * (1.0 - share + share / stretch)
                    / c;
                let (force, _) = law.hyperelastic_response(i, 1.0);
                assert!((force / stress - 1.0).abs() < 1e-9, "{force} {stress}");
            }
        }
    }

    #[test]
    fn the_slope_is_the_derivative_and_stays_bounded() {
        let law = law(|e| {
            e.wall.hyperelastic.strain_per_m = 2e3;
            e.wall.hyperelastic.mooney_share = 0.5;
        });
        let force = |i: f64| law.hyperelastic_response(i, 1.0).0;
        for i in [1e-5, 1e-4, 3.9e-4, 4.1e-4, 2e-3] {
            let (_, slope) = law.hyperelastic_response(i, 1.0);
            let difference = (force(i + 1e-9) - force(i - 1e-9)) / 2e-9;
            assert!((slope / difference - 1.0).abs() < 1e-4, "{i}: {slope} {difference}");
        }
        assert_eq!(law.hyperelastic_response(1e-3, 1.0).1, law.hyperelastic_response(1.0, 1.0).1);
    }

    #[test]
    fn a_wall_stiffens_no_further_than_it_may() {
        let hyperelastic = Hyperelastic { strain_per_m: 2e3, mooney_share: 0.5 };
        let growth = |stretch| compression_factors(&hyperelastic, stretch).2;
        for most in [1.0, 1.5, 7.0, 40.0] {
            let least = least_stretch(&hyperelastic, most);
            assert!(growth(least) <= most && growth(least - 1e-6) > most, "{most}: {least}");
        }
        assert_eq!(least_stretch(&hyperelastic, 1e4), LEAST_STRETCH);
        // One that softens, or is linear, has no need of it.
        let softening = Hyperelastic { strain_per_m: -2e3, ..hyperelastic };
        assert_eq!(least_stretch(&softening, 1.0), LEAST_STRETCH);
        let mut law = law(|e| e.wall.hyperelastic = hyperelastic);
        law.least_stretch = least_stretch(&hyperelastic, 1.0);
        assert_eq!(law.hyperelastic_response(1e-4, 0.7), (1e-4, 0.7));
    }

    #[test]
    fn the_relaxing_part_fades_with_its_time() {
        let law = law(|e| {
            e.wall.viscoelastic.ratio = 0.5;
            e.wall.viscoelastic.time_s = 0.2;
        });
        let (mut relaxed, mut force) = (0.0, 0.0);
        for _ in 0..200 {
            (force, _, relaxed) = law.viscoelastic_response(1e-4, 1.0, relaxed);
        }
        assert!((force / 0.5e-4 - (-1.0_f64).exp()).abs() < 5e-3, "{force}");
    }

    #[test]
    fn a_wall_does_not_pull_while_it_has_not_come_back() {
        let law = law(|e| {
            e.wall.viscoelastic.ratio = 4.0;
            e.wall.viscoelastic.time_s = 0.2;
        });
        let mut relaxed = 0.0;
        for _ in 0..2000 {
            relaxed = law.elastic_response(1e-3, 1.0, relaxed).2;
        }
        let (force, slope, left) = law.elastic_response(0.5e-3, 1.0, relaxed);
        assert_eq!((force, slope), (0.0, 0.0));
        assert!(left < relaxed && left > 0.99 * relaxed, "{left} {relaxed}");
        // It follows, and is felt again.
        relaxed = left;
        for _ in 0..2000 {
            relaxed = law.elastic_response(0.5e-3, 1.0, relaxed).2;
        }
        let (force, slope, _) = law.elastic_response(0.5e-3, 1.0, relaxed);
        assert!((force / 0.5e-3 - 1.0).abs() < 1e-3 && slope > 1.0, "{force} {slope}");
        assert_eq!(law.elastic_response(0.0, 0.0, relaxed), (0.0, 0.0, 0.0));
    }

    #[test]
    fn friction_falls_with_speed_and_changes_with_load_and_wear() {
        let friction = |normal_n, speed_m_per_s| {
            let law = law_at(speed_m_per_s, |e| {
                e.contact.stribeck.static_ratio = 1.5;
                e.contact.stribeck.speed_m_per_s = 0.01;
                e.contact.load_friction.light_load_ratio = 3.0;
                e.contact.load_friction.high_load_ratio = 0.5;
                e.contact.load_friction.load_n_per_m = 20.0;
                e.contact.load_friction.worn_ratio = 1.4;
                e.contact.load_friction.wear_length_m = 0.2;
            });
            law.friction(normal_n, 5e-3)
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(friction(0.0, 0.0), 1.2 * 1.5 * 3.0);
        near(friction(0.0, 0.01), 1.2 * 1.25 * 3.0);
        near(friction(0.1, 0.0), 1.2 * 1.5 * (3.0 + 0.5) / 2.0);
        near(friction(0.3, 0.0), 1.2 * 1.5 * (3.0 + 0.5 * 3.0) / 4.0);
    }

    #[test]
    fn a_narrowing_is_its_depth_in_the_middle_and_slopes_to_nothing() {
        let law = law(|e| {
            e.wall.narrowing.depth_m = 1e-3;
            e.wall.narrowing.half_length_m = 0.01;
            e.wall.narrowing.x_m = 0.05;
        });
        let n = Vector3::new(0.0, -1.0, 0.0);
        let at = |x: f64| law.narrowed(&Vector3::new(x, 0.004, 0.0), 1e-3, n);
        assert_eq!(at(0.05), (0.0, n));
        assert_eq!(at(0.061), (1e-3, n));
        let (distance, normal) = at(0.045);
        assert!((distance - (1e-3 - 0.75 * 0.75 * 1e-3)).abs() < 1e-12);
        // Going in, the wall pushes back.
        let slope = (at(0.045 + 1e-6).0 - at(0.045 - 1e-6).0) / 2e-6;
        assert!(
            (normal.x() / -normal.y() - slope).abs() < 1e-6 && slope < 0.0,
            "{normal:?} {slope}"
        );
    }
}
