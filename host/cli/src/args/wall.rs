//! Arguments of `cathforce wall`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::material::{LawName, millimetres};
use super::{JsonFile, positive};

#[derive(Debug, Args)]
pub struct WallArguments {
    #[command(subcommand)]
    pub action: WallAction,
}

#[derive(Debug, Subcommand)]
pub enum WallAction {
    /// Press on a place of a wall, and print how far it gives way, law by law.
    Load(WallLoadArguments),
    /// Press on the left iliac artery of the phantom of Pescio et al. 2025, beside their Table 3.
    Phantom(WallPhantomArguments),
    /// Find the stiffness field and the stiffening curve that the device runs in place of a wall in
    /// finite elements, and their error.
    Reduce(WallReduceArguments),
}

/// The finite elements of a wall.
#[derive(Debug, Args)]
pub struct ElementArguments {
    /// Size of the elements along the wall [default: 5; `reduce`: half of the narrowest radius]
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub element_mm: Option<f64>,
    /// Layers of elements through the wall.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=6))]
    pub layers: u8,
    /// Poisson's ratio: the resistance to a change of volume.
    #[arg(long, value_name = "NU", default_value_t = 0.49, value_parser = poissons_ratio)]
    pub poisson: f64,
}

#[derive(Debug, Args)]
pub struct WallLoadArguments {
    /// Trial bundle, surface of a lumen (STL, in millimetres), or mesh of a wall (Gmsh MSH, in
    /// millimetres, with physical surfaces `inner` and `fixed`).
    #[arg(value_name = "BUNDLE|STL|MSH")]
    pub path: PathBuf,
    /// Thickness of the wall; a mesh of a wall has its own.
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub thickness_mm: Option<f64>,
    /// Law of the wall with its parameters in MPa: `elastic:E`, `hencky:E`, `neo-hookean:C10`,
    /// `mooney-rivlin:C10,C01` or `ogden:MU,ALPHA`. May be repeated.
    #[arg(long = "law", value_name = "LAW:PARAMETERS", value_parser = law)]
    pub laws: Vec<LawArgument>,
    /// Take the laws from this result of `cathforce material fit --out`.
    #[arg(long, value_name = "FILE.json")]
    pub fit: Option<PathBuf>,
    /// Place near the wall that is pressed, in millimetres.
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub at: Triple,
    /// Direction of the force [default: out of the lumen, across the wall]
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub direction: Option<Triple>,
    /// Force on the wall in newtons. May be repeated.
    #[arg(long = "force-n", value_name = "N", required = true, value_parser = force)]
    pub forces_n: Vec<f64>,
    /// Radius of the place that is pressed.
    #[arg(long, value_name = "MM", default_value_t = 2.0, value_parser = millimetres)]
    pub patch_mm: f64,
    #[command(flatten)]
    pub elements: ElementArguments,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct WallPhantomArguments {
    /// Thickness of the wall; published is that of the tensile specimen.
    #[arg(long, value_name = "MM", default_value_t = 2.0, value_parser = millimetres)]
    pub thickness_mm: f64,
    /// Radius of the place that is pressed; it is not published.
    #[arg(long, value_name = "MM", default_value_t = 2.0, value_parser = millimetres)]
    pub patch_mm: f64,
    #[command(flatten)]
    pub elements: ElementArguments,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct WallReduceArguments {
    /// Trial bundle with a centreline.csv.
    pub bundle: PathBuf,
    /// Thickness of the wall.
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub thickness_mm: Option<f64>,
    /// Law of the wall with its parameters in MPa, as for `cathforce wall load`.
    #[arg(long, value_name = "LAW:PARAMETERS", value_parser = law)]
    pub law: LawArgument,
    /// Force in newtons that the stiffening curve is fitted to. May be repeated [default: 0.25, 0.5, 1]
    #[arg(long = "force-n", value_name = "N", value_parser = force)]
    pub forces_n: Vec<f64>,
    /// Longest part of a branch that has one stiffness.
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = millimetres)]
    pub every_mm: f64,
    /// Stations at which the stiffening curve is measured.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=20))]
    pub curves: u8,
    #[command(flatten)]
    pub elements: ElementArguments,
    /// Write rig.toml with the stiffness field into this file.
    #[arg(long, value_name = "FILE.toml")]
    pub rig_out: Option<PathBuf>,
    /// Write the stiffening curve as settings into this file.
    #[arg(long, value_name = "FILE.toml")]
    pub settings_out: Option<PathBuf>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

/// Three numbers.
pub type Triple = [f64; 3];

/// A law with its parameters, as they were written.
#[derive(Clone, Debug, PartialEq)]
pub struct LawArgument {
    pub law: LawName,
    /// In MPa, an exponent as it is.
    pub parameters: Vec<f64>,
    /// The elastic law with stretches and rotations of any size.
    pub hencky: bool,
}

fn law(text: &str) -> Result<LawArgument, String> {
    const NAMES: [&str; 5] = ["elastic", "hencky", "neo-hookean", "mooney-rivlin", "ogden"];
    let (name, numbers) =
        text.split_once(':').ok_or("write LAW:PARAMETERS, as in `elastic:0.46`")?;
    let (law, count) = match name.trim() {
        "elastic" | "hencky" => (LawName::Elastic, 1),
        "neo-hookean" => (LawName::NeoHookean, 1),
        "mooney-rivlin" => (LawName::MooneyRivlin, 2),
        "ogden" => (LawName::Ogden, 2),
        other => {
            let hint = cathforce_bundle::nearest(other, &NAMES)
                .map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            return Err(format!(
                "there is no law `{other}`{hint}; the laws are {}",
                NAMES.join(", ")
            ));
        }
    };
    let numbers: Vec<&str> = numbers.split(',').collect();
    if numbers.len() != count {
        return Err(format!("`{name}` takes {count} numbers, not {}", numbers.len()));
    }
    let parameters = numbers.iter().map(|number| {
        let value = number.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| format!("`{number}` is not a number"))
    });
    let parameters = parameters.collect::<Result<_, _>>()?;
    Ok(LawArgument { law, parameters, hencky: name.trim() == "hencky" })
}

pub(super) fn triple(text: &str) -> Result<Triple, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|number| number.trim().parse::<f64>().ok().filter(|value| value.is_finite()))
        .collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok([x, y, z]),
        _ => Err("write three numbers, as in `12.5,0,-3`".into()),
    }
}

fn force(text: &str) -> Result<f64, String> {
    positive(text, "a force in newtons above 0")
}

pub(super) fn poissons_ratio(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| (0.0..=0.49999).contains(value));
    value.ok_or_else(|| "give a number from 0 to 0.49999".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_are_read_with_their_parameters() {
        let ogden = law("ogden:0.14,1.4").unwrap();
        assert_eq!((ogden.law, &ogden.parameters[..]), (LawName::Ogden, &[0.14, 1.4][..]));
        assert!(law("hencky:0.46").unwrap().hencky && !law("elastic:0.46").unwrap().hencky);
        assert!(law("ogdn:1,2").unwrap_err().contains("did you mean `ogden`?"));
        assert!(law("ogden:1").unwrap_err().contains("takes 2 numbers, not 1"));
        assert!(law("elastic:soft").unwrap_err().contains("`soft` is not a number"));
        assert!(law("elastic").is_err() && triple("1,2").is_err());
        assert_eq!(triple("1,-2.5, 3"), Ok([1.0, -2.5, 3.0]));
        assert!(poissons_ratio("0.5").is_err() && poissons_ratio("0.49").is_ok());
    }
}
