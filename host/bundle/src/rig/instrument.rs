//! Tables `[instrument]` and `[guidewire]`: what is fed into the vessel.

use cathforce_mechanics::{MAX_PRECURVE, MAX_SECTIONS};

use super::cause::RigCause;
use super::toml_reader::{NOT_NEGATIVE, POSITIVE, TableReader};

/// A piece of the instrument of one stiffness, in the bundle's order: base to tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigSection {
    pub length_m: f64,
    pub youngs_modulus_pa: f64,
}

/// A piece of the unloaded tip, from the tip backwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipPiece {
    pub length_m: f64,
    pub curvature_per_m: f64,
}

/// Table `[instrument]` or `[guidewire]`.
#[derive(Clone, Debug, PartialEq)]
pub struct RigInstrument {
    pub length_m: f64,
    pub outer_diameter_m: f64,
    pub inner_diameter_m: f64,
    pub density_kg_per_m3: f64,
    pub poissons_ratio: f64,
    /// From the base to the tip.
    pub sections: Vec<RigSection>,
    /// From the tip backwards.
    pub tip_precurve: Vec<TipPiece>,
}

/// The catheter's table, which has to be there, and the guidewire's.
pub(crate) const INSTRUMENT: &str = "instrument";
pub(crate) const GUIDEWIRE: &str = "guidewire";

pub(crate) const INSTRUMENT_KEYS: [&str; 7] = [
    "length_m",
    "outer_diameter_m",
    "inner_diameter_m",
    "density_kg_per_m3",
    "poissons_ratio",
    "sections",
    "tip_precurve",
];
pub(crate) const SECTION_KEYS: [&str; 2] = ["length_m", "youngs_modulus_Pa"];
pub(crate) const PRECURVE_KEYS: [&str; 2] = ["length_m", "curvature_per_m"];

/// The catheter, or a guidewire on its own.
pub(super) fn read_instrument(root: &TableReader<'_>) -> RigInstrument {
    let table = root.table(INSTRUMENT, &INSTRUMENT_KEYS);
    read(&table, f64::MAX, "above 0")
}

/// The guidewire in the catheter, if there is one.
pub(super) fn read_guidewire(
    root: &TableReader<'_>,
    catheter: &RigInstrument,
) -> Option<RigInstrument> {
    let table = root.optional_table(GUIDEWIRE, &INSTRUMENT_KEYS)?;
    let bore_m = catheter.inner_diameter_m;
    let meaning = "above 0 and at most the catheter's inner diameter, in which it runs";
    Some(read(&table, bore_m, meaning))
}

/// `thickest_m`: the largest outer diameter; `thickness`: what it has to be, in words.
fn read(table: &TableReader<'_>, thickest_m: f64, thickness: &'static str) -> RigInstrument {
    let before = table.fault_count();
    let length_m = table.number_in("length_m", POSITIVE, "above 0");
    let outer_diameter_m =
        table.number_in("outer_diameter_m", f64::MIN_POSITIVE..=thickest_m, thickness);
    let inner_diameter_m = table.number_in(
        "inner_diameter_m",
        0.0..=0.999 * outer_diameter_m,
        "at least 0 (a solid wire) and below the outer diameter",
    );
    let sections = table.tables("sections", &SECTION_KEYS);
    let sections: Vec<_> = sections
        .iter()
        .map(|section| RigSection {
            length_m: section.number_in("length_m", POSITIVE, "above 0"),
            youngs_modulus_pa: section.number_in("youngs_modulus_Pa", POSITIVE, "above 0"),
        })
        .collect();
    if table.fault_count() == before {
        check_lengths(table, length_m, &sections);
    }
    let tip_precurve = table.tables("tip_precurve", &PRECURVE_KEYS);
    let tip_precurve: Vec<_> = tip_precurve
        .iter()
        .map(|piece| TipPiece {
            length_m: piece.number_in("length_m", NOT_NEGATIVE, "at least 0"),
            curvature_per_m: piece.number("curvature_per_m").value,
        })
        .collect();
    for (key, found, most) in [
        ("sections", sections.len(), MAX_SECTIONS),
        ("tip_precurve", tip_precurve.len(), MAX_PRECURVE),
    ] {
        if found > most {
            let cause = RigCause::TooMany { key: table.path(key), found, most };
            table.report(table.place_of(key), cause);
        }
    }
    RigInstrument {
        length_m,
        outer_diameter_m,
        inner_diameter_m,
        density_kg_per_m3: table.number_in("density_kg_per_m3", POSITIVE, "above 0"),
        poissons_ratio: table.number_in("poissons_ratio", -0.99..=0.5, "between -1 and 0.5"),
        sections,
        tip_precurve,
    }
}

/// The sections make up the whole instrument.
fn check_lengths(table: &TableReader<'_>, length_m: f64, sections: &[RigSection]) {
    let place = table.place_of("sections");
    let sum_m: f64 = sections.iter().map(|section| section.length_m).sum();
    if sections.is_empty() {
        table.report(place, RigCause::NoSections { key: table.path("sections") });
    } else if (sum_m - length_m).abs() > 1e-4 {
        table.report(place, RigCause::SectionLengths { sum_m, length_m });
    }
}
