//! An importer reads any text or names a line; it never panics.

#[path = "support/damage.rs"]
mod damage;

use cathforce_bus::master::Master;
use cathforce_bus::{Encoder, Insertion, Process, Rotation, Sealer, Status};
use cathforce_recording::import::{
    AtiOptions, AxisMap, ColumnMap, ImportError, ImportedTrial, join, read_ati, read_csv,
};
use cathforce_recording::{BusFrame, Direction, read_candump, write_candump};
use damage::damage;
use rand::{SeedableRng, rngs::StdRng};

const TRIES: usize = 4000;

fn candump() -> Vec<u8> {
    let mut sealer = Sealer::default();
    let frames = (0..40).map(|i| {
        let encoder = Encoder {
            insertion: Insertion::from_m(0.03 + 1e-5 * f64::from(i)),
            rotation: Rotation::from_rad(0.0),
        };
        let frame = sealer.seal(Process::Encoder(encoder), Status::default());
        BusFrame { at_ns: 1_000_000 * i as u64, direction: Direction::ToDevice, frame }
    });
    let mut text = Vec::new();
    write_candump(&frames.collect::<Vec<_>>(), 1_700_000_000_000_000_000, "can0", &mut text)
        .unwrap();
    text
}

fn table(heading: &str) -> Vec<u8> {
    let mut text = format!("{heading}\n");
    for i in 0..40 {
        let x = f64::from(i);
        text += &format!("{:.3},{:.5},{:.4},{x},{:.1},{:.2}\n", 0.004 * x, 0.03, 0.1, -x, 2.0 * x);
    }
    text.into_bytes()
}

/// Tries an importer on damaged texts; returns how many it refused.
fn refused<E: std::fmt::Display>(
    seed: u64,
    text: &[u8],
    import: impl Fn(&[u8]) -> Result<usize, E>,
) -> usize {
    assert!(import(text).is_ok(), "whole, it is taken");
    let mut random = StdRng::seed_from_u64(seed);
    let lines = 2 + text.iter().filter(|b| **b == b'\n').count();
    let mut refused = 0;
    for _ in 0..TRIES {
        let damaged = damage(text, &mut random);
        let most = damaged.iter().filter(|b| matches!(b, b'\n' | b'\r')).count() + lines;
        match import(&damaged) {
            Ok(rows) => assert!(rows <= most, "more rows than lines"),
            Err(error) => {
                let error = error.to_string();
                let number = error.strip_prefix("line ").and_then(|rest| rest.split(':').next());
                let number: usize = number.and_then(|n| n.parse().ok()).expect(&error);
                assert!((1..=most).contains(&number), "{error}");
                assert!(error.contains("fix: "), "{error}");
                refused += 1;
            }
        }
    }
    refused
}

#[test]
fn damaged_candump_logs_are_taken_or_refused_with_a_line() {
    let refused = refused(1, &candump(), |text| {
        read_candump(text, &Master::default()).map(|log| log.frames.len())
    });
    assert!((TRIES / 3..TRIES).contains(&refused), "{refused}");
}

/// Forty frames of ours as each tool would log them.
fn logs() -> [(&'static str, String); 4] {
    let frames = read_candump(&candump()[..], &Master::default()).unwrap().frames;
    let bytes = |frame: &BusFrame, between: &str| {
        frame
            .frame
            .data()
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect::<Vec<_>>()
            .join(between)
    };
    let lines = |line: &dyn Fn(usize, &BusFrame) -> String| {
        frames.iter().enumerate().map(|(i, frame)| line(i, frame)).collect::<String>()
    };
    let asc = lines(&|i, frame| {
        format!(
            "   {}.{:06} 1  {:X}             Rx   d 8 {}\n",
            i / 1000,
            1000 * (i % 1000),
            frame.frame.id(),
            bytes(frame, " ")
        )
    });
    let trc = lines(&|i, frame| {
        format!(
            "{:>6}) {:>9}.0  Rx  {:04X}  8  {}\n",
            i + 1,
            i,
            frame.frame.id(),
            bytes(frame, " ")
        )
    });
    let savvycan = lines(&|i, frame| {
        format!("{},{:08X},false,Rx,0,8,{},\n", 1000 * i, frame.frame.id(), bytes(frame, ","))
    });
    let candump = lines(&|i, frame| {
        format!(" ({i}.000000)  can0  {:03X}   [8]  {}\n", frame.frame.id(), bytes(frame, " "))
    });
    [
        (
            "Vector ASC",
            format!("date Fri Nov 27 10:15:02 am 2026\nbase hex  timestamps absolute\n{asc}"),
        ),
        ("PEAK TRC", format!(";$FILEVERSION=1.1\n;$STARTTIME=46353.5\n{trc}")),
        (
            "a table of SavvyCAN",
            format!("Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n{savvycan}"),
        ),
        ("candump", candump),
    ]
}

#[test]
fn every_tools_log_gives_the_same_frames() {
    let expected = read_candump(&candump()[..], &Master::default()).unwrap();
    let frames = |log: &[BusFrame]| log.iter().map(|frame| frame.frame).collect::<Vec<_>>();
    for (name, text) in logs() {
        let log = read_candump(text.as_bytes(), &Master::default()).unwrap();
        assert_eq!(log.format.map(|format| format.to_string()).as_deref(), Some(name));
        assert_eq!(frames(&log.frames), frames(&expected.frames), "{name}");
        assert_eq!((log.intact, log.broken, log.foreign), (40, 0, 0), "{name}");
    }
}

#[test]
fn damaged_logs_of_other_tools_are_taken_or_refused_with_a_line() {
    for (seed, (name, text)) in (5..).zip(logs()) {
        let refused = refused(seed, text.as_bytes(), |text| {
            read_candump(text, &Master::default()).map(|log| log.frames.len())
        });
        assert!((TRIES / 10..TRIES).contains(&refused), "{name}: {refused}");
    }
}

#[test]
fn damaged_sensor_logs_are_taken_or_refused_with_a_line() {
    let axes = AxisMap::SAME;
    let options =
        AtiOptions { counts_per_n: Some(1e6), axes, tare_s: 0.02, ..AtiOptions::default() };
    let refused = refused(2, &table("Time,Fx,Fy,Fz,Tx,Ty"), |text| {
        let samples = read_ati(text, &options)?.samples;
        assert!(samples.iter().flat_map(|s| s.force_n).all(f64::is_finite));
        Ok::<_, ImportError>(samples.len())
    });
    assert!((TRIES / 3..TRIES).contains(&refused), "{refused}");
}

#[test]
fn damaged_tables_are_taken_or_refused_with_a_line() {
    let maps = [ColumnMap::parse("rotation_rad=angle*0.0174").unwrap()];
    let catheter = |text: &[u8]| match read_csv(text, &maps)?.trial {
        ImportedTrial::Catheter(trial) => Ok::<_, ImportError>(trial),
        ImportedTrial::Drive(..) | ImportedTrial::Transmission(..) => panic!("a catheter's"),
    };
    let motion = catheter(&table("t_s,insertion_m,angle,fx_N,fy_N,fz_N")).unwrap();
    let refused = refused(3, &table("t_s,insertion_m,angle,fx_N,fy_N,fz_N"), |text| {
        let rows = catheter(text)?.rows;
        let forces = rows.iter().filter_map(|row| {
            let force_n = row.force_n?;
            Some(cathforce_recording::import::ForceSample { t_s: row.t_s, force_n })
        });
        let forces = forces.collect::<Vec<_>>();
        let joined = join(&motion, &forces, 0.01);
        assert_eq!(joined.forces + joined.outside + joined.in_gaps, forces.len());
        Ok::<_, ImportError>(rows.len())
    });
    assert!((TRIES / 3..TRIES).contains(&refused), "{refused}");
}
