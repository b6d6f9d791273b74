//! In which unit a surface was exported, by its size.

use crate::geometry::Figure;

/// Plausible lengths of the box around a vessel, and plausible radii of its lumen \[m\]: from a small
/// artery to the whole tree of a body, and from a coronary's branch to an aneurysm of the aorta.
const SPAN_M: [f64; 2] = [0.01, 2.0];
const RADIUS_M: [f64; 2] = [0.25e-3, 0.04];
/// Units in which a mesh may have been exported, in millimetres, the usual ones first: one alone is
/// named, and two would contradict each other.
const UNITS: [(f64, &str); 4] =
    [(1000.0, "metres"), (10.0, "centimetres"), (0.001, "micrometres"), (25.4, "inches")];

/// A hint at the unit of a surface whose size is that of no vessel; `None` if millimetres are plausible.
pub(crate) fn unit_hint(figure: &Figure) -> Option<String> {
    let Figure { radius_m, span_m, .. } = *figure;
    let is_plausible = |factor: f64| {
        let within = |[low, high]: [f64; 2], x: f64| (low..=high).contains(&(factor * x));
        within(SPAN_M, span_m) && within(RADIUS_M, radius_m)
    };
    if is_plausible(1.0) {
        return None;
    }
    let size = format!(
        "the surface spans {:.3} mm and is about {:.3} mm wide, which no vessel is",
        1e3 * span_m,
        2e3 * radius_m
    );
    Some(match UNITS.iter().find(|(factor, _)| is_plausible(*factor)) {
        None => size,
        Some((factor, unit)) => format!(
            "{size}; STL is read in millimetres: was it exported in {unit}? Then scale it by {factor}"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_is_told_by_width_and_length() {
        let tube = |scale: f64| Figure {
            radius_m: 4e-3 * scale,
            span_m: 0.1 * scale,
            ..Figure::default()
        };
        assert_eq!(unit_hint(&tube(1.0)), None);
        for (scale, says, not) in [
            (0.001, "in metres? Then scale it by 1000", "centimetres"),
            (1000.0, "in micrometres? Then scale it by 0.001", "metres? Then scale it by 1000"),
        ] {
            let hint = unit_hint(&tube(scale)).unwrap();
            assert!(hint.contains(says) && !hint.contains(not), "{hint}");
        }
        let cm =
            unit_hint(&Figure { radius_m: 0.4e-4, span_m: 4e-3, ..Figure::default() }).unwrap();
        assert!(cm.contains("centimetres") && !cm.contains("in metres"), "{cm}");
    }
}
