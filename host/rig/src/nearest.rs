//! The known name that a misspelt one probably means.

/// The nearest of `known` to `name`, unless none is near.
pub fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    let likeness = |candidate: &str| {
        let (a, b) = (name.to_lowercase(), candidate.to_lowercase());
        strsim::normalized_damerau_levenshtein(&a, &b).max(0.9 * strsim::jaro_winkler(&a, &b))
    };
    let scored = known.iter().map(|&candidate| (likeness(candidate), candidate));
    scored.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(score, _)| *score > 0.5).map(|(_, n)| n)
}
