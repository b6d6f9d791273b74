//! Why a bundle is refused.

/// Why a bundle is no drive that could be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    #[error("this is no drive: rig.toml has no plant = \"drive\"")]
    NotADrive,
    #[error("there are no trials, so there is nothing to compare\n  fix: add trials/000.csv")]
    NoTrials,
    #[error(
        "trial {trial:03} has only {rows} rows, too few to differentiate a position twice\n  fix: \
         record at least a hundred rows"
    )]
    TooShort { trial: u32, rows: usize },
    #[error(
        "trial {trial:03} has a row every {step_s:.4} s, and moving the stated inertia takes {:.0} % of its \
         command: so seldom a row tells no acceleration\n  fix: t_s is in seconds; record at 50 Hz or \
         more, better at 100 Hz, or so slowly that inertia takes less than {:.0} %",
        100.0 * .share, 100.0 * .most
    )]
    TooSeldom { trial: u32, step_s: f64, share: f64, most: f64 },
    #[error(
        "the drive never moves in any trial: no force of motion can be compared\n  fix: record \
         its position while it moves"
    )]
    Still,
    #[error(
        "{column} is 0 in every trial, and the drive moves: nothing drives it\n  fix: record what the \
         drive was given, in the unit of the column"
    )]
    NoCommand { column: &'static str },
    #[error(
        "no trial holds anything that can be compared: the drive rests or trembles in its encoder's \
         noise all the time\n  fix: record it while it moves"
    )]
    NothingCompared,
}
