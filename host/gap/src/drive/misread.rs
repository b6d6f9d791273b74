//! Rows that were misread: a number that jumps away and is back in the next row.
//!
//! A lost frame of an encoder reads 0, and a spike of a converter reads an arbitrary number.
//! Differentiated twice, one such row gives more force than the whole motion. No axis moves there and back
//! within two rows, and no step of a controller ends after one. So the middle row of a second difference d
//! is misread if the differences next to it have half its size and the other sign,
//!
//! > x = …, a, a, a + h, a, a, …   ⇒   d = …, 0, h, −2h, h, 0, …

use cathforce_bundle::bundle::{DriveRig, DriveTrial, Driven, columns};

use super::stamps::evened;
use crate::data::clock::Clock;

/// Second differences of a misread row are this many times what all but a twentieth are at most.
const FAR: f64 = 20.0;
const USUAL: f64 = 0.95;
/// And at least this share of the whole range: the last step of an encoder flickers.
const OF_RANGE: f64 = 0.02;
/// Those next to it, as shares of its own.
const HALF: std::ops::Range<f64> = -0.6..-0.4;

/// A trial without its misread rows, at its true times.
pub struct Rows {
    pub number: u32,
    pub clock: Clock,
    pub data: DriveTrial,
    /// What drives it, in the unit of the axis.
    pub driven: Driven,
    /// Which were left out, in words.
    pub remarks: Vec<String>,
}

impl Rows {
    pub fn of(number: u32, t_s: &[f64], data: &DriveTrial, rig: &DriveRig) -> Self {
        let columns = [
            (columns::of_axis(data.axis)[0], &data.position),
            (columns::of_command(data.kind, data.axis), &data.command),
        ];
        let mut remarks = Vec::new();
        let mut left_out = vec![false; t_s.len()];
        for (name, column) in columns {
            let rows = misread(column);
            let Some(&first) = rows.first() else { continue };
            let count = rows.len();
            let (which, others) = match count {
                1 => ("one row".to_owned(), ""),
                _ => (format!("{count} rows"), ", the first"),
            };
            remarks.push(format!(
                "trial {number:03}: {name} of {which}{others} at {:.3} s ({}), jumps away and is back in \
                 the next: misread, not used",
                t_s[first], column[first]
            ));
            rows.into_iter().for_each(|row| left_out[row] = true);
        }
        let kept: Vec<usize> = (0..t_s.len()).filter(|&row| !left_out[row]).collect();
        let of = |column: &[f64]| kept.iter().map(|&row| column[row]).collect::<Vec<f64>>();
        let setpoint = data.setpoint.as_ref();
        let data = DriveTrial {
            axis: data.axis,
            kind: data.kind,
            position: of(&data.position),
            command: of(&data.command),
            setpoint: setpoint.map(|column| kept.iter().map(|&row| column[row]).collect()),
            load: data.load.as_deref().map(of),
        };
        let driven = rig.driven(number, &data);
        let mut clock = Clock::of(&of(t_s));
        // Where rows were left out or the clock jumps, nobody knows which rows would be even.
        let whole = kept.len() == t_s.len() && clock.jumps.is_empty();
        let evened = whole.then(|| evened(&clock.t_s, &data.position)).flatten();
        if let Some((even_s, scatter_s)) = evened {
            remarks.push(format!(
                "trial {number:03}: the times of the rows tremble by {:.2} ms, but the position is smooth \
                 by even ones: the rows are taken for even",
                1e3 * scatter_s
            ));
            clock.t_s = even_s;
        }
        Self { number, clock, data, driven, remarks }
    }
}

/// Rows whose number is not that of a motion.
pub(crate) fn misread(series: &[f64]) -> Vec<usize> {
    let low = series.iter().copied().fold(f64::INFINITY, f64::min);
    let range = series.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
    let bends: Vec<f64> = series.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect();
    let mut sizes: Vec<f64> = bends.iter().map(|bend| bend.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(usual) = sizes.get((USUAL * sizes.len() as f64) as usize) else { return Vec::new() };
    let least = (FAR * usual).max(OF_RANGE * range);
    let of_one = |w: &[f64]| {
        let is_half = |side: f64| HALF.contains(&(side / w[1]));
        w[1].abs() > least && is_half(w[0]) && is_half(w[2])
    };
    // bends[i] is that of row i + 1.
    (0..).zip(bends.windows(3)).filter(|(_, w)| of_one(w)).map(|(i, _)| i + 2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cathforce_bundle::bundle::{Axis, CommandKind};

    #[test]
    fn a_row_that_jumps_away_and_back_is_misread_and_a_step_is_not() {
        let smooth = |i: usize| 0.1 * (0.01 * i as f64).sin() + 1e-6 * crate::toy::noise(i);
        let rows: Vec<f64> = (0..2000).map(smooth).collect();
        assert!(misread(&rows).is_empty());
        let mut dropped = rows.clone();
        (dropped[700], dropped[1500]) = (0.0, 0.5);
        assert_eq!(misread(&dropped), [700, 1500]);
        let stepped: Vec<f64> =
            rows.iter().enumerate().map(|(i, x)| x + if i < 900 { 0.0 } else { 0.1 }).collect();
        assert!(misread(&stepped).is_empty());
        // Coulomb friction's command: a step at every reversal, for many rows.
        let square: Vec<f64> =
            (0..2000).map(|i| if i / 100 % 2 == 0 { 5.0 } else { -5.0 }).collect();
        assert!(misread(&square).is_empty());
        assert!(misread(&[]).is_empty());
    }

    #[test]
    fn a_misread_row_is_left_out_of_all_columns_and_named() {
        let t_s: Vec<f64> = (0..300).map(|i| 1e-3 * f64::from(i)).collect();
        let mut position_m: Vec<f64> = t_s.iter().map(|t| 0.1 + t * t).collect();
        position_m[100] = 0.0;
        let mut drive_command_n = vec![2.0; 300];
        (drive_command_n[50], drive_command_n[200]) = (1e3, -1e3);
        let setpoint = Some(t_s.iter().map(|t| Some(*t)).collect());
        let data = DriveTrial {
            axis: Axis::Linear,
            kind: CommandKind::Force,
            position: position_m,
            command: drive_command_n,
            setpoint,
            load: None,
        };
        let rig = DriveRig {
            axis: Axis::Linear,
            inertia: 1.0,
            motor: None,
            pendulum: None,
            carried: Vec::new(),
        };
        let rows = Rows::of(7, &t_s, &data, &rig);
        assert_eq!((rows.clock.t_s.len(), rows.data.setpoint.map(|s| s.len())), (297, Some(297)));
        assert!(rows.data.position.iter().all(|&x| x > 0.0));
        assert!(rows.data.command.iter().all(|&f| f == 2.0));
        assert_eq!(
            rows.remarks,
            [
                "trial 007: position_m of one row at 0.100 s (0), jumps away and is back in the \
                 next: misread, not used",
                "trial 007: drive_command_N of 2 rows, the first at 0.050 s (1000), jumps away and \
                 is back in the next: misread, not used"
            ]
        );
    }
}
