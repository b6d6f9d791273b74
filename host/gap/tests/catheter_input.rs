//! Trials that cannot carry a verdict are refused, each with its cause and what to do.

use std::path::Path;
use std::sync::OnceLock;

use cathforce_bundle::bundle::{CatheterTrial, Plant, Trial, TrialData};
use cathforce_bundle::geometry::SurfaceModel;
use cathforce_bundle::lumen::LumenOptions;
use cathforce_bundle::{Bundle, CELL_M, Vessel};
use cathforce_gap::catheter::{Catheter, CatheterError};
use cathforce_gap::plant::Plant as _;
use cathforce_mechanics::LumenHeader;

/// The example's first seconds.
fn example() -> Bundle {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
    let mut bundle = Bundle::open(Path::new(path)).unwrap();
    bundle.trials.truncate(1);
    change(&mut bundle.trials[0], |t_s, data| {
        let rows = t_s.partition_point(|&t| t < 1.0);
        t_s.truncate(rows);
        data.insertion_m.truncate(rows);
        data.rotation_rad.truncate(rows);
        data.force_n.as_mut().unwrap().truncate(rows);
        data.drive_force_n = None;
        data.tip_m.as_mut().unwrap().truncate(rows);
        data.shape_m.clear();
    });
    bundle
}

fn change(trial: &mut Trial, change: impl FnOnce(&mut Vec<f64>, &mut CatheterTrial)) {
    let TrialData::Catheter(data) = &mut trial.data else { panic!("a catheter") };
    change(&mut trial.t_s, data);
}

/// In the example's vessel, which is looked at once.
fn catheter(bundle: &Bundle) -> Result<Catheter, CatheterError> {
    static LUMEN: OnceLock<(LumenHeader, Vec<u8>)> = OnceLock::new();
    let (header, bytes) = LUMEN.get_or_init(|| {
        let bundle = example();
        let vessel = Vessel::from_bundle(&bundle, SurfaceModel::default()).unwrap();
        let radius_m = 0.5 * bundle.catheter().unwrap().instrument.outer_diameter_m;
        let options = LumenOptions::for_instrument(radius_m, CELL_M);
        let (lumen, _) = vessel.lumen(options).unwrap();
        (lumen.header, lumen.bytes)
    });
    Catheter::in_lumen(bundle, *header, bytes.clone())
}

#[track_caller]
fn assert_refused(words: &[&str], damage: impl FnOnce(&mut Vec<f64>, &mut CatheterTrial)) {
    let mut bundle = example();
    change(&mut bundle.trials[0], damage);
    let error = catheter(&bundle).err().expect("refused").to_string();
    for word in words {
        assert!(error.contains(word), "`{word}` in: {error}");
    }
}

#[test]
fn millimetres_of_insertion_are_more_than_the_instrument_has() {
    assert_refused(&["trial 000 inserts", "of an instrument of 0.65 m", "fix:"], |_, data| {
        data.insertion_m.iter_mut().for_each(|x| *x *= 1e3);
    });
}

#[test]
fn milliseconds_leave_the_motion_open() {
    assert_refused(&["a row every 4 s", "fix: give t_s in seconds"], |t_s, _| {
        t_s.iter_mut().for_each(|t| *t = (*t * 1e3).round());
    });
}

#[test]
fn what_no_drive_can_do_is_refused_with_its_time() {
    assert_refused(
        &["trial 000: insertion_m goes by", "at t_s = ", "fix: give t_s in"],
        |t_s, _| {
            t_s.iter_mut().for_each(|t| *t *= 1e-3);
        },
    );
    // A quarter turn in a second.
    assert_refused(&["rotation_rad goes by 90.000 rad/s", "is it in degrees"], |t_s, data| {
        data.rotation_rad.iter_mut().zip(t_s).for_each(|(turned, t)| *turned = 90.0 * *t);
    });
}

#[test]
fn what_the_model_refuses_is_said_with_the_keys_it_comes_from() {
    for factor in [1e-6, 1e6] {
        let mut bundle = example();
        let Plant::Catheter(rig) = &mut bundle.rig.plant else { panic!("a catheter") };
        rig.instrument.sections.iter_mut().for_each(|own| own.youngs_modulus_pa *= factor);
        let error = catheter(&bundle).err().expect("refused").to_string();
        for word in
            ["section.bending_stiffness", "sections[0].youngs_modulus_Pa`", "fix: write about"]
        {
            assert!(error.contains(word), "`{word}` in: {error}");
        }
    }
}

#[test]
fn a_tip_beyond_the_instrument_is_in_another_frame_or_the_insertion_from_elsewhere() {
    assert_refused(&["trial 000", "farther from the entry", "fix:"], |_, data| {
        let first = data.insertion_m[0];
        data.insertion_m.iter_mut().for_each(|x| *x -= first);
    });
    assert_refused(&["farther from the entry", "in metres"], |_, data| {
        for tip in data.tip_m.as_mut().unwrap().iter_mut().flatten() {
            *tip = tip.map(|x| 1e3 * x);
        }
    });
}

#[test]
fn a_drive_that_stands_still_tells_nothing() {
    let still = |_: &mut Vec<f64>, data: &mut CatheterTrial| data.insertion_m.fill(0.028);
    assert_refused(&["neither feeds 3 mm", "fix:"], still);
    // Beside a trial that tells something it is left out, and that is said.
    let mut bundle = example();
    let mut second = Trial { number: 1, ..bundle.trials[0].clone() };
    change(&mut second, still);
    bundle.trials.insert(0, second);
    let catheter = catheter(&bundle).unwrap();
    assert_eq!(catheter.trials().iter().map(|t| t.number).collect::<Vec<_>>(), [0]);
    let said = catheter.remarks().join("\n");
    assert!(said.contains("trial 001: nothing can be compared"), "{said}");
}

#[test]
fn nothing_measured_is_refused() {
    assert_refused(&["no trial measures", "fix:"], |_, data| {
        (data.force_n, data.tip_m) = (None, None);
    });
}

#[test]
fn a_sensor_that_never_changes_is_left_out_and_said_to_be_dead() {
    let mut bundle = example();
    change(&mut bundle.trials[0], |_, data| {
        data.force_n.as_mut().unwrap().iter_mut().for_each(|force| *force = Some([0.01, 0.0, 0.0]));
    });
    let catheter = catheter(&bundle).unwrap();
    assert!(catheter.channels().iter().all(|channel| channel.name.starts_with("tip_")));
    let said = catheter.remarks().join("\n");
    assert!(said.contains("trial 000: the force has the same value in every row"), "{said}");
    assert!(said.contains("no force was measured"), "{said}");
}

#[test]
fn noise_that_is_stated_nowhere_is_said_once_for_all_trials_and_axes() {
    let mut bundle = example();
    let second = Trial { number: 1, ..bundle.trials[0].clone() };
    bundle.trials.push(second);
    bundle.rig.sensor.force_noise_sd_n = None;
    let catheter = catheter(&bundle).unwrap();
    let said = catheter.remarks().iter().filter(|remark| remark.contains("is not stated"));
    let said: Vec<&String> = said.collect();
    assert!(said.len() == 1 && said[0].contains("the noise of fx_N"), "{said:?}");
}

#[test]
fn nuisances_have_the_priors_that_the_rig_states() {
    let mut bundle = example();
    bundle.rig.priors.insertion_offset_sd_m = Some(1e-3);
    let sd = |plant: &Catheter, name: &str| {
        let own = plant.nuisances().iter().find(|nuisance| nuisance.name == name);
        own.expect("a catheter's").sd
    };
    let plant = catheter(&bundle).unwrap();
    assert_eq!(sd(&plant, "insertion offset"), 1e-3);
    assert_eq!(sd(&plant, "nearer wall"), 4e-5, "not stated");
    assert_eq!(sd(&plant, "nearer junctions"), 1e-4, "not stated");
}

#[test]
fn rows_without_a_force_make_no_mean_of_forces_more_certain() {
    let bundle = example();
    let mut denser = example();
    // Every row is followed by three of the encoders alone.
    change(&mut denser.trials[0], |t_s, data| {
        let rows = t_s.len() - 1;
        let between = |column: &[f64]| -> Vec<f64> {
            let at = |k: usize| {
                let (low, share) = (k / 4, (k % 4) as f64 / 4.0);
                column[low] + share * (column[(low + 1).min(rows)] - column[low])
            };
            (0..=4 * rows).map(at).collect()
        };
        let spread = |column: &[Option<[f64; 3]>]| -> Vec<_> {
            (0..=4 * rows).map(|k| column[k / 4].filter(|_| k % 4 == 0)).collect()
        };
        *t_s = between(t_s);
        data.insertion_m = between(&data.insertion_m);
        data.rotation_rad = between(&data.rotation_rad);
        for column in [&mut data.force_n, &mut data.tip_m].into_iter().flatten() {
            *column = spread(column);
        }
    });
    let [all, few] = [bundle, denser].map(|bundle| {
        let samples = catheter(&bundle).unwrap().trials()[0].samples.clone();
        samples.into_iter().map(|s| (s.channel, s.t_s, s.value, s.noise)).collect::<Vec<_>>()
    });
    assert!(all.len() > 100, "{}", all.len());
    assert_eq!(all, few);
}

#[test]
fn a_jump_of_the_clock_is_said_and_nothing_for_half_a_second_after_it_is_compared() {
    let mut bundle = example();
    // All rows after this one are stamped a second later.
    let at_s = 0.4;
    change(&mut bundle.trials[0], |t_s, _| {
        let before = t_s.partition_point(|&t| t <= at_s);
        t_s[before..].iter_mut().for_each(|t| *t += 1.0);
    });
    let plant = catheter(&bundle).unwrap();
    let said = |remark: &String| remark.contains("trial 000: the clock jumps by 1.0");
    assert_eq!(plant.remarks().iter().filter(|remark| said(remark)).count(), 1);
    let times = |plant: &Catheter| -> Vec<f64> {
        plant.trials()[0].samples.iter().map(|sample| sample.t_s).collect()
    };
    let (jumped, even) = (times(&plant), times(&catheter(&example()).unwrap()));
    let (far, near): (Vec<f64>, Vec<f64>) = even.iter().partition(|&&t| t > at_s + 0.5);
    // A mean of forces may reach from before the jump.
    let after: Vec<f64> = jumped.iter().copied().filter(|&t| t > at_s + 0.05).collect();
    assert!(!far.is_empty() && !near.is_empty());
    assert!(after.iter().all(|&t| t > at_s + 1.5), "{after:?}");
    assert!(after.len().abs_diff(far.len()) <= 5, "{} and {}", after.len(), far.len());
}

#[test]
fn a_trial_that_only_turns_is_compared_from_half_a_radian_on() {
    let mut bundle = example();
    change(&mut bundle.trials[0], |t_s, data| {
        data.insertion_m.fill(0.06);
        data.rotation_rad = t_s.iter().map(|t| 2.0 * (t - t_s[0])).collect();
    });
    let samples = catheter(&bundle).unwrap().trials()[0].samples.clone();
    let first_s = samples.iter().map(|sample| sample.t_s).fold(f64::INFINITY, f64::min);
    assert!((0.24..0.3).contains(&first_s), "{first_s}");
}

/// What is said of the example's trial that is turned by −90°, from when it is on, with its rotation times
/// a factor. Turning by as many degrees a second as it does is more than any drive can.
fn complaint_of_rotation_times(factor: f64) -> Option<String> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
    let mut bundle = Bundle::open(Path::new(path)).unwrap();
    bundle.trials.retain(|trial| trial.number == 3);
    change(&mut bundle.trials[0], |t_s, data| {
        let turned = t_s.partition_point(|&t| t < 2.6);
        t_s.drain(..turned);
        data.insertion_m.drain(..turned);
        data.rotation_rad.drain(..turned);
        data.force_n.as_mut().unwrap().drain(..turned);
        data.drive_force_n.as_mut().unwrap().drain(..turned);
        data.tip_m.as_mut().unwrap().drain(..turned);
        data.shape_m.clear();
        data.rotation_rad.iter_mut().for_each(|rad| *rad *= factor);
    });
    catheter(&bundle).unwrap().complaint().map(str::to_owned)
}

#[test]
fn rotations_in_degrees_or_the_other_way_round_carry_no_verdict() {
    let says = |factor: f64| complaint_of_rotation_times(factor).unwrap_or_default();
    let degrees = says(180.0 / std::f64::consts::PI);
    assert!(degrees.contains("looks like degrees") && degrees.contains("in radians"), "{degrees}");
    let back = says(-1.0);
    assert!(back.contains("the other way round") && back.contains("direction × up"), "{back}");
    assert_eq!(complaint_of_rotation_times(1.0), None);
    // A drive that turns a fifth too little is an effect.
    assert_eq!(complaint_of_rotation_times(0.8), None);
}

#[test]
fn rows_exactly_a_tenth_of_a_second_apart_are_often_enough() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/bend-guidewire");
    let bundle = Bundle::open(Path::new(path)).unwrap();
    // This example has no measured column, and that is what the error says.
    let error = Catheter::new(&bundle).err().expect("refused");
    assert!(matches!(error, CatheterError::NothingMeasured), "{error}");
    // Rows a third longer apart are refused.
    assert_refused(&["a row every 0.133 s", "at least 10 rows a second"], |t_s, _| {
        let rows = t_s.len();
        *t_s = (0..rows).map(|row| row as f64 * 0.4 / 3.0).collect();
    });
}
