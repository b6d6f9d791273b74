//! The device image of a bundle.

use cathforce_config::image::{encode, encoded_len, most_links, overlong};
use cathforce_config::master::Master;
use cathforce_config::{Band, EncodeError, ImageError, ImageHead, Key, Settings};
use cathforce_mechanics::{Description, ParameterError, Real};
use thiserror::Error;

use crate::bundle::Bundle;
use crate::description::{SolverDefaults, describe};
use crate::error::BundleError;
use crate::geometry::SurfaceModel;
use crate::limits::{self, BundleOrModel};
use crate::lumen::LumenOptions;
use crate::rig::CatheterRig;
use crate::setting;
use crate::tips::Tip;
use crate::vessel::{CELL_M, LumenBuildError, LumenReport, LumenTooLarge, Vessel};

/// Longest link of the model \[m\].
const LONGEST_LINK_M: f64 = 2e-2;

/// Choices that a bundle does not make.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageOptions {
    pub solver: SolverDefaults,
    /// Length of a link of the shaft \[m\]; `None`: from the trials' largest insertion.
    pub link_length_m: Option<f64>,
    /// Grid spacing of the lumen \[m\].
    pub cell_m: f64,
    pub surface: SurfaceModel,
    pub settings: Settings,
    /// Replaces the catheter's own tip.
    pub tip: Option<&'static Tip>,
    /// Replaces the guidewire's own tip.
    pub guidewire_tip: Option<&'static Tip>,
    /// Parameters of the description by key, those of effects included; set in this order.
    pub parameters: Vec<(String, f32)>,
    /// Layout of the drives' positions in the master's frames.
    pub master: Master,
    /// How far the estimated forces may be off, if a diagnosis has stated it.
    pub band: Option<Band>,
}

impl Default for ImageOptions {
    fn default() -> Self {
        Self {
            solver: SolverDefaults::default(),
            link_length_m: None,
            cell_m: CELL_M,
            surface: SurfaceModel::default(),
            settings: Settings::default(),
            tip: None,
            guidewire_tip: None,
            parameters: Vec::new(),
            master: Master::default(),
            band: None,
        }
    }
}

impl ImageOptions {
    /// Sets a number by its name. `Err` names it and says what is wrong and what to do.
    pub fn set(&mut self, name: &str, value: f32) -> Result<(), String> {
        if let Err((message, fix)) = setting::check(name, value) {
            return Err(format!(
                "{message}: {fix}; `cathforce config list` lists names and ranges"
            ));
        }
        match Key::find(name) {
            Some(Key::Parameter(_)) => self.parameters.push((name.to_owned(), value)),
            _ => {
                let refused = |error| format!("{name}={value}: {error}");
                self.settings.set(name, value).map_err(refused)?;
            }
        }
        Ok(())
    }
}

/// Properties of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageReport {
    /// Size of the whole image.
    pub bytes: usize,
    pub lumen: LumenReport,
    /// Length of a link of the shaft \[m\].
    pub link_length_m: f64,
    /// The insertion that the links reach \[m\]; the settings' limit is lowered to it.
    pub reach_m: f64,
}

/// Why no image can be made of a bundle.
#[derive(Debug, Error)]
pub enum ImageBuildError {
    #[error(transparent)]
    Lumen(#[from] LumenBuildError),
    #[error(
        "the bundle has no trials, so it is not known how far the model has to reach\n  fix: add \
         trials/000.csv; of it only the largest insertion counts here"
    )]
    NoTrials,
    #[error(transparent)]
    LumenTooLarge(#[from] LumenTooLarge),
    #[error("{0}\n  fix: correct the number in rig.toml from which it comes")]
    Description(ImageError),
    /// A fault in rig.toml, with its place.
    #[error(transparent)]
    Bundle(#[from] BundleError),
    #[error(
        "the trials go in as far as {insertion_m} m, and the model's {links} links reach {reach_m} m\n  \
         fix: give insertion_m in metres, or trials that go less far"
    )]
    TooFar { insertion_m: f64, links: usize, reach_m: f64 },
    #[error(
        "a tip is given for a guidewire, but the rig has none\n  fix: describe the wire in the \
         table [guidewire] of rig.toml, with the keys of [instrument]"
    )]
    NoGuidewire,
    #[error("{0}\n  fix: leave solver.solves at 1, and parts of a tick at 2 or less")]
    Overlong(ImageError),
    #[error("{key} = {value}: {error}\n  fix: `cathforce config list` lists names and ranges")]
    Parameter { key: String, value: f32, error: ParameterError },
    #[error("the image cannot be made: {0}\n  fix: correct the setting or number it names")]
    Encode(#[from] EncodeError),
}

/// Refuses a rig whose model has numbers out of range; names key and line in rig.toml.
pub fn check_rig<T: Real>(
    bundle: &Bundle,
    description: &Description<T>,
) -> Result<(), ImageBuildError> {
    limits::check(bundle, description).map_err(|error| match error {
        BundleOrModel::Bundle(error) => error.into(),
        BundleOrModel::Model(error) => ImageBuildError::Description(ImageError::Description(error)),
    })
}

/// Description of a bundle's rig with these options: rig.toml, then the tips, then the parameters.
///
/// It needs no trial. Unless the options state a length, the links have the shortest one that the
/// solver allows; the image of a trial takes its own.
pub fn rig_description<T: Real>(
    bundle: &Bundle,
    options: &ImageOptions,
) -> Result<Description<T>, ImageBuildError> {
    let rig =
        bundle.catheter().ok_or_else(|| LumenBuildError::NoCatheter(bundle.rig.name.clone()))?;
    let link_length_m = options.link_length_m.unwrap_or(options.solver.shortest_link_m);
    described(rig, options, link_length_m)
}

fn described<T: Real>(
    rig: &CatheterRig,
    options: &ImageOptions,
    link_length_m: f64,
) -> Result<Description<T>, ImageBuildError> {
    let mut description = describe::<T>(rig, &options.solver, link_length_m);
    if let Some(tip) = options.tip {
        description.instrument.precurve = tip.precurve().collect();
    }
    if let Some(tip) = options.guidewire_tip {
        let wire = description.guidewire.as_mut().ok_or(ImageBuildError::NoGuidewire)?;
        wire.precurve = tip.precurve().collect();
    }
    for (key, value) in &options.parameters {
        description.set_parameter(key, T::lit(f64::from(*value))).map_err(|error| {
            let (key, value) = (key.clone(), *value);
            ImageBuildError::Parameter { key, value, error }
        })?;
    }
    // A wall that an effect makes near-rigid takes half ticks too.
    let factor = description.effects.wall.stiffness.factor.to_f64();
    let stiffest = rig.vessel.stiffest_n_per_m2() * factor;
    description.solver.substeps =
        description.solver.substeps.max(options.solver.substeps_for(stiffest));
    Ok(description)
}

/// Builds the device image of a bundle's rig: the description in f32, the lumen, and the
/// settings, as `cathforce_config::image` lays them out.
pub fn device_image(
    bundle: &Bundle,
    options: &ImageOptions,
) -> Result<(Vec<u8>, ImageReport), ImageBuildError> {
    let rig =
        bundle.catheter().ok_or_else(|| LumenBuildError::NoCatheter(bundle.rig.name.clone()))?;
    let link_length_m = |links: usize| {
        let by_trials = || Some(options.solver.link_length_m(bundle.largest_insertion_m()?, links));
        options.link_length_m.or_else(by_trials).ok_or(ImageBuildError::NoTrials)
    };

    // Checks come before the lumen, which takes seconds.
    let nominal_m = link_length_m(options.solver.links_in(&rig.vessel))?;
    let mut description = described::<f32>(rig, options, nominal_m)?;
    // Solver and effects decide how many links there is time for.
    let solver = &description.solver;
    let links = most_links(solver.solves, solver.substeps, description.has_active_effects());
    let link_length_m = link_length_m(links)?;
    description.solver.link_length_m = link_length_m as f32;
    description.solver.fine_tip_m = options.solver.fine_tip_m(link_length_m) as f32;
    if let Some(insertion_m) =
        bundle.largest_insertion_m().filter(|_| link_length_m > LONGEST_LINK_M)
    {
        let reach_m = options.solver.reach_m(LONGEST_LINK_M, links as f64);
        return Err(ImageBuildError::TooFar { insertion_m, links, reach_m });
    }
    check_rig(bundle, &description)?;
    if let Some(what) = overlong(&description) {
        return Err(ImageBuildError::Overlong(ImageError::Overlong(what)));
    }

    let vessel = Vessel::from_bundle(bundle, options.surface)?;
    let radius_m = 0.5 * rig.instrument.outer_diameter_m;
    // A wall that an effect narrows must be stored from farther away.
    let nearer_m = f64::from(description.effects.wall.narrowing.depth_m.max(0.0));
    let grid = LumenOptions::for_instrument(radius_m + nearer_m, options.cell_m);
    let (lumen, report) = vessel.lumen(grid)?;
    if let Some(too_large) = report.too_large {
        return Err(too_large.into());
    }

    let reach_m = f64::from(description.solver.reach_m(links));
    let mut settings = options.settings;
    settings.max_insertion_m = settings.max_insertion_m.min(reach_m as f32);
    let ImageOptions { master, band, .. } = *options;
    let head = ImageHead { description, lumen: lumen.header, settings, master, band };
    let mut image = vec![0; encoded_len(&head, &lumen.bytes)?];
    encode(&head, &lumen.bytes, &mut image)?;
    let report = ImageReport { bytes: image.len(), lumen: report, link_length_m, reach_m };
    Ok((image, report))
}
