//! Which promise is shown where: on a real board too, or not, and why not.

/// Where a promise is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On a real board as well, by this test of `on_a_bench`; in the suite it runs on the device named here.
    Bench { test: &'static str, suite: Suite },
    /// It cannot run on a bench, for this reason.
    EmulatorOnly(&'static str),
    /// It is about the host, or about the code as it was built: a board adds nothing.
    NoBoard(&'static str),
}

/// Where the suite runs a test that is made for a real board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suite {
    /// The device's code behind a TCP link, which runs free ([`crate::real_board::VirtualBoard`]).
    Virtual,
    /// The firmware on the emulated board, which can be reset and can save.
    Emulated,
    /// Nowhere: only a board measures what the test is about.
    Nowhere,
}

use Place::{Bench, EmulatorOnly, NoBoard};
use Suite::{Emulated, Nowhere, Virtual};

/// All promises.
#[rustfmt::skip]
pub const PLACES: [(&str, Place); 27] = [
    ("P01", Bench { test: "p01_output_ends_when_samples_stop", suite: Virtual }),
    ("P02", Bench { test: "p02_the_output_keeps_its_limits", suite: Virtual }),
    ("P03", EmulatorOnly("that no bit differs needs two devices in lock step")),
    ("P04", Bench { test: "p04_four_bad_frames_ramp_down", suite: Virtual }),
    ("P05", EmulatorOnly("numbers that are not finite are put into memory, or into the device's code in process")),
    ("P06", EmulatorOnly("a model that fails is put in the place of the real one")),
    ("P07", Bench { test: "p07_three_jumps_ramp_down", suite: Virtual }),
    ("P08", EmulatorOnly("the master and the hand are simulated in lock step")),
    ("P09", Bench { test: "p09_p10_p14_p20_a_full_bus_delays_no_tick", suite: Nowhere }),
    ("P10", Bench { test: "p09_p10_p14_p20_a_full_bus_delays_no_tick", suite: Nowhere }),
    ("P11", EmulatorOnly("tasks are hung by overwriting their code")),
    ("P12", EmulatorOnly("panics and faults are put in by overwriting code")),
    ("P13", NoBoard("read off the linked image")),
    ("P14", Bench { test: "p09_p10_p14_p20_a_full_bus_delays_no_tick", suite: Nowhere }),
    ("P15", Bench { test: "p15_what_was_saved_is_there_after_a_reset", suite: Emulated }),
    ("P16", Bench { test: "p16_a_damaged_image_is_refused", suite: Virtual }),
    ("P17", Bench { test: "p17_an_armed_device_takes_no_image", suite: Virtual }),
    ("P18", Bench { test: "p18_nothing_is_output_before_arming", suite: Virtual }),
    ("P19", EmulatorOnly("bus-off is stated by the emulated controller; on a bench it is a short circuit by hand")),
    ("P20", Bench { test: "p09_p10_p14_p20_a_full_bus_delays_no_tick", suite: Nowhere }),
    ("P21", NoBoard("a device of another version is made in process")),
    ("P22", EmulatorOnly("which tick took which frame is known in lock step only")),
    ("P23", NoBoard("a host is killed; what the board then does is P01")),
    ("P24", NoBoard("about the host's recorder")),
    ("P25", EmulatorOnly("every counter is foreseen tick by tick, in lock step")),
    ("P26", EmulatorOnly("the commanded output is known in process only")),
    ("P27", NoBoard("about the host's mesh")),
];

/// The table of `docs/how-to/bring-up-a-board.md`.
pub fn table() -> String {
    let mut text = String::from(
        "| promise | on a bench | test in `on_a_bench`, or why not | in the suite |\n| --- | --- | --- | --- |\n",
    );
    for (id, place) in PLACES {
        let (bench, what, suite) = match place {
            Bench { test, suite } => {
                let suite = match suite {
                    Virtual => "the device's code behind a TCP link",
                    Emulated => "the emulated board",
                    Nowhere => "not run",
                };
                ("yes", format!("`{test}`"), suite)
            }
            EmulatorOnly(why) => ("cannot", why.to_owned(), "other tests"),
            NoBoard(why) => ("needs no board", why.to_owned(), "other tests"),
        };
        text += &format!("| {id} | {bench} | {what} | {suite} |\n");
    }
    text
}
