//! Malformed bundles are refused with the file, the place, the cause and the fix; implausible ones are
//! warned of.

mod support;

use std::fs;
use std::path::Path;

use cathforce_bundle::geometry::SurfaceModel;
use cathforce_bundle::geometry::{StlCause, read_stl};
use cathforce_bundle::{Bundle, BundleError, Place, Vessel};
use support::{CENTRELINE, RIG, TRIAL, ascii_stl, binary_stl, tube, write_bundle};

/// Opens the small bundle with one of its files replaced.
fn open_with(file: &str, contents: impl AsRef<[u8]>) -> Result<Bundle, BundleError> {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join(file), contents).unwrap();
    Bundle::open(folder.path())
}

/// The refusal of such a bundle: its text, after checking file and place.
fn refusal(file: &str, contents: impl AsRef<[u8]>, place: Place) -> String {
    let error = open_with(file, contents).unwrap_err();
    assert!(error.file.ends_with(Path::new(file)), "{error}");
    assert_eq!(error.place, place, "{error}");
    let text = error.to_string();
    assert!(text.contains("\n  fix: ") && text.contains(file), "{text}");
    text
}

fn line_column(line: usize, column: usize) -> Place {
    Place::LineColumn(line, column)
}

/// A refusal of `rig.toml` after replacing a piece of it, where `at` begins.
fn rig_refusal(old: &str, new: &str, at: &str) -> String {
    assert!(RIG.contains(old), "the test replaces nothing");
    let rig = RIG.replacen(old, new, 1);
    let place = place_of(&rig, at);
    refusal("rig.toml", rig, place)
}

/// Line and column where `part` first begins.
fn place_of(text: &str, part: &str) -> Place {
    for (index, line) in text.lines().enumerate() {
        if let Some(column) = line.find(part) {
            return line_column(index + 1, column + 1);
        }
    }
    panic!("`{part}` is not in the text")
}

fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
}

/// Six slips are six faults, and none of them makes another: one run shows them all.
#[test]
fn everything_that_is_wrong_with_a_rig_is_said_at_once() {
    let mut rig = RIG.to_owned();
    for (old, new) in [
        ("friction_coefficient", "friction_coeficient"),
        ("outer_diameter_m = ", "outer_diameter_m = -"),
        ("poissons_ratio = ", "poissons_ratio = 1"),
        ("force_noise_sd_N = 0.01", "force_noise_sd_N = \"small\""),
        ("name = ", "nam = "),
    ] {
        assert!(rig.contains(old), "{old}");
        rig = rig.replacen(old, new, 1);
    }
    let error = open_with("rig.toml", &rig).unwrap_err();
    let said = error.to_string();
    let places = said.lines().filter(|line| !line.starts_with("  fix: ")).collect::<Vec<_>>();
    assert_eq!(places.len(), 5, "{said}");
    for part in [
        "did you mean `name`?",
        "`instrument.outer_diameter_m` is -",
        "`instrument.poissons_ratio` is 1",
        "did you mean `friction_coefficient`?",
        "`sensor.force_noise_sd_N` is a string",
    ] {
        assert!(said.contains(part), "`{part}` in:\n{said}");
    }
    let line = |text: &&str| text.split(':').nth(1).and_then(|line| line.parse::<usize>().ok());
    let lines = places.iter().map(line).collect::<Option<Vec<_>>>();
    assert!(lines.is_some_and(|lines| lines.is_sorted()), "{said}");
}

#[test]
fn unknown_keys_are_named_with_their_line_and_nearest_neighbour() {
    let says = |old: &str, new: &str, parts: &[&str]| {
        assert_says(&rig_refusal(old, new, new), parts);
    };
    let parts = ["`friction_coeficient`", "[vessel]", "mean `friction_coefficient`?"];
    says("friction_coefficient", "friction_coeficient", &parts);
    says(
        "outer_diameter_m",
        "outer_diameter_mm",
        &["`outer_diameter_mm`", "mean `outer_diameter_m`?"],
    );
    let parts = ["`young_modulus_Pa` in [instrument.sections[0]]", "`youngs_modulus_Pa`"];
    says("youngs_modulus_Pa", "young_modulus_Pa", &parts);
    says("sensor]", "senors]", &["`senors`", "`sensor`"]);
    says(
        "force_noise_sd_N = 0.01",
        "whatever = 1",
        &["`whatever` in [sensor]", "take the key out"],
    );
}

#[test]
fn a_misspelt_plant_is_blamed_and_not_the_keys_that_only_it_has() {
    let rig = "format = \"trial-bundle/1\"\nname = \"axis\"\nplant = \"drives\"\n\n[drive]\n\
               moving_mass_kg = 95.1\n";
    let says = refusal("rig.toml", rig, place_of(rig, "\"drives\""));
    assert_says(&says, &["`plant` is \"drives\"", "\"catheter\", \"drive\" and \"transmission\""]);
}

/// A table of the other plant is not reported as a misspelt key.
#[test]
fn a_plant_that_was_not_said_is_asked_for() {
    const AXIS: &str =
        "format = \"trial-bundle/1\"\nname = \"axis\"\n\n[drive]\nmoving_mass_kg = 95.1\n";
    let says = refusal("rig.toml", AXIS, place_of(AXIS, "drive"));
    assert_says(
        &says,
        &["`drive` belongs to a drive", "this rig is a catheter", "write `plant = \"drive\"`"],
    );
    assert!(!says.contains("did you mean"), "{says}");
    let rig = RIG.replacen("name =", "plant = \"drive\"\nname =", 1);
    let says = refusal("rig.toml", &rig, place_of(&rig, "instrument]"));
    assert_says(
        &says,
        &["`instrument` belongs to a catheter", "this rig is a drive", "plant = \"catheter\""],
    );
}

/// A key of a later format is not reported as a misspelt key.
#[test]
fn another_format_is_said_before_its_keys() {
    let rig = RIG.replacen("trial-bundle/1", "trial-bundle/2", 1) + "\n[robot]\narm = 6\n";
    let says = refusal("rig.toml", &rig, place_of(&rig, "\"trial-bundle/2"));
    assert_says(&says, &["`format` is \"trial-bundle/2\"", "the cathforce that reads this format"]);
}

#[test]
fn a_fluids_numbers_need_a_fluid_and_one_name_each() {
    for key in ["fluid_density_kg_per_m3", "density_kg_per_m3", "viscosity_Pa_s"] {
        for none in ["fluid = \"none\"\n", ""] {
            let at = format!("{key} = 1070.5");
            let new = format!("{none}{at}\n");
            let parts =
                [&format!("`environment.{key}` is given")[..], "no fluid", "fluid = \"water\""];
            assert_says(&rig_refusal("fluid = \"none\"\n", &new, "1070.5"), &parts);
        }
    }
    let both = "fluid = \"blood\"\nfluid_density_kg_per_m3 = 1070.0\ndensity_kg_per_m3 = 1071.0";
    let says = rig_refusal("fluid = \"none\"", both, "1071.0");
    assert_says(&says, &["`environment.density_kg_per_m3`", "`fluid_density_kg_per_m3`, too"]);
}

#[test]
fn missing_and_ill_typed_keys_are_named_with_their_line() {
    let says = |old: &str, new: &str, at: &str, parts: &[&str]| {
        assert_says(&rig_refusal(old, new, at), parts);
    };
    let parts = ["`instrument.poissons_ratio` is missing", "add `poissons_ratio = …`"];
    says("poissons_ratio = 0.4\n", "", "[instrument]", &parts);
    let parts = ["`vessel.wall_stiffness_N_per_m` is a string", "a number"];
    says("4000.0", "\"hard\"", "\"hard\"", &parts);
    says("direction = [1.0, 0.0, 0.0]", "direction = [1.0, 0]", "[1.0, 0]", &["2 entries", "3"]);
    says("fluid = \"none\"", "fluid = \"oil\"", "\"oil\"", &["\"oil\"", "blood"]);
    says("trial-bundle/1", "trial-bundle/2", "\"trial-bundle/2", &["`format`", "trial-bundle/1"]);
    assert_says(&refusal("rig.toml", "a = 1\n[b\n", line_column(2, 3)), &["not TOML", "`]`"]);
    let (environment, rest) = (RIG.find("[environment]").unwrap(), RIG.find("[sensor]").unwrap());
    let rig = [&RIG[..environment], &RIG[rest..]].concat();
    assert_says(&refusal("rig.toml", rig, Place::Whole), &["[environment] is missing"]);
}

#[test]
fn values_that_nothing_can_have_are_refused() {
    for (old, new, at, says) in [
        ("1.65e-3", "nan", "nan", "not a finite number"),
        ("1100.0", "-1100", "-1100", "above 0"),
        ("1.02e-3", "1.7e-3", "1.7e-3", "below the outer diameter"),
        ("poissons_ratio = 0.4", "poissons_ratio = 0.61", "0.61", "0.5"),
        ("up = [0.0, 1.0, 0.0]", "up = [2.0, 0.0, 0.0]", "[2.0", "parallel"),
        ("direction = [1.0, 0.0, 0.0]", "direction = [0.0, 0, 0]", "[0.0, 0, 0]", "no length"),
        ("friction_coefficient = 0.3", "friction_coefficient = 30", "30", "between 0 and 2"),
    ] {
        assert_says(&rig_refusal(old, new, at), &[says]);
    }
    // The array begins at the end of its line.
    let place = line_column(10, 12);
    let shorter = RIG.replacen("length_m = 0.60", "length_m = 0.50", 1);
    assert_says(&refusal("rig.toml", shorter, place), &["0.55 m long together", "0.65"]);
    let thirteen = "  { length_m = 0.05, youngs_modulus_Pa = 26.0e6 },\n".repeat(13);
    let sections = RIG.find("  { length_m = 0.60").unwrap()..RIG.find("]\ntip_precurve").unwrap();
    let mut rig = RIG.to_owned();
    rig.replace_range(sections, &thirteen);
    assert_says(&refusal("rig.toml", rig, place), &["13 entries", "at most 8"]);
}

#[test]
fn slips_of_a_thousand_are_warned_of() {
    for (old, new, says) in [
        ("26.0e6", "26.0e9", "thousand times too large"),
        ("26.0e6", "26.0e11", "stiffer than steel"),
        ("26.0e6", "26.25", "softer than rubber"),
        ("1.65e-3", "1.65", "millimetres?"),
        ("1100.0", "1.11", "g/cm³?"),
        (
            "[ { length_m = 0.012, curvature_per_m = 83.0",
            "[ { length_m = 0.012, curvature_per_m = 0.083",
            "per millimetre?",
        ),
        ("[0.0, 0.0, 0.0]", "[12.0, 0.0, 0.0]", "millimetres?"),
        ("4000.0", "4.0", "N/mm?"),
        ("0.005", "5.0", "millimetres?"),
        ("[0.0, 0.0, -9.81]", "[0.0, 0.0, -9810.0]", "not that of the Earth"),
        ("[0.0, 0.0, -9.81]", "[0.0, 0.0, -1.0]", "not that of the Earth"),
        ("0.01\n", "10.5\n", "mN?"),
    ] {
        assert!(RIG.contains(old), "{old}");
        let rig = RIG.replacen(old, new, 1);
        let place = place_of(&rig, new.trim_end());
        let bundle = open_with("rig.toml", rig).unwrap();
        let mut warnings = bundle.warnings.iter();
        let warned = warnings.any(|w| w.message.contains(says) && w.place == place);
        assert!(warned, "{new} at {place:?}: {:?}", bundle.warnings);
    }
    assert_eq!(open_with("rig.toml", RIG).unwrap().warnings, []);
    let wide = CENTRELINE.replace("0.003", "3.0");
    let bundle = open_with("centreline.csv", wide).unwrap();
    assert!(bundle.warnings[0].message.contains("wider than a hand"), "{:?}", bundle.warnings);
}

/// A trial that feeds 13 mm/s, turns a quarter turn in a second, and measures everything; each
/// column times a factor.
fn trial_of(factors: &[(&str, f64)]) -> String {
    const COLUMNS: [&str; 13] = [
        "t_s",
        "insertion_m",
        "rotation_rad",
        "fx_N",
        "fy_N",
        "fz_N",
        "drive_fx_N",
        "tip_x_m",
        "tip_y_m",
        "tip_z_m",
        "p00_x_m",
        "p00_y_m",
        "p00_z_m",
    ];
    let row = |i: i32| {
        let t_s = 0.01 * f64::from(i);
        let (turn, x) = (t_s.min(1.0) * std::f64::consts::FRAC_PI_2, 0.01 + 0.013 * t_s);
        let values = [t_s, x, turn, 0.2, 0.1, -0.1, 0.3, x, 0.004, 0.001, x, 0.004, 0.001];
        let fields = COLUMNS.iter().zip(values).map(|(name, value)| {
            let factor = factors.iter().find(|(own, _)| own == name).map_or(1.0, |(_, k)| *k);
            (factor * value).to_string()
        });
        fields.collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = (0..200).map(row).collect();
    format!("{}\n{}\n", COLUMNS.join(","), rows.join("\n"))
}

#[test]
fn columns_of_another_unit_are_warned_of() {
    let warnings = |factors: &[(&str, f64)]| {
        let bundle = open_with("trials/000.csv", trial_of(factors)).unwrap();
        let of_trial = bundle.warnings.iter().filter(|w| w.file.ends_with("trials/000.csv"));
        of_trial.map(|w| w.message.clone()).collect::<Vec<String>>()
    };
    assert_eq!(warnings(&[]), Vec::<String>::new());
    let degrees = 180.0 / std::f64::consts::PI;
    for (column, factor, says) in [
        ("insertion_m", 1e3, "insertion_m reaches"),
        ("fy_N", 1e3, "would break the phantom"),
        ("drive_fx_N", 1e3, "drive_fx_N reaches 300"),
        ("tip_x_m", 1e3, "the tip is"),
        ("p00_y_m", 1e3, "a point on the shape is 4.0 m away"),
        ("rotation_rad", degrees, "some 14 turns: degrees?"),
        // The rotation is a quarter of a turn, too few degrees to be recognised by their number.
        ("rotation_rad", 0.25 * degrees, "rotation_rad goes by"),
        ("t_s", 1e-3, "insertion_m goes by"),
        ("t_s", 20.0, "the rows are 0.2 s apart by t_s: milliseconds?"),
    ] {
        let found = warnings(&[(column, factor)]);
        assert!(found.iter().any(|w| w.contains(says)), "{column} × {factor}: {found:?}");
    }
}

/// Between rows that are far apart nothing is known of the drive.
#[test]
fn a_hole_between_rows_is_refused_with_its_line() {
    const FILE: &str = "trials/000.csv";
    let hole = |to_s: &str| TRIAL.replacen("0.4,0.016", &format!("{to_s},0.016"), 1);
    assert!(open_with(FILE, hole("0.45")).is_ok());
    for (to_s, says) in [("3.2", "no row for 3.000 s"), ("1000000.2", "no row for 1000000.000 s")] {
        let error = refusal(FILE, hole(to_s), line_column(4, 1));
        assert_says(&error, &[says, "0.25 s apart", "cut the trial in two"]);
    }
    assert_says(
        &refusal(FILE, hole("1e300"), line_column(4, 1)),
        &["beyond the time of any clock"],
    );
}

/// A wrong clock of a sensor faster than 10 kHz shows only by the sensor's rate.
#[test]
fn milliseconds_are_suspected_of_a_fast_sensor_and_of_a_drive() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let warned = |rig: &str, trial: &str| {
        fs::write(folder.path().join("rig.toml"), rig).unwrap();
        fs::write(folder.path().join("trials/000.csv"), trial).unwrap();
        let bundle = Bundle::open(folder.path()).unwrap();
        bundle.warnings.iter().any(|warning| warning.message.contains("milliseconds?"))
    };
    let fast = RIG.to_owned() + "force_rate_hz = 20000.0\n";
    let every = |step_s: f64| {
        let rows = (0..50).map(|i| format!("{},0.01,0\n", step_s * f64::from(i)));
        format!("t_s,insertion_m,rotation_rad\n{}", rows.collect::<String>())
    };
    assert!(warned(&fast, &every(0.05)) && !warned(&fast, &every(5e-5)));
    assert!(!warned(RIG, &every(0.05)) && !warned(RIG, &every(0.1)), "a slow log is none");
    assert!(warned(RIG, &every(0.2)));
    let drive = "format = \"trial-bundle/1\"\nname = \"axis\"\nplant = \"drive\"\n[drive]\n\
                 moving_mass_kg = 95.1\n";
    let rows = (0..50).map(|i| format!("{},0.01,0\n", 0.2 * f64::from(i))).collect::<String>();
    assert!(warned(drive, &format!("t_s,position_m,drive_command_N\n{rows}")));
}

#[test]
fn a_frame_that_is_not_orthonormal_is_put_right_and_said() {
    let rig = RIG
        .replace("direction = [1.0, 0.0, 0.0]", "direction = [2.0, 0.0, 0.0]")
        .replace("up = [0.0, 1.0, 0.0]", "up = [0.1, 1.0, 0.0]");
    let bundle = open_with("rig.toml", rig).unwrap();
    let entry = bundle.catheter().unwrap().entry;
    assert_eq!((entry.direction, entry.up), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
    assert_eq!(bundle.warnings.len(), 3, "{:?}", bundle.warnings);
}

#[test]
fn malformed_trials_are_refused_with_line_and_field() {
    const FILE: &str = "trials/000.csv";
    let with = |old: &str, new: &str, place| {
        assert!(TRIAL.contains(old));
        refusal(FILE, TRIAL.replacen(old, new, 1), place)
    };
    assert_says(&with("0.2,0.012", "0.2,NaN", line_column(3, 2)), &["`NaN`", "insertion_m"]);
    assert_says(&with("0.2,0.012", "0.2,", line_column(3, 2)), &["no value for 0.400 s"]);
    let never = TRIAL.replace("0.010", "").replace("0.012", "").replace("0.016,0.3", ",0.3");
    assert_says(&refusal(FILE, never, line_column(2, 2)), &["no value in this row"]);
    assert_says(&with("0.2,0.012", "0.2,1.2cm", line_column(3, 2)), &["`1.2cm`"]);
    assert_says(&with("0.2,0.012", "0.2,-0.012", line_column(3, 2)), &["negative"]);
    assert_says(&with("0.4,0.016", "0.1,0.016", line_column(4, 1)), &["0.1 s after 0.2 s"]);
    assert_says(&with(",,,\n", ",,\n", line_column(3, 9)), &["8 fields", "9"]);
    assert_says(&with("0.01,0.0,-0.01,,,", "0.01,,-0.01,,,", line_column(3, 5)), &["fy_N"]);
    assert_says(&with("tip_y_m", "tip_v_m", line_column(1, 8)), &["`tip_v_m`", "mean `tip_"]);
    assert_says(&with("fy_N", "fx_N", line_column(1, 5)), &["twice"]);
    assert_says(&with("rotation_rad", "p00_x_m", Place::Line(1)), &["`rotation_rad` is missing"]);
    let half = with("0.01,0.0,-0.01,,,", "0.01,0.0,,,,", line_column(3, 6));
    assert_says(
        &half,
        &["`fz_N` has no value in this row, but `fx_N` has", "leave all three empty"],
    );
    let nan = with("0.01,0.0,-0.01,,,", "0.01,NaN,-0.01,,,", line_column(3, 5));
    assert_says(&nan, &["`NaN` in column `fy_N`", "leave the field empty"]);
    let remark = refusal(FILE, format!("# of Monday\n{TRIAL}"), Place::Line(1));
    assert_says(&remark, &["a remark, not the names of the columns", "`#`"]);
    let remark = with("0.2,0.012", "# still\n0.2,0.012", Place::Line(3));
    assert_says(&remark, &["a remark, not a row"]);
    let units = TRIAL.replacen("0.0,0.010", "s,m,rad,N,N,N,m,m,m\n0.0,0.010", 1);
    assert_says(
        &refusal(FILE, units, Place::Line(2)),
        &["words and no number", "take the row out"],
    );
    let tabs = TRIAL.replace(',', "\t");
    assert_says(&refusal(FILE, tabs, Place::Line(1)), &["tabs", "by commas"]);
    assert_says(&refusal(FILE, "", Place::Line(1)), &["empty"]);
    let semicolons = TRIAL.replace(',', ";");
    assert_says(&refusal(FILE, semicolons, Place::Line(1)), &["semicolons", "by commas"]);
    assert_says(&refusal(FILE, TRIAL.lines().next().unwrap(), Place::Whole), &["no rows"]);
    let shape = "t_s,insertion_m,rotation_rad,p01_x_m,p01_y_m,p01_z_m\n0,0,0,0,0,0\n";
    assert_says(&refusal(FILE, shape, Place::Line(1)), &["p00"]);
    assert_says(&refusal("trials/first.csv", TRIAL, Place::Whole), &["numbered"]);
    let twice = open_with("trials/0.csv", TRIAL).unwrap_err().to_string();
    assert!(twice.contains("another file has the number 0 too"), "{twice}");
    let beside = open_with("trials/._000.csv", b"\x00\x05").unwrap();
    assert!(beside.trials.len() == 1 && beside.warnings.len() == 1, "{:?}", beside.warnings);
}

#[test]
fn malformed_centrelines_are_refused_with_line_and_field() {
    const FILE: &str = "centreline.csv";
    let with = |old: &str, new: &str, place| refusal(FILE, CENTRELINE.replacen(old, new, 1), place);
    assert_says(&with("radius_m", "radius_mm", line_column(1, 6)), &["mean `radius_m`?"]);
    assert_says(&with("0.0,0.003\na,0.02", "0.0,-0.003\na,0.02", line_column(3, 6)), &["-0.003"]);
    assert_says(&with("a,0.02", "a,0.005", line_column(4, 2)), &["does not grow"]);
    assert_says(&with("a,0.02", "b,0.02", Place::Whole), &["`b` has 1 station"]);
    assert_says(
        &refusal(FILE, "branch,s_m,x_m,y_m,z_m,radius_m\n", Place::Whole),
        &["no stations"],
    );
}

#[test]
fn a_binary_stl_cut_anywhere_is_refused_with_its_byte() {
    let whole = binary_stl(&tube());
    assert!(read_stl(&whole).is_ok(), "although its header begins with `solid`");
    let triangles = (whole.len() - 84) / 50;
    // Every byte of the header and the first records, then one cut in every kind of place.
    let cuts = (0..84 + 3 * 50).chain((84 + 3 * 50..whole.len()).step_by(997));
    for cut in cuts {
        let (place, cause) = read_stl(&whole[..cut]).unwrap_err();
        match cause {
            StlCause::NoHeader { found } => assert!(found == cut && cut < 84),
            StlCause::Truncated { promised, found, triangle, .. } => {
                assert_eq!((promised, found, triangle), (triangles, cut, (cut - 84) / 50));
            }
            // A short piece may pass for the start of an ASCII file.
            StlCause::Syntax { .. } | StlCause::TruncatedAscii { .. } => {
                assert!(cut <= 80, "{cause:?} at {cut}");
                continue;
            }
            other => panic!("{other:?} at {cut}"),
        }
        assert_eq!(place, Place::Byte(cut));
    }
    let mut longer = whole.clone();
    longer.push(0);
    assert_eq!(read_stl(&longer).unwrap_err().0, Place::Byte(whole.len()));
    let mut nan = whole.clone();
    nan[84 + 50 * 7 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let expected = (Place::Byte(84 + 50 * 7 + 16), StlCause::NotFinite { triangle: 7 });
    assert_eq!(read_stl(&nan).unwrap_err(), expected);
    assert_eq!(read_stl(&binary_stl(&[])).unwrap_err().1, StlCause::Empty);
}

#[test]
fn an_ascii_stl_is_read_like_a_binary_one_and_refused_when_cut() {
    let surface = &tube()[..20];
    let text = ascii_stl(surface);
    let read = read_stl(text.as_bytes()).unwrap();
    let expected = read_stl(&binary_stl(surface)).unwrap();
    for (a, b) in read.iter().flatten().zip(expected.iter().flatten()) {
        assert!((a - b).norm() < 1e-8);
    }
    // Cut in front of every line but the first.
    let mut at = 0;
    for (index, line) in text.lines().enumerate() {
        if index > 0 {
            let (place, cause) = read_stl(&text.as_bytes()[..at]).unwrap_err();
            assert!(matches!(cause, StlCause::TruncatedAscii { .. }), "{cause:?}");
            assert_eq!(place, Place::Line(index));
        }
        at += line.len() + 1;
    }
    let (place, cause) = read_stl(text.replacen("outer", "inner", 1).as_bytes()).unwrap_err();
    assert_eq!(place, Place::Line(3));
    assert!(matches!(cause, StlCause::Syntax { expected: "outer", .. }));
    let number = text.replacen("vertex ", "vertex x", 1);
    assert!(matches!(read_stl(number.as_bytes()).unwrap_err().1, StlCause::NotANumber(_)));
}

#[test]
fn surfaces_that_are_no_lumen_are_refused() {
    let tube = tube();
    let refused = |triangles: &[_], says: &[&str]| {
        assert_says(&refusal("vessel.stl", binary_stl(triangles), Place::Whole), says);
    };
    refused(&[[tube[0][0]; 3]], &["degenerate"]);
    // As many sheets on each of their edges as one likes.
    let fold = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / 3.0;
        let far = nalgebra::Vector3::new(0.0, turn.cos(), turn.sin()) * 5e-3;
        let along = nalgebra::Vector3::x() * 20e-3;
        [[nalgebra::Vector3::zeros(), along, far], [along, along + far, far]]
    };
    let folds: Vec<_> = (0..3).flat_map(fold).collect();
    refused(
        &folds,
        &["more than two triangles share 1 edges", "not manifold", "(10.000, 0.000, 0.000)"],
    );

    // Faults that show only with the entry.
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let vessel = |x: f64| {
        let moved: Vec<_> =
            tube.iter().map(|t| t.map(|p| p + nalgebra::Vector3::x() * x)).collect();
        fs::write(folder.path().join("vessel.stl"), binary_stl(&moved)).unwrap();
        let bundle = Bundle::open(folder.path()).unwrap();
        Vessel::from_bundle(&bundle, SurfaceModel::Faceted).err().map(|error| error.to_string())
    };
    assert_eq!(vessel(0.0), None);
    assert_says(&vessel(0.3).unwrap(), &["vessel.stl", "from the wall", "millimetres"]);
    // Cut away up to 50 mm past the entry.
    assert_says(&vessel(0.05).unwrap(), &["no opening near the entry", "50.1 mm away"]);
}

#[test]
fn a_vessel_too_narrow_for_its_instrument_is_refused() {
    let narrow = CENTRELINE.replace("0.003", "0.0003");
    let bundle = open_with("centreline.csv", narrow).unwrap();
    let error = Vessel::from_bundle(&bundle, SurfaceModel::Smooth).err().unwrap().to_string();
    assert_says(&error, &["centreline.csv", "0.30 mm from the axis", "0.82 mm", "cannot enter"]);
}

#[test]
fn a_vessel_without_an_opening_at_the_entry_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let sphere =
        support::triangulate(support::Point::new(-6.3e-3, -6.3e-3, -6.3e-3), 1e-3, [13; 3], |p| {
            5e-3 - p.norm()
        });
    fs::write(folder.path().join("vessel.stl"), binary_stl(&sphere)).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    let Err(error) = Vessel::from_bundle(&bundle, SurfaceModel::Faceted) else {
        panic!("a closed sphere lets nothing in")
    };
    assert_says(&error.to_string(), &["no opening near the entry", "cut the vessel open"]);
}

#[test]
fn an_entry_that_leads_out_of_the_vessel_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let turned = RIG.replace("direction = [1.0, 0.0, 0.0]", "direction = [-1.0, 0.0, 0.0]");
    assert_ne!(turned, RIG);
    for vessel in ["centreline.csv", "vessel.stl"] {
        if vessel == "vessel.stl" {
            fs::write(folder.path().join(vessel), binary_stl(&tube())).unwrap();
        }
        let from = |rig: &str| {
            fs::write(folder.path().join("rig.toml"), rig).unwrap();
            Vessel::from_bundle(&Bundle::open(folder.path()).unwrap(), SurfaceModel::Faceted)
        };
        assert!(from(RIG).is_ok(), "{vessel}");
        let Err(error) = from(&turned) else { panic!("{vessel}: nothing is ahead of the entry") };
        assert_says(
            &error.to_string(),
            &[vessel, "leads out", "turn the signs of [entry] direction"],
        );
    }
}

#[test]
fn a_bundle_without_rig_or_vessel_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let error = Bundle::open(folder.path()).unwrap_err();
    assert_says(&error.to_string(), &["rig.toml", "cannot be read", "a bundle is a folder"]);
    write_bundle(folder.path());
    fs::remove_file(folder.path().join("centreline.csv")).unwrap();
    let error = Bundle::open(folder.path()).unwrap_err();
    assert_says(&error.to_string(), &["neither vessel.stl nor centreline.csv"]);
}
