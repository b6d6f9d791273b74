//! Arguments of the commands that come with an installed program: `cathforce demo` and `cathforce flash`.

use std::path::PathBuf;

use cathforce_link::{BOARDS, Board};
use clap::{Args, ValueEnum};

use super::link::address;

#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Folder for the bundle, the recording, CSV and page.
    #[arg(long, value_name = "FOLDER", default_value = "cathforce-demo")]
    pub out: PathBuf,
    /// Write into a folder that is there, and replace what an earlier demo left.
    #[arg(long)]
    pub overwrite: bool,
    /// Device that is inserted; `sim` needs no emulator.
    #[arg(long, value_parser = address, default_value = "qemu")]
    pub link: String,
}

#[derive(Debug, Args)]
pub struct FlashArguments {
    /// Name of the board that is connected.
    #[arg(long, value_name = "NAME", value_parser = board)]
    pub board: &'static Board,
    /// Firmware to load [default: that of the board which was installed with this program]
    #[arg(long, value_name = "FILE.elf")]
    pub firmware: Option<PathBuf>,
    /// Ask the device behind this link first which board it is.
    #[arg(long, value_parser = address)]
    pub link: Option<String>,
    /// Program that writes the flash [default: the first of them that is installed]
    #[arg(long, value_enum, value_name = "NAME")]
    pub programmer: Option<Programmer>,
    /// Check everything, print the commands, and run none of them.
    #[arg(long)]
    pub dry_run: bool,
}

/// A program that writes the flash of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Programmer {
    /// probe-rs, with any probe that it knows.
    #[value(name = "probe-rs")]
    ProbeRs,
    /// OpenOCD.
    #[value(name = "openocd")]
    OpenOcd,
    /// st-flash of the stlink tools, with an ST-Link.
    #[value(name = "st-flash")]
    StFlash,
}

fn board(text: &str) -> Result<&'static Board, String> {
    cathforce_link::board(text).ok_or_else(|| {
        let names = BOARDS.map(|board| board.name);
        let near = cathforce_bundle::nearest(text, &names);
        let near = near.map_or(String::new(), |near| format!("did you mean `{near}`? "));
        format!("{near}the boards are {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_known_by_its_name_and_a_slip_names_its_neighbour() {
        assert_eq!(board("mps2-an500").unwrap().flash, None);
        let said = board("nucleo-h743zi").unwrap_err();
        assert!(said.contains("did you mean `nucleo-h743zi2`?"), "{said}");
        let said = board("arduino").unwrap_err();
        assert_eq!(said, "the boards are mps2-an500, nucleo-h743zi2");
    }
}
