//! Bags of ROS 2 that rosbags has written become trials; what is wrong is named.

use std::path::Path;

use cathforce_recording::import::{
    ColumnMap, ImportedBag, ImportedTrial, RosClock, RosFile, list_ros, read_ros,
};

/// The feed is 1 rad of its motor in 1/(2π) s; each third message is big-endian.
const COLUMNS: [&str; 5] = [
    "insertion_m=/joint_states:feed.motor*0.001",
    "rotation_rad=/joint_states:roll_joint*-1",
    "fx_N=/ft_sensor/wrench:force.x",
    "fy_N=/ft_sensor/wrench:force.y",
    "fz_N=/ft_sensor/wrench:force.z",
];

fn bag(name: &str) -> Vec<u8> {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/bag");
    std::fs::read(seeds.join(name)).unwrap()
}

fn read(bytes: Vec<u8>, columns: &[&str], clock: RosClock) -> Result<ImportedBag, String> {
    let maps = columns.iter().map(|text| ColumnMap::parse(text).unwrap()).collect::<Vec<_>>();
    let files = [RosFile { name: "bag".into(), bytes }];
    read_ros(&files, &maps, clock).map_err(|error| error.to_string())
}

#[test]
fn both_storages_give_the_trial_that_was_written() {
    let [of_sqlite, of_mcap] = ["rosbags.db3", "rosbags.mcap"]
        .map(|name| read(bag(name), &COLUMNS, RosClock::Stamp).unwrap());
    assert_eq!(of_sqlite.table, of_mcap.table);
    let ImportedTrial::Catheter(trial) = of_mcap.table.trial else { panic!("a catheter's") };
    assert_eq!(trial.rows.len(), 34);
    for row in &trial.rows {
        let feed_m = 1e-3 * std::f64::consts::TAU * row.t_s;
        assert!((row.insertion_m - feed_m).abs() < 1e-9, "{row:?}");
        assert!((row.rotation_rad + 0.5 * row.t_s).abs() < 1e-9, "{row:?}");
    }
    let forces = trial.rows.iter().filter_map(|row| row.force_n.map(|force_n| (row.t_s, force_n)));
    let forces = forces.collect::<Vec<_>>();
    assert_eq!(forces.len(), 21);
    assert!((forces[0].0 - 0.002).abs() < 1e-9 && forces[0].1 == [0.1, -0.2, 0.3], "{forces:?}");
    let said = of_mcap.understood.join("\n");
    for says in
        ["MCAP with 4 topics", "13 messages over 0.120 s, 100.0 Hz", "3.0 ms before", "in ft_link"]
    {
        assert!(said.contains(says), "{says}: {said}");
    }
}

/// By the recorder's clock all is later by the same time, so that nothing moves against the rest.
#[test]
fn the_recorders_clock_is_taken_when_asked_for() {
    let logged = read(bag("rosbags.db3"), &COLUMNS, RosClock::Log).unwrap();
    assert!(logged.understood.iter().any(|line| line.ends_with("timed by the recorder")));
    assert_eq!(logged.table, read(bag("rosbags.db3"), &COLUMNS, RosClock::Stamp).unwrap().table);
}

#[test]
fn the_list_has_what_a_column_is_made_of() {
    for name in ["rosbags.db3", "rosbags.mcap"] {
        let files = [RosFile { name: name.into(), bytes: bag(name) }];
        let (topics, remarks) = list_ros(&files).unwrap();
        assert!(remarks.is_empty(), "{remarks:?}");
        let signals = topics.iter().flat_map(|topic| topic.signals.clone()).collect::<Vec<_>>();
        for signal in
            ["/joint_states:gripper", "/tf:catheter_tip.x", "/tip:z", "/ft_sensor/wrench:force.y"]
        {
            assert!(signals.iter().any(|known| known == signal), "{signal}: {signals:?}");
        }
    }
}

#[test]
fn names_that_are_not_there_have_their_nearest() {
    let refused = |column: &str| {
        let error = read(
            bag("rosbags.mcap"),
            &["insertion_m=1", "rotation_rad=0", column],
            RosClock::Stamp,
        );
        error.unwrap_err()
    };
    for (column, says) in [
        ("fx_N=/ft_sensor/wrenh:force.x", "did you mean `/ft_sensor/wrench`?"),
        ("fx_N=/ft_sensor/wrench:forse.x", "did you mean `force.x`?"),
        ("drive_fx_N=/joint_states:feed_motor", "did you mean `feed.motor`?"),
        ("drive_fx_N=/joint_states:feed.motor.torque", "there is no `feed.motor.torque`"),
        ("tip_x_m=/tf:tip.x", "`catheter_tip.x`"),
        ("tip_x_m=/nothing:x", "the bag has /"),
        ("t_s=/tip:x", "messages have their own time"),
    ] {
        let error = refused(column);
        assert!(error.contains(says) && error.contains("fix:"), "{column}: {error}");
    }
    let missing = read(bag("rosbags.mcap"), &COLUMNS[..1], RosClock::Stamp).unwrap_err();
    assert!(missing.contains("there is no column `rotation_rad`"), "{missing}");
}

#[test]
fn what_is_no_bag_of_ros_2_is_named() {
    let refused = |bytes: Vec<u8>| read(bytes, &COLUMNS, RosClock::Stamp).unwrap_err();
    assert!(refused(b"#ROSBAG V2.0\n".to_vec()).contains("rosbags-convert"));
    assert!(refused(b"t_s,x\n".to_vec()).contains("no bag of ROS 2"));
    let whole = bag("rosbags.db3");
    let cut = refused(whole[..whole.len() / 2].to_vec());
    assert!(cut.contains("is not there: the file was cut short"), "{cut}");
    let other =
        refused(whole.iter().map(|byte| if *byte == b'g' { b'h' } else { *byte }).collect());
    assert!(other.contains("this is no bag") || other.contains("no topic"), "{other}");
}

/// A bag whose recorder was killed is read as far as it goes.
#[test]
fn a_cut_mcap_is_read_to_where_it_breaks_off() {
    let whole = bag("rosbags.mcap");
    let mut taken = 0;
    for end in (0..whole.len()).step_by(97) {
        let Ok(bag) = read(whole[..end].to_vec(), &COLUMNS, RosClock::Stamp) else { continue };
        assert!(bag.table.remarks[0].contains("breaks off at byte"), "{:?}", bag.table.remarks);
        taken += 1;
    }
    assert!(taken > 0, "a cut behind the first chunk leaves messages");
}
