//! Why `rig.toml` is refused.

use thiserror::Error;

/// Why `rig.toml` is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RigCause {
    #[error("not TOML: {0}")]
    Syntax(String),
    #[error("unknown key `{key}`{}{}",
        if .table.is_empty() { String::new() } else { format!(" in [{table}]") },
        .nearest.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    UnknownKey { key: String, table: String, nearest: Option<String> },
    #[error("`{key}` is missing; it has to be {kind}")]
    MissingKey { key: String, kind: &'static str },
    #[error("the table [{table}] is missing")]
    MissingTable { table: String },
    #[error("`{key}` is a {found}; it has to be {kind}")]
    Type { key: String, kind: &'static str, found: &'static str },
    #[error("`{key}` is not a finite number")]
    NotFinite { key: String },
    #[error("`{key}` has {found} entries; it has to have {expected}")]
    Count { key: String, expected: usize, found: usize },
    #[error("`{key}` is {value}; it has to be {meaning}")]
    Range { key: String, value: f64, meaning: &'static str },
    #[error("`{key}` is \"{found}\"; known are {known}")]
    Choice { key: &'static str, found: String, known: &'static str },
    #[error("`{key}` belongs to a {other}, but by its `plant` this rig is a {own}")]
    OtherPlant { key: String, own: &'static str, other: &'static str },
    #[error(transparent)]
    Model(Box<BeyondModel>),
    #[error("`{key}` is given, but there is no fluid")]
    NoFluid { key: String },
    #[error("`{key}` is given by its other name, `{as_}`, too")]
    Twice { key: String, as_: &'static str },
    #[error("`{key}` is empty or missing; an instrument has at least one section")]
    NoSections { key: String },
    #[error("the sections are {sum_m} m long together, but length_m is {length_m} m")]
    SectionLengths { sum_m: f64, length_m: f64 },
    #[error("`{key}` has {found} entries; the model takes at most {most}")]
    TooMany { key: String, found: usize, most: usize },
    #[error(
        "there are {found} tables [[tendons]]; an instrument has at most {most} driven tendons"
    )]
    TooManyTendons { found: usize, most: usize },
    #[error("there are a [tendon] with a fixed pull and [[tendons]] that drives pull")]
    BothTendons,
    #[error("`{key}` {why}")]
    Contradiction { key: String, why: &'static str, fix: &'static str },
    #[error("`entry.{0}` has no length")]
    ZeroVector(&'static str),
    #[error("`entry.up` is parallel to `entry.direction`, so the plane of the tip is not known")]
    ParallelUp,
}

/// A value of `rig.toml` that would take a number of the model out of its range.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("`{key}` = {value} is beyond the model: {why}")]
pub struct BeyondModel {
    pub key: String,
    pub value: String,
    pub why: String,
    /// The values that the key may have, in words.
    pub may_be: String,
}

impl RigCause {
    pub(crate) fn fix(&self) -> String {
        match self {
            RigCause::Syntax(_) => "correct the line; TOML wants `key = value`".into(),
            RigCause::UnknownKey { nearest: Some(nearest), .. } => {
                format!("write `{nearest}`, or take the key out")
            }
            RigCause::UnknownKey { .. } => "take the key out; nothing reads it".into(),
            RigCause::MissingKey { key, .. } => {
                format!("add `{} = …` to the table", key.rsplit('.').next().unwrap_or(key))
            }
            RigCause::MissingTable { table } => format!("add the table [{table}] with its keys"),
            RigCause::Type { kind, .. } => format!("write {kind}"),
            RigCause::NotFinite { .. } => "write a finite number".into(),
            RigCause::Count { expected, .. } => format!("write {expected} numbers"),
            RigCause::Range { .. } => {
                "correct the value; units are SI, as the key's name ends".into()
            }
            RigCause::Choice { key: "format", .. } => {
                "use the cathforce that reads this format, or write the bundle in the known one".into()
            }
            RigCause::Choice { .. } => "use one of the known values".into(),
            RigCause::OtherPlant { key, own: "catheter", other } => format!(
                "write `plant = \"{other}\"` above the tables (the default is \"catheter\"), or take `{key}` \
                 out"
            ),
            RigCause::OtherPlant { key, other, .. } => {
                format!("take `{key}` out, or write `plant = \"{other}\"`")
            }
            RigCause::Contradiction { fix, .. } => (*fix).to_owned(),
            RigCause::Model(beyond) => {
                let may_be = &beyond.may_be;
                format!("write {may_be}, the rest of the rig being as it is; units are SI")
            }
            RigCause::NoFluid { .. } => {
                "write `fluid = \"water\"` or \"blood\", whose own number it replaces, or take the key \
                 out"
                    .into()
            }
            RigCause::Twice { key, .. } => {
                format!("take `{}` out", key.rsplit('.').next().unwrap_or(key))
            }
            RigCause::NoSections { .. } => {
                "add `sections = [ { length_m = …, youngs_modulus_Pa = … } ]`".into()
            }
            RigCause::SectionLengths { .. } => {
                "correct the sections or length_m; sections go from the base to the tip and add \
                 up to length_m"
                    .into()
            }
            RigCause::TooMany { most, .. } => {
                format!("join neighbouring pieces until {most} are left")
            }
            RigCause::TooManyTendons { most, .. } => {
                format!("describe at most {most}; tendons that run beside each other are one")
            }
            RigCause::BothTendons => {
                "describe all tendons in [[tendons]]; one with a fixed pull has the same number in \
                 every row of its column"
                    .into()
            }
            RigCause::ZeroVector(_) => "give a direction, for example [1.0, 0.0, 0.0]".into(),
            RigCause::ParallelUp => {
                "give `up` as the direction, normal to `direction`, to which the tip bends at \
                 rotation 0"
                    .into()
            }
        }
    }
}
