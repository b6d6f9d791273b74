//! Channels and places in plain words.

use crate::explaining::locate::Cell;

/// A channel, as "the force along x"; its identifier where it has no words.
pub fn channel(name: &str) -> String {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let axis = |prefix: &str, suffix: &str| {
        let own = name.strip_prefix(prefix)?.strip_suffix(suffix)?;
        AXES.contains(&own).then(|| own.to_owned())
    };
    if name == "drive_fx_N" {
        return "the force at the drive".to_owned();
    }
    if name.starts_with("drive_command_") {
        return "the drive's command".to_owned();
    }
    if name.starts_with("output_") {
        return "the output".to_owned();
    }
    if let Some(axis) = axis("f", "_N") {
        return format!("the force along {axis}");
    }
    if let Some(axis) = axis("tip_", "_m") {
        return format!("the tip's place along {axis}");
    }
    let point = name.strip_prefix('p').and_then(|rest| rest.split_once('_'));
    match point {
        Some((number, rest)) if number.parse::<u32>().is_ok() && rest.ends_with("_m") => {
            "the shape".to_owned()
        }
        _ => name.to_owned(),
    }
}

/// When and where a cell is, as "while sliding, forward at 18 to 40 mm/s, 40 to 52 mm inside".
pub fn place(cell: &Cell) -> String {
    let while_it_is = format!("while {}", cell.phase);
    let (phase, said) = match cell.phase.as_str() {
        "entry" => ("while the tip leaves the guide", ""),
        "free" => ("before the first contact", ""),
        "first contact" => ("at the first contact", ""),
        "sliding" => ("while sliding", ""),
        "dwell" => ("while standing in contact", "standing"),
        "reversal" => ("around reversals", ""),
        "rotation" => ("while turning", ", rotating"),
        "withdrawal" => ("on the way out", "backward, "),
        _ => (while_it_is.as_str(), ""),
    };
    // What the words of a phase say already is not told again.
    let regime = match said {
        "" => cell.regime.clone(),
        said => cell.regime.replace(said, ""),
    };
    // A catheter's speeds are numbers, a drive's are words.
    let joined =
        if regime.ends_with("mm/s") || regime.ends_with("rotating") { " at " } else { " and " };
    let regime = ["forward", "backward"].iter().fold(regime, |regime, sense| {
        regime.replace(&format!("{sense}, "), &format!("{sense}{joined}"))
    });
    let stretch = match cell.channel.as_str() {
        own if own.starts_with("drive_command_") => format!("at {}", cell.stretch()),
        own if own.starts_with("output_") => format!("at an input of {}", cell.stretch()),
        _ => format!("{} inside", cell.stretch()),
    };
    let parts = [phase.to_owned(), regime, stretch];
    parts.into_iter().filter(|own| !own.is_empty()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_told_with_what_is_done_there() {
        let cell = |channel: &str, phase: &str, regime: &str| Cell {
            channel: channel.into(),
            phase: phase.into(),
            regime: regime.into(),
            arc_m: [0.04, 0.052],
            ..Cell::default()
        };
        for (of, words) in [
            (
                cell("fx_N", "sliding", "forward, 18 to 40 mm/s"),
                "while sliding, forward at 18 to 40 mm/s, 40 to 52 mm inside",
            ),
            (cell("fx_N", "dwell", "standing"), "while standing in contact, 40 to 52 mm inside"),
            (
                cell("fx_N", "withdrawal", "backward, below 8 mm/s"),
                "on the way out, below 8 mm/s, 40 to 52 mm inside",
            ),
            (
                cell("drive_command_N", "steady", "backward, slow"),
                "while steady, backward and slow, at 40 to 52 mm",
            ),
            (
                cell("output_m", "reversal", "forward, slow"),
                "around reversals, forward and slow, at an input of 40 to 52 mm",
            ),
        ] {
            assert_eq!(place(&of), words);
        }
    }

    #[test]
    fn channels_have_names_that_say_what_they_measure() {
        for (name, words) in [
            ("fx_N", "the force along x"),
            ("drive_fx_N", "the force at the drive"),
            ("tip_z_m", "the tip's place along z"),
            ("p07_y_m", "the shape"),
            ("drive_command_N", "the drive's command"),
            ("output_rad", "the output"),
            ("something", "something"),
        ] {
            assert_eq!(channel(name), words);
        }
    }
}
