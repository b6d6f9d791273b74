//! The boards for which there is a firmware, and how each gets it.

/// A board, by the name that its firmware reports.
#[derive(Debug, PartialEq, Eq)]
pub struct Board {
    pub name: &'static str,
    /// How its flash is written; `None` for an emulated board, which boots the file itself.
    pub flash: Option<Flash>,
}

/// What the programs that write flash call a board.
#[derive(Debug, PartialEq, Eq)]
pub struct Flash {
    /// Chip, as `probe-rs chip list` names it.
    pub chip: &'static str,
    /// Configuration file that comes with OpenOCD.
    pub openocd: &'static str,
    /// Whether its debug probe is an ST-Link, which `st-flash` needs.
    pub has_st_link: bool,
}

/// All of them.
pub const BOARDS: [Board; 2] = [
    Board { name: "mps2-an500", flash: None },
    Board {
        name: "nucleo-h743zi2",
        flash: Some(Flash {
            chip: "STM32H743ZITx",
            openocd: "board/st_nucleo_h743zi.cfg",
            has_st_link: true,
        }),
    },
];

/// The board of this name.
pub fn board(name: &str) -> Option<&'static Board> {
    BOARDS.iter().find(|board| board.name == name)
}

/// How a device of this board gets the firmware of this program.
pub fn update(name: &str) -> String {
    match board(name) {
        Some(Board { flash: None, .. }) => {
            "`--link qemu` boots the firmware that was installed with this program".into()
        }
        Some(Board { flash: Some(_), .. }) => {
            format!("`cathforce flash --board {name}` loads the firmware of this program")
        }
        None => format!(
            "this program has no firmware for `{name}`: build it from the same source as the program"
        ),
    }
}
