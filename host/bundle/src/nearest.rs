//! Suggestions for misspelt names.

/// Least similarity, from 0 to 1, at which one name is suggested for another.
const ALIKE: f64 = 0.6;

/// The nearest of `known` to `name`, unless none is near.
///
/// A name is near if it differs in few letters, or if one has all words of the other: a unit or a
/// table was left out or added. A shared beginning is not enough; no suggestion is better than a guess.
pub fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    let scored = known.iter().map(|&candidate| (likeness(name, candidate), candidate));
    scored.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(score, _)| *score >= ALIKE).map(|(_, n)| n)
}

fn likeness(a: &str, b: &str) -> f64 {
    let (a, b) = (words(a), words(b));
    let letters = strsim::normalized_damerau_levenshtein(&a.join("_"), &b.join("_"));
    let (short, long) = if a.len() <= b.len() { (&a, &b) } else { (&b, &a) };
    let length = |words: &[String]| words.iter().map(String::len).sum::<usize>();
    let is_part = length(short) > 1 && long.windows(short.len().max(1)).any(|part| part == *short);
    let share = length(short) as f64 / length(long).max(1) as f64;
    if is_part { letters.max(ALIKE + 0.3 * share) } else { letters }
}

/// The words of a name between points, brackets, spaces and the like.
fn words(name: &str) -> Vec<String> {
    let name = name.to_lowercase();
    let words = name.split(|c: char| !c.is_alphanumeric());
    words.filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn a_slip_has_its_name_and_nonsense_has_none() {
        let known = [
            "torque_slew_n_m_per_s",
            "force_gain",
            "wall.friction_coefficient",
            "density_kg_per_m3",
            "fx_N",
            "insertion_m",
            "guidewire_insertion_m",
            "priors",
            "rig",
        ];
        for (name, meant) in [
            ("force_gian", "force_gain"),
            ("rgi", "rig"),
            ("friction_coefficient", "wall.friction_coefficient"),
            ("density", "density_kg_per_m3"),
            ("Fx [N]", "fx_N"),
            ("fx", "fx_N"),
            ("insertion (mm)", "insertion_m"),
            ("prior", "priors"),
        ] {
            assert_eq!(nearest(name, &known), Some(meant), "{name}");
        }
        for name in ["bogus", "drive", "torture", "x", "", "…"] {
            assert_eq!(nearest(name, &known), None, "{name}");
        }
    }
}
