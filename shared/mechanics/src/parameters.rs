//! Numbers of a description that settings and the diagnosis access by key.

use cathforce_scalar::Real;

use crate::{Description, EFFECTS, ParameterInfo};

/// Numbers of the nominal description that a diagnosis may change, besides the parameters of
/// [`EFFECTS`].
pub const NOMINAL: &[ParameterInfo] = &[
    ParameterInfo {
        key: "wall.friction_coefficient",
        unit: "1",
        off: None,
        min: 0.0,
        max: 2.0,
        whole: false,
        doc: "Coulomb friction coefficient of instrument and wall.",
    },
    tendon("tendon.pull_m", "m", 0.0, 0.05, "How far the tendon is pulled from taut and straight."),
    tendon("tendon.stiffness_n_per_m", "N/m", 0.0, 1e5, "Stiffness of the tendon along itself."),
    tendon("tendon.offset_m", "m", 0.0, 5e-3, "Distance of the tendon from the centre line."),
    tendon("tendon.length_m", "m", 0.0, 1.0, "Length that it bends, from the tip backwards."),
    tendon(
        "tendon.angle_rad",
        "rad",
        -7.0,
        7.0,
        "Where it lies: 0 at `up`, 90° at `direction × up`.",
    ),
];

const fn tendon(
    key: &'static str,
    unit: &'static str,
    min: f64,
    max: f64,
    doc: &'static str,
) -> ParameterInfo {
    ParameterInfo { key, unit, off: Some(0.0), min, max, whole: false, doc }
}

/// Parameters of the solver, which describe no rig and explain no gap.
pub const SOLVER: &[ParameterInfo] = &[SOLVES];

const SOLVES: ParameterInfo = ParameterInfo {
    key: "solver.solves",
    unit: "solves",
    off: Some(1.0),
    min: 1.0,
    max: 2.0,
    whole: true,
    doc: "Of every tick: with two, a pressed tip that is turned comes to rest. Not with a guidewire, nor at a near-rigid wall.",
};

/// All parameters: [`NOMINAL`], those of [`EFFECTS`], [`SOLVER`].
pub fn parameters() -> impl Iterator<Item = &'static ParameterInfo> {
    NOMINAL.iter().chain(EFFECTS.iter().flat_map(|effect| effect.parameters)).chain(SOLVER)
}

/// Why a value of a parameter is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterError {
    /// There is no parameter with this key.
    Unknown,
    /// Not finite, or outside the range of its [`ParameterInfo`].
    Range(&'static ParameterInfo),
    /// The parameter accepts only whole numbers.
    NotWhole(&'static ParameterInfo),
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no parameter of that name"),
            Self::Range(ParameterInfo { key, unit, min, max, .. }) => {
                write!(f, "{key} must be between {min} and {max}")?;
                if *unit == "1" { Ok(()) } else { write!(f, " {unit}") }
            }
            Self::NotWhole(ParameterInfo { key, .. }) => {
                write!(f, "{key} must be a whole number")
            }
        }
    }
}

impl core::error::Error for ParameterError {}

impl<T: Real> Description<T> {
    /// The parameter with this key; `None` if there is none.
    pub fn parameter(&self, key: &str) -> Option<T> {
        if key == SOLVES.key {
            return Some(T::int(i32::from(self.solver.solves)));
        }
        // A copy, so that `find` serves reading and writing.
        let mut copy = (self.effects, self.wall, self.tendon);
        let (effects, wall, tendon) = &mut copy;
        find(effects, wall, tendon, key).copied()
    }

    /// Sets a parameter. On an error nothing changes.
    pub fn set_parameter(&mut self, key: &str, value: T) -> Result<(), ParameterError> {
        let info = parameters().find(|info| info.key == key).ok_or(ParameterError::Unknown)?;
        // In this form, NaN is refused.
        if !(value >= T::lit(info.min) && value <= T::lit(info.max)) {
            return Err(ParameterError::Range(info));
        }
        let whole = value.truncated();
        if info.whole && T::int(whole) != value {
            return Err(ParameterError::NotWhole(info));
        }
        if key == SOLVES.key {
            // In range, so it fits.
            self.solver.solves = whole as u8;
            return Ok(());
        }
        let place = find(&mut self.effects, &mut self.wall, &mut self.tendon, key);
        *place.ok_or(ParameterError::Unknown)? = value;
        Ok(())
    }
}

fn find<'a, T: Real>(
    effects: &'a mut crate::Effects<T>,
    wall: &'a mut crate::Wall<T>,
    tendon: &'a mut crate::Tendon<T>,
    key: &str,
) -> Option<&'a mut T> {
    Some(match key {
        "wall.friction_coefficient" => &mut wall.friction_coefficient,
        "tendon.pull_m" => &mut tendon.pull_m,
        "tendon.stiffness_n_per_m" => &mut tendon.stiffness_n_per_m,
        "tendon.offset_m" => &mut tendon.offset_m,
        "tendon.length_m" => &mut tendon.length_m,
        "tendon.angle_rad" => &mut tendon.angle_rad,
        _ => return effects.parameter_mut(key),
    })
}
