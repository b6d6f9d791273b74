//! The boards whose firmware is distributed. A new board is a line of [`BOARDS`].

use std::path::PathBuf;

use super::sources::Build;
#[cfg(test)]
use super::sources::{Package, behind, merge};
use crate::build;
#[cfg(test)]
use crate::shell::root;

/// A board, by the name that its firmware reports.
pub struct Board {
    pub name: &'static str,
    /// What cargo is told of its features.
    pub features: &'static [&'static str],
    /// QEMU boots it, so that what the file says of itself is compared with what it says when it runs.
    pub is_emulated: bool,
}

pub static BOARDS: [Board; 2] = [
    Board { name: "mps2-an500", features: &[], is_emulated: true },
    Board { name: "nucleo-h743zi2", features: &build::NUCLEO, is_emulated: false },
];

impl Board {
    /// How the firmware is built for it.
    pub fn build(&self) -> Build<'static> {
        Build { package: "cathforce-firmware", target: build::TARGET, features: self.features }
    }

    /// The name of its file, without the ending.
    pub fn file(&self) -> PathBuf {
        PathBuf::from(format!("lib/cathforce/cathforce-firmware-{}", self.name))
    }
}

/// All packages behind the firmware of any board; one that is linked for one of them counts as linked.
#[cfg(test)]
pub fn packages() -> anyhow::Result<Vec<Package>> {
    let mut all = Vec::new();
    for board in &BOARDS {
        merge(&mut all, behind(root(), &board.build())?);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_board_has_its_own_packages_and_all_boards_have_those_of_each() {
        let of = |board: &Board| behind(root(), &board.build()).unwrap();
        let has = |all: &[Package], name: &str| all.iter().any(|package| package.name == name);
        let (emulated, nucleo) = (of(&BOARDS[0]), of(&BOARDS[1]));
        assert!(has(&nucleo, "embassy-stm32") && !has(&emulated, "embassy-stm32"));
        let all = packages().unwrap();
        assert!(emulated.iter().chain(&nucleo).all(|package| has(&all, &package.name)));
    }

    /// `cathforce flash` looks for a file of this name.
    #[test]
    fn boards_have_the_names_that_the_program_knows() {
        let known = std::fs::read_to_string(root().join("host/link/src/boards.rs")).unwrap();
        for board in &BOARDS {
            assert!(known.contains(&format!("name: \"{}\"", board.name)), "{}", board.name);
        }
    }
}
