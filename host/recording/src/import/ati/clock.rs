//! Times of day in a log, by which its rate is checked.

/// Seconds since midnight of a text that has a time of day in it, as `Jan 1, 2024 1:00:00 PM` or
/// `2024-01-01T13:00:00.250`; `None` without one.
pub(super) fn of_day_s(text: &str) -> Option<f64> {
    let word = text.split([' ', 'T', '\u{202f}', '\u{a0}']).find(|word| word.contains(':'))?;
    let mut parts = word.split(':');
    let hour = parts.next()?.parse::<u32>().ok().filter(|hour| *hour < 24)?;
    let minute = parts.next()?.parse::<u32>().ok().filter(|minute| *minute < 60)?;
    let second = match parts.next() {
        Some(second) => second.trim_end_matches('Z').parse::<f64>().ok()?,
        None => 0.0,
    };
    if parts.next().is_some() || !(0.0..61.0).contains(&second) {
        return None;
    }
    let upper = text.to_uppercase();
    let hour = match (upper.ends_with("PM"), upper.ends_with("AM")) {
        (true, _) => hour % 12 + 12,
        (_, true) => hour % 12,
        _ => hour,
    };
    Some(f64::from(3600 * hour + 60 * minute) + second)
}

/// Whether a time of day has fractions of a second.
pub(super) fn has_fraction(text: &str) -> bool {
    text.rsplit_once(':').is_some_and(|(_, second)| second.contains('.'))
}

/// Seconds from one time of day to a later one, less than a day.
pub(super) fn elapsed_s(from_s: f64, to_s: f64) -> f64 {
    (to_s - from_s).rem_euclid(86_400.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_read_in_both_hands() {
        assert_eq!(of_day_s("Jan 1, 2024 1:00:05 PM"), Some(46_805.0));
        assert_eq!(of_day_s("1/1/24 12:00 AM"), Some(0.0));
        assert_eq!(of_day_s("2024-01-01T13:00:00.250Z"), Some(46_800.25));
        assert_eq!((of_day_s("12.5"), of_day_s("25:00:00"), of_day_s("a:b")), (None, None, None));
        assert_eq!(elapsed_s(86_399.0, 1.0), 2.0);
    }
}
