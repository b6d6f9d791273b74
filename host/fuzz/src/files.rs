//! The files that other tools and users give.

use std::path::Path;

use cathforce_bundle::bundle::ColumnMap;
use cathforce_bundle::geometry::{Mesh, read_centreline, read_stl};
use cathforce_bundle::{Bundle, ImageOptions, SolverDefaults, describe, device_image};
use cathforce_bus::Placement;
use cathforce_bus::master::Master;
use cathforce_filter::{Family, Pipeline, Table};
use cathforce_identification::Description;
use cathforce_link::Identity;
use cathforce_mesh_files::{
    Contents, LineOptions, branches, centreline_csv, stl as stl_of, triangles,
};
use cathforce_recording::import::{
    AtiOptions, AxisMap, ImportedTrial, RosClock, RosFile, list_ros, read_ati, read_csv,
    read_motion, read_ros,
};
use cathforce_recording::{Recording, bus_load, decode, read_log, survey};

/// Named in messages.
const NAME: &str = "input";

/// Times do not go back, and every frame that is taken has a direction.
pub fn can_log(data: &[u8]) {
    let Ok(log) = read_log(data, &Master::default(), None, Placement::UNMOVED) else { return };
    let times = log.frames.iter().map(|frame| frame.at_ns);
    assert!(times.is_sorted(), "times go back");
}

/// Samples are finite and in the order of time.
pub fn force_log(data: &[u8]) {
    for counts_per_n in [None, Some(1e6)] {
        let axes = AxisMap::parse("+x,+y,+z").expect("our own");
        for rate_hz in [None, Some(1000.0)] {
            let options =
                AtiOptions { counts_per_n, axes, tare_s: 0.01, rate_hz, ..AtiOptions::default() };
            let Ok(log) = read_ati(data, &options) else { continue };
            assert!(!log.samples.is_empty() && log.samples.is_sorted_by(|a, b| a.t_s <= b.t_s));
            let mut numbers = log.samples.iter().flat_map(|sample| sample.force_n);
            assert!(numbers.all(f64::is_finite));
        }
    }
}

/// What is listed can be asked for, and a trial's rows are finite and in the order of time.
pub fn bag(data: &[u8]) {
    let files = [RosFile { name: NAME.into(), bytes: data.to_vec() }];
    let Ok((topics, _)) = list_ros(&files) else { return };
    assert!(topics.iter().all(|topic| topic.messages > 0 || topic.signals.len() < 64));
    let maps = [
        "insertion_m=/joint_states:feed.motor*0.001+1",
        "rotation_rad=/joint_states:roll_joint",
        "fx_N=/ft_sensor/wrench:force.x",
        "fy_N=/ft_sensor/wrench:force.y",
        "fz_N=/ft_sensor/wrench:force.z",
        "tip_x_m=/tip:x",
        "tip_y_m=/tip:y",
        "tip_z_m=/tf:catheter_tip.z",
    ];
    let maps = maps.map(|map| ColumnMap::parse(map).expect("our own"));
    for clock in [RosClock::Stamp, RosClock::Log] {
        let Ok(bag) = read_ros(&files, &maps, clock) else { continue };
        if let ImportedTrial::Catheter(trial) = bag.table.trial {
            assert!(trial.rows.iter().all(|row| row.insertion_m.is_finite()));
            assert!(trial.rows.is_sorted_by(|a, b| a.t_s < b.t_s), "rows have their order");
        }
    }
}

/// Rows are finite and in the order of time, by the names of a trial or by others.
pub fn table(data: &[u8]) {
    let _ = read_motion(data);
    let maps = ["insertion_m=feed*0.001", "rotation_rad=turn*0.01745", "fx_N=f*1"];
    let maps = maps.map(|map| ColumnMap::parse(map).expect("our own"));
    for maps in [&[][..], &maps] {
        let Ok(table) = read_csv(data, maps) else { continue };
        if let ImportedTrial::Catheter(trial) = table.trial {
            assert!(trial.rows.iter().all(|row| row.t_s.is_finite()));
            assert!(
                trial.rows.is_sorted_by(|a, b| a.t_s < b.t_s),
                "rows of a trial have their order"
            );
        }
    }
}

/// Every column can be filtered by the first, or the reason is said.
pub fn filter(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(mut table) = Table::read(text) else { return };
    let names: Vec<_> = table.names().map(str::to_owned).collect();
    let Some((time, columns)) = names.split_first() else { return };
    let pipeline = Pipeline {
        outlier_rows: 5,
        outlier_sd: 3.0,
        wavelet: Some(Family::Haar),
        levels: None,
        average_s: 0.02,
        causal: false,
        split_at_gaps: true,
    };
    match table.filter(time, columns, &pipeline) {
        Ok(_) => table.write(std::io::sink()).expect("nothing fails there"),
        Err(errors) => errors.iter().for_each(|error| drop(error.to_string())),
    }
}

/// What was read can be written as a file of a bundle, and is read again.
pub fn mesh(data: &[u8]) {
    let Ok(contents) = Contents::read(data) else { return };
    for unit_m in [1.0, 1e-3] {
        let triangles = triangles(&contents, unit_m);
        if !triangles.is_empty() {
            let again = read_stl(&stl_of(&triangles));
            let count = again.map(|read| read.len()).unwrap_or(triangles.len());
            assert_eq!(count, triangles.len());
        }
        let options = LineOptions { unit_m, array: None, radius_m: Some(2e-3) };
        if let Ok((branches, _)) = branches(&contents, &options) {
            let _ = read_centreline(&centreline_csv(&branches));
        }
    }
}

/// Triangles become a mesh, or the reason is said.
pub fn stl(data: &[u8]) {
    let Ok(triangles) = read_stl(data) else { return };
    let _ = Mesh::from_triangles(&triangles);
}

/// Stations are finite.
pub fn centreline(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok((branches, _)) = read_centreline(text) else { return };
    for station in branches.iter().flat_map(|branch| &branch.stations) {
        assert!(station.s_m.is_finite() && station.radius_m > 0.0, "{station:?}");
        assert!(station.position_m.iter().all(|x| x.is_finite()), "{station:?}");
    }
}

/// A lumen that fits a device, or the reason is said.
pub fn lumen(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok((branches, _)) = read_centreline(text) else { return };
    let rig = include_str!("../../../examples/bend-guidewire/rig.toml");
    let mut bundle = Bundle::without_vessel(Path::new(NAME), rig, Vec::new()).expect("our own");
    bundle.centreline = branches;
    let options = ImageOptions { cell_m: 4e-3, ..ImageOptions::default() };
    let _ = device_image(&bundle, &options);
}

/// A rig that is taken can be described to the model.
pub fn rig(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Bundle::without_vessel(Path::new(NAME), text, Vec::new()) {
        Ok(bundle) => {
            if let Some(rig) = bundle.catheter() {
                let _ = describe::<f64>(rig, &SolverDefaults::default(), 5e-3);
            }
        }
        Err(error) => drop(error.to_string()),
    }
}

/// A mapping of columns, and the numbers in it.
pub fn column(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let _ = ColumnMap::parse(text);
    let _ = AxisMap::parse(text);
}

/// What is left of a recording can be decoded.
pub fn recording(data: &[u8]) {
    match Recording::of_bytes(Path::new(NAME), data) {
        Ok(recording) => {
            let _ = survey(&recording);
            let _ = bus_load(&recording.frames);
            let _ = recording.completeness();
            let _ = decode(&recording.frames, Master::default());
        }
        Err(error) => drop(error.to_string()),
    }
}

/// The description of the experiments of a steerable catheter.
pub fn identify(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let _ = Description::parse(NAME, text);
}

/// What a firmware file says of itself.
pub fn firmware(data: &[u8]) {
    let _ = Identity::of_bytes(data);
}
