//! Repeated runs of one motion, from which the noise floor is estimated.

use super::column::AVERAGE_S;
use super::prepare::Prepared;
use crate::plant::{Repeat, Trial};

/// Two trials are repeats when no encoder position differs by more \[m\], \[rad\]; insertions but for
/// where they begin, which nobody finds again to better than this \[m\].
const SAME_INSERTION_M: f64 = 5e-5;
const SAME_ROTATION_RAD: f64 = 2e-3;
const OFFSET_M: f64 = 5e-4;

/// Trials whose encoders went the same way, channel by channel, in pieces without a gap: around a snap
/// samples may be left out of one of them alone.
pub fn repeats(trials: &[Trial], prepared: &[Prepared]) -> Vec<Repeat> {
    let mut repeats = Vec::new();
    for a in 0..trials.len() {
        for b in a + 1..trials.len() {
            let (first, second) = (&prepared[a].inputs, &prepared[b].inputs);
            let same = is_near(&first.insertion_m, &second.insertion_m, SAME_INSERTION_M, OFFSET_M)
                && is_near(&first.rotation_rad, &second.rotation_rad, SAME_ROTATION_RAD, 0.0);
            let (left, right) = (trials[a].channel_ranges(), trials[b].channel_ranges());
            if !same || left.len() != right.len() {
                continue;
            }
            for (x, y) in left.iter().zip(&right) {
                let (mut i, mut j) = (x.start, y.start);
                let mut piece: Option<Repeat> = None;
                while i < x.end && j < y.end {
                    let apart_s = trials[a].samples[i].t_s - trials[b].samples[j].t_s;
                    if apart_s.abs() >= 0.5 * AVERAGE_S {
                        repeats.extend(piece.take());
                        (i, j) = if apart_s < 0.0 { (i + 1, j) } else { (i, j + 1) };
                        continue;
                    }
                    match &mut piece {
                        Some(own) => own.len += 1,
                        None => piece = Some(Repeat { first: (a, i), second: (b, j), len: 1 }),
                    }
                    (i, j) = (i + 1, j + 1);
                }
                repeats.extend(piece);
            }
        }
    }
    repeats
}

/// Whether two motions differ by no more than `limit`, an offset of up to `offset` apart.
fn is_near(x: &[f64], y: &[f64], limit: f64, offset: f64) -> bool {
    let apart = || x.iter().zip(y).map(|(x, y)| x - y);
    let mean = apart().sum::<f64>() / x.len().min(y.len()).max(1) as f64;
    let mean = mean.clamp(-offset, offset);
    apart().all(|apart| (apart - mean).abs() <= limit)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::bundle::{CatheterTrial, TrialData};
    use cathforce_bundle::{Bundle, Trial as RigTrial};

    use crate::catheter::plant::Catheter;
    use crate::noise::floor::{Floor, FloorSource};
    use crate::plant::Plant;

    fn bundle() -> Bundle {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        Bundle::open(&example).unwrap()
    }

    #[test]
    fn a_motion_that_is_repeated_tells_the_floor_though_a_bias_an_offset_and_a_gap_are_between() {
        let floor_n = |change: &dyn Fn(&mut RigTrial)| {
            let mut bundle = bundle();
            let mut again = bundle.trials[0].clone();
            again.number = 9;
            change(&mut again);
            bundle.trials.push(again);
            let catheter = Catheter::new(&bundle).unwrap();
            let at = catheter.channels().iter().position(|own| own.name == "fx_N").unwrap();
            let floor = Floor::of(&catheter).channels[at];
            (floor.source, floor.sd)
        };
        let data = |trial: &mut RigTrial, of: &dyn Fn(usize, &mut CatheterTrial)| {
            let TrialData::Catheter(data) = &mut trial.data else { panic!("of a catheter") };
            (0..trial.t_s.len()).for_each(|row| of(row, data));
        };
        let shake = |row: usize, data: &mut CatheterTrial, bias_n: f64| {
            let force = data.force_n.as_mut().unwrap()[row].as_mut().unwrap();
            // Of ten rows alike, so that means over 20 ms keep it.
            force[0] += bias_n + 5e-3 * if (row / 10).is_multiple_of(2) { 1.0 } else { -1.0 };
        };
        let (source, shaken) = floor_n(&|trial| data(trial, &|row, own| shake(row, own, 0.0)));
        assert_eq!(source, FloorSource::Repeats);
        // Half of the mean square of a difference of 5 mN.
        let shaken = shaken.unwrap();
        assert!((2.5e-3..4.5e-3).contains(&shaken), "{shaken}");
        let (source, apart) = floor_n(&|trial| {
            data(trial, &|row, own| {
                shake(row, own, 3e-3);
                own.insertion_m[row] += 2e-4;
                if (700..740).contains(&row) {
                    own.force_n.as_mut().unwrap()[row] = None;
                }
            });
        });
        assert_eq!(source, FloorSource::Repeats);
        assert!((apart.unwrap() / shaken - 1.0).abs() < 0.05, "{apart:?} {shaken}");
        let (source, _) = floor_n(&|trial| data(trial, &|row, own| own.insertion_m[row] *= 1.01));
        assert_eq!(source, FloorSource::Stated);
    }
}
