//! A bench that is wired wrongly, or not there, is refused with a sentence that helps; and what needs the
//! emulator does not pass on a bench.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cathforce_hil_tests::places::{PLACES, table};
use cathforce_hil_tests::real_board::{
    BOARD, LINK, PROBE, PROBE_RS, RIG, RealBoard, VirtualBoard, Wiring,
};

fn wiring(set: &[(&str, &str)]) -> Result<Option<Wiring>, String> {
    Wiring::from_variables(|name| {
        set.iter().find(|(of, _)| *of == name).map(|(_, value)| OsString::from(value))
    })
}

#[track_caller]
fn assert_refused<T>(result: Result<T, String>, words: &[&str]) {
    let why = result.err().expect("refused");
    for word in words.iter().chain(&["fix:"]) {
        assert!(why.contains(word), "`{word}` in: {why}");
    }
}

#[test]
fn variables_choose_the_rig_and_wrong_ones_are_named() {
    assert_eq!(wiring(&[]), Ok(None));
    assert_eq!(wiring(&[(RIG, "qemu"), (LINK, "socketcan:can0")]), Ok(None));
    let bench = (RIG, "bench");
    let can = (LINK, "socketcan:can0");
    let chosen = wiring(&[bench, can, (PROBE, "0483:374e:0012")]).expect("right").expect("a bench");
    let expected = Wiring {
        link: "socketcan:can0".into(),
        board: "nucleo-h743zi2".into(),
        chip: "STM32H743ZITx".into(),
        probe: Some("0483:374e:0012".into()),
        probe_rs: "probe-rs".into(),
    };
    assert_eq!(chosen, expected);
    assert_refused(wiring(&[(RIG, "board")]), &["CATHFORCE_RIG=board", "bench"]);
    assert_refused(wiring(&[bench]), &[LINK, "socketcan:can0", "cathforce doctor"]);
    assert_refused(wiring(&[bench, (LINK, "")]), &[LINK]);
    for link in ["sim", "qemu", "qemu:a.elf"] {
        assert_refused(wiring(&[bench, (LINK, link)]), &[link, "no real board"]);
    }
    for board in ["mps2-an500", "other"] {
        assert_refused(wiring(&[bench, can, (BOARD, board)]), &[board, "nucleo-h743zi2"]);
    }
}

#[test]
fn what_is_missing_on_the_bench_is_said() {
    let board = VirtualBoard::start();
    let right = board.wiring();
    let start = |wiring| RealBoard::start(wiring);

    // No kernel has an interface of this name, which is too long for one.
    let link = "socketcan:no-such-interface".to_owned();
    let why = start(Wiring { link, ..right.clone() }).err().expect("refused");
    assert!(why.contains("no-such-interface") || why.contains("CAN"), "{why}");
    assert_eq!(board.probed(), "", "nothing is reset before there is a link");

    let probe_rs = PathBuf::from("/no/such/probe-rs");
    let no_program = start(Wiring { probe_rs, ..right.clone() });
    assert_refused(no_program, &["/no/such/probe-rs", "cargo install probe-rs-tools", PROBE_RS]);

    let no_probe = start(Wiring { probe_rs: "/bin/false".into(), ..right.clone() });
    assert_refused(no_probe, &["was not reset", "debug probe", PROBE]);

    let other = start(Wiring { board: "nucleo-h743zi2".into(), ..right.clone() });
    assert_refused(other, &["sim", "nucleo-h743zi2", BOARD]);

    let probe = Some("0483:374e".to_owned());
    assert!(start(Wiring { probe, ..right }).is_ok());
    let log = board.probed();
    assert_eq!(log.lines().last(), Some("reset --chip SIM --probe 0483:374e"));
}

/// A binary of this package's tests, beside this one.
fn tests(name: &str) -> PathBuf {
    let this = std::env::current_exe().expect("a test has a path");
    let begins = format!("{name}-");
    let files = this.parent().expect("a folder").read_dir().expect("it is there");
    let is_it = |path: &Path| {
        let file = path.file_name().and_then(|name| name.to_str());
        file.is_some_and(|file| file.starts_with(&begins)) && path.extension().is_none()
    };
    let found = files.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| is_it(path));
    let age = |path: &PathBuf| path.metadata().and_then(|m| m.modified()).ok();
    found.max_by_key(age).unwrap_or_else(|| panic!("{name} was not built"))
}

fn on_a_bench(program: &str, test: &str) -> Output {
    let mut command = Command::new(tests(program));
    command.args(["--exact", test]).env(RIG, "bench").env(LINK, "socketcan:no-such-interface");
    command.output().expect("it starts")
}

#[test]
fn a_test_that_needs_the_emulator_does_not_pass_on_a_bench() {
    for (program, test) in [
        ("arming", "p18_arming_needs_each_step_on_the_board"),
        ("arming", "p18_at_boot_nothing_is_output_before_it_may_be_in_many_orders"),
        ("crashes", "p12_there_is_no_record_after_switching_on"),
    ] {
        let output = on_a_bench(program, test);
        let said = String::from_utf8_lossy(&output.stderr).into_owned()
            + &String::from_utf8_lossy(&output.stdout);
        assert!(!output.status.success(), "{test} passed on a bench: {said}");
        let refused = format!("NOT RUN on the bench: {test} needs");
        assert!(said.contains(&refused), "{said}");
    }
}

#[test]
fn the_page_has_the_table_of_places() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/how-to/bring-up-a-board.md");
    let text = std::fs::read_to_string(page).expect("the page");
    let (begin, end) = ("<!-- hil-tests/src/places.rs -->\n", "<!-- end -->");
    let (before, rest) = text.split_once(begin).expect("the table's place");
    let (inside, after) = rest.split_once(end).expect("the table's end");
    if std::env::var_os("CATHFORCE_WRITE_PAGES").is_some() {
        let written = format!("{before}{begin}{}{end}{after}", table());
        std::fs::write(page, written).expect("written");
    } else {
        assert_eq!(inside, table(), "CATHFORCE_WRITE_PAGES=1 writes it");
    }
}

/// The table has every promise of the page, once and in order.
#[test]
fn every_promise_has_its_place() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/promises.md");
    let text = std::fs::read_to_string(page).expect("the page");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| P")?.split(' ').next());
    let ids: Vec<_> = rows.map(|rest| format!("P{rest}")).collect();
    assert_eq!(ids, PLACES.map(|(id, _)| id.to_owned()));
}
