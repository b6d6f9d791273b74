//! Names of effects on the command line.

use cathforce_bundle::nearest;
use cathforce_effect_catalogue::{Effect, all};

use crate::failure::{Code, Failure};

/// The effects of these names. Where some are misspelt, the error lists all of them, each with the
/// nearest name that there is.
pub fn effects<'a>(
    names: impl IntoIterator<Item = &'a str>,
) -> Result<Vec<&'static Effect>, Failure> {
    let known: Vec<&str> = all().map(|effect| effect.id).collect();
    let (mut found, mut wrong) = (Vec::new(), Vec::new());
    for name in names {
        match Effect::find(name) {
            Some(effect) => found.push(effect),
            None => {
                let hint = nearest(name, &known).map(|near| format!(", did you mean `{near}`?"));
                wrong.push(format!("there is no effect `{name}`{}", hint.unwrap_or_default()));
            }
        }
    }
    if wrong.is_empty() {
        return Ok(found);
    }
    let message =
        format!("{}\n  fix: `cathforce gap effects` lists all effects", wrong.join("\n  "));
    Err(Failure::new(Code::Usage, message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_misspelt_effect_is_named_with_the_nearest_one() {
        let names = ["contact.frction", "wall.stiffness", "drive.backlsh", "nothing.like.it"];
        let failure = effects(names).unwrap_err();
        for line in [
            "there is no effect `contact.frction`, did you mean `contact.friction`?",
            "there is no effect `drive.backlsh`, did you mean `drive.backlash`?",
            "there is no effect `nothing.like.it`\n",
        ] {
            assert!(failure.message.contains(line), "{line} in {}", failure.message);
        }
        assert_eq!(effects(["wall.stiffness"]).unwrap()[0].id, "wall.stiffness");
    }
}
