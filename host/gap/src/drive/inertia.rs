//! The inertia that the data show. If it is far from that of rig.toml, a column has another sign or
//! unit, and every effect would be fitted to that error.

use cathforce_bundle::bundle::Axis as Kind;
use nalgebra::{Matrix4, Vector4};

use crate::rounding::significant;

/// Ratios of the inertia seen to the one stated that no effect makes.
const LEAST: f64 = 0.4;
const MOST: f64 = 2.5;
/// Inertia over the whole command that nothing else on an axis takes up.
const IMPOSSIBLE: f64 = 10.0;
/// Share of the variance that inertia must explain beside friction before it is believed.
const BELIEVED: f64 = 0.05;

const OPPOSITE: &str =
    "the command and the position point in opposite directions: turn the sign of one of them";

/// The units that an axis has, and what its command is not.
fn units(kind: Kind) -> [&'static str; 2] {
    match kind {
        Kind::Linear => [
            "drive_command_N is in newtons, position_m in metres, moving_mass_kg in kilograms",
            "drive_command_N is the force on the moving mass, not a torque, a current or a voltage \
             (motor_current_A and motor_voltage_V are columns of their own); or moving_mass_kg is another",
        ],
        Kind::Rotary => [
            "drive_command_Nm is in newton metres, position_rad in radians, moving_inertia_kg_m2 in kg·m²",
            "drive_command_Nm is the torque at the axis, not that of the motor before the gear, a current or a \
             voltage (motor_current_A and motor_voltage_V are columns of their own); or \
             moving_inertia_kg_m2 is another",
        ],
    }
}

/// What is wrong, if anything: of rows of the command \[N\], the inertial force of the mass that is
/// stated \[N\] and the speed \[m/s\].
///
/// command = ratio · inertial + coulomb · sign(v) + viscous · v + offset
pub fn complaint(
    rows: impl Iterator<Item = (f64, f64, f64)>,
    stated: f64,
    kind: Kind,
) -> Option<String> {
    let [in_units, no_force] = units(kind);
    let unit = if kind == Kind::Linear { "kg" } else { "kg·m²" };
    let rows: Vec<(f64, f64, f64)> = rows.collect();
    let fastest = rows.iter().map(|(.., v)| v.abs()).fold(0.0, f64::max);
    if rows.is_empty() || fastest <= 0.0 {
        return None;
    }
    // A trial without inertia says nothing of it, but still of friction.
    let size = rows.iter().map(|(_, f, _)| f * f).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    let regressors = |&(_, inertial, v): &(f64, f64, f64)| {
        let sign = if v.abs() < 0.01 * fastest { 0.0 } else { v.signum() };
        Vector4::new(inertial / size, sign, v / fastest, 1.0)
    };
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for row in &rows {
        let x = regressors(row);
        normal += x * x.transpose();
        right += x * row.0;
    }
    if size <= f64::MIN_POSITIVE {
        normal[(0, 0)] = 1.0;
    }
    let solved = normal.cholesky()?.solve(&right);
    // What inertia explains that friction does not.
    let inverse = normal.try_inverse()?;
    let explained = solved[0] * solved[0] / inverse[(0, 0)];
    let mean = rows.iter().map(|(y, ..)| y).sum::<f64>() / rows.len() as f64;
    let power = rows.iter().map(|(y, ..)| (y - mean).powi(2)).sum::<f64>();
    let ratio = solved[0] / size;
    let is_believed = explained >= BELIEVED * power;
    if let Some(driven) =
        driving(&rows, &solved, size, fastest).filter(|_| !(is_believed && ratio < 0.0))
    {
        return Some(driven);
    }
    if !is_believed || (LEAST..=MOST).contains(&ratio) {
        let commanded = rows.iter().map(|(y, ..)| y * y).sum::<f64>().sqrt();
        return (size > IMPOSSIBLE * commanded).then(|| {
            format!(
                "the motion as it was recorded takes {:.1e} times the force that was commanded, so no \
                 effect is named: columns are swapped, or of another unit, or rows of the position were \
                 misread; {in_units}",
                size / commanded
            )
        });
    }
    let seen = ratio * stated;
    let mut slips = [1e-6, 1e-3, 1e3, 1e6].into_iter();
    let slip = slips.find(|k| (0.5..2.0).contains(&(ratio.abs() / k)));
    let why = match slip {
        _ if (-MOST..=-LEAST).contains(&ratio) => OPPOSITE.to_owned(),
        Some(k) => format!("that is about {k:e} times as much, a slip of units: {in_units}"),
        None => no_force.to_owned(),
    };
    Some(format!(
        "the command accelerates {} {unit} where rig.toml states {} {unit}, so no effect is named; {why}",
        significant(seen, 4),
        significant(stated, 4)
    ))
}

/// Friction takes power from a motion. Where what is left of the command beside inertia and a constant force
/// gives it power instead, a sign is turned. A motion in one direction alone says nothing: there a weight that
/// goes down gives power as well.
fn driving(
    rows: &[(f64, f64, f64)],
    solved: &Vector4<f64>,
    size: f64,
    fastest: f64,
) -> Option<String> {
    let (mut taken, mut whole, mut forth, mut back) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for (command, inertial, v) in rows {
        let left = command - solved[0] * inertial / size - solved[3];
        taken += left * v;
        whole += (command * v).abs();
        if *v > 0.01 * fastest {
            forth += v
        } else if *v < -0.01 * fastest {
            back -= v
        }
    }
    let is_both_ways = forth.min(back) > BOTH_WAYS * forth.max(back);
    (is_both_ways && taken < -DRIVEN * whole).then(|| {
        format!(
            "friction would drive the motion instead of braking it: beside inertia and a constant force, the \
             command gives {:.0} % of its power to a motion against it, so no effect is named; the sign of \
             the command or of the position is turned, or the column is the force of the load and not that of \
             the drive",
            -100.0 * taken / whole
        )
    })
}

/// Share of the command's power that friction gives, above which its sign is turned: a delay of 20 ms gives 15 %
/// at 1 Hz.
const DRIVEN: f64 = 0.3;
/// Way in the rarer direction, as a share of that in the other.
const BOTH_WAYS: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    /// A drive of 20 kg with friction, whose command is `scale` times as large.
    fn rows(scale: f64) -> impl Iterator<Item = (f64, f64, f64)> {
        (0..2000).map(move |i| {
            let t = f64::from(i) * 1e-3;
            let (v, a) = (0.3 * (5.0 * t).sin(), 1.5 * (5.0 * t).cos());
            (scale * (20.0 * a + 9.0 * v.signum() + 30.0 * v - 2.0), 20.0 * a, v)
        })
    }

    #[test]
    fn signs_and_units_are_told_by_the_inertia() {
        for good in [1.0, 0.8, 1.3] {
            assert_eq!(complaint(rows(good), 20.0, Kind::Linear), None, "{good}");
        }
        for (scale, word) in
            [(-1.0, "opposite"), (1e3, "newtons"), (1e-3, "newtons"), (0.02, "torque")]
        {
            let said = complaint(rows(scale), 20.0, Kind::Linear).expect("a complaint");
            assert!(said.contains(word), "{scale}: {said}");
        }
    }
}
