//! Units of settings, and values that were written in a unit a thousand times larger or smaller.

pub use cathforce_bundle::setting::unit;
use cathforce_config::Key;

const THOUSAND: f32 = 1000.0;
/// Ratio to a thousand within which a value looks like a slip of its unit: an ordinary change of a
/// setting stays below a factor of 2.5.
const NEAR: std::ops::RangeInclusive<f32> = 0.4..=2.5;

/// A warning where a value in range is about a thousand times its default, or a thousandth of it.
pub fn in_range(key: Key, value: f32) -> Option<String> {
    let default = key.default().filter(|default| *default != 0.0)?;
    if key.unit() == "1" || key.is_whole() || value == 0.0 {
        return None;
    }
    let ratio = (value / default).abs();
    let of = if NEAR.contains(&(ratio / THOUSAND)) {
        "a thousand times"
    } else if NEAR.contains(&(ratio * THOUSAND)) {
        "a thousandth of"
    } else {
        return None;
    };
    let (name, unit) = (key.name(), unit(key));
    Some(format!(
        "{name} = {value}{unit} is about {of} its default, {default}{unit}; check its unit"
    ))
}

#[cfg(test)]
mod tests {
    use cathforce_bundle::setting::out_of_range;

    use super::*;

    #[test]
    fn a_slip_by_a_thousand_is_said_and_a_bold_value_is_not() {
        let key = |name| Key::find(name).unwrap();
        let force = key("force_limit_n");
        assert!(out_of_range(force, 3000.0).unwrap().contains("than 3 N"));
        assert!(out_of_range(force, 12.0).is_none_or(|text| text.contains("0.012 N")));
        assert!(in_range(force, 0.003).unwrap().contains("a thousandth of its default, 3 N"));
        assert_eq!(in_range(force, 0.3), None);
        assert_eq!(in_range(key("force_gain"), 0.001), None, "a pure number has no unit");
        let speed = key("max_insertion_speed_m_per_s");
        assert!(out_of_range(speed, 200.0).unwrap().contains("than 0.2 m/s"));
    }
}
