//! A rig, ready to be simulated.

use std::path::PathBuf;
use std::sync::Arc;

use cathforce_bundle::setting::unit;
use cathforce_bundle::tips::{TIPS, Tip};
use cathforce_bundle::{Bundle, ImageOptions, device_image, rig_description};
use cathforce_config::{Key, image, keys};
use cathforce_effect_catalogue::{Effect, Parameter, Plant, Role};
use cathforce_mechanics::{Description, MAX_LINKS, Real};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::{InputError, UsageError, of_bundle, of_image};
use crate::rig::{Double, Single};
use crate::row::Layout;
use crate::twin::Rig;

/// Rig, vessel and settings, ready to be simulated. It does not change, and any number of simulators share it.
#[pyclass(frozen, module = "cathforce")]
pub struct Model {
    pub rig: Rig,
    /// The device image, which also holds the vessel.
    image: Arc<[u8]>,
    /// What a copy in another process is made of.
    source: Source,
    name: String,
}

/// A function of Python and its arguments, which make a copy.
type Reduced<'py> = (Bound<'py, PyAny>, (PathBuf, Bound<'py, PyDict>));
/// Name, unit, smallest and largest value, default, description.
type SettingRow = (&'static str, String, f32, f32, Option<f32>, &'static str);

/// What a model was made of.
#[derive(Clone)]
struct Source {
    bundle: PathBuf,
    settings: Vec<(String, f64)>,
    double: bool,
    tip: Option<String>,
    guidewire_tip: Option<String>,
    link_length_m: Option<f64>,
}

fn options(source: &Source) -> PyResult<ImageOptions> {
    let mut options = ImageOptions { link_length_m: source.link_length_m, ..Default::default() };
    for (given, place) in
        [(&source.tip, &mut options.tip), (&source.guidewire_tip, &mut options.guidewire_tip)]
    {
        *place = given.as_deref().map(tip).transpose()?;
    }
    for (name, value) in &source.settings {
        options
            .set(name, *value as f32)
            .map_err(|error| UsageError::new_err(format!("settings: {error}")))?;
    }
    Ok(options)
}

fn tip(name: &str) -> PyResult<&'static Tip> {
    Tip::find(name).ok_or_else(|| {
        let names: Vec<&str> = TIPS.iter().map(|tip| tip.name).collect();
        UsageError::new_err(format!("there is no tip `{name}`\n  fix: one of {}", names.join(", ")))
    })
}

/// Named numbers of a dictionary.
pub fn named(settings: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, f64)>> {
    let mut found = Vec::new();
    for (name, value) in settings.into_iter().flatten() {
        let name: String = name.extract().map_err(|_| {
            UsageError::new_err("settings: a name is not a text\n  fix: {\"name\": number}")
        })?;
        let number = value.extract::<f64>().map_err(|_| {
            UsageError::new_err(format!(
                "settings: {name} must be a number, not {value}\n  fix: write a number"
            ))
        })?;
        found.push((name, number));
    }
    Ok(found)
}

impl Model {
    fn build(py: Python<'_>, source: Source) -> PyResult<Self> {
        let options = options(&source)?;
        let path = &source.bundle;
        // Reading and the lumen take seconds.
        let (bundle, image, rig) = py.detach(|| {
            let bundle = Bundle::open(path).map_err(|error| of_bundle(&error))?;
            let refused = |error| of_image(path, &error);
            let (image, report) = device_image(&bundle, &options).map_err(refused)?;
            let image: Arc<[u8]> = image.into();
            let input = |error| InputError::new_err(format!("{}: {error}", path.display()));
            let rig = if source.double {
                let link_length_m = Some(report.link_length_m);
                let options = ImageOptions { link_length_m, ..options.clone() };
                let description = rig_description::<f64>(&bundle, &options).map_err(refused)?;
                let made = Double::new(image.clone(), description).map_err(input)?;
                Rig::Double(Arc::new(made))
            } else {
                Rig::Single(Arc::new(Single::new(image.clone()).map_err(input)?))
            };
            Ok::<_, PyErr>((bundle, image, rig))
        })?;
        let category = py.import("cathforce.errors")?.getattr("CathforceWarning")?;
        for warning in &bundle.warnings {
            let text = std::ffi::CString::new(warning.to_string().replace('\0', " "))?;
            PyErr::warn(py, &category, &text, 1)?;
        }
        Ok(Self { rig, image, source, name: bundle.rig.name })
    }

    pub fn layout(&self) -> Layout {
        self.rig.layout()
    }
}

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (bundle, *, settings=None, dtype="float32", tip=None, guidewire_tip=None, link_length_m=None))]
    fn new(
        py: Python<'_>,
        bundle: PathBuf,
        settings: Option<&Bound<'_, PyDict>>,
        dtype: &str,
        tip: Option<String>,
        guidewire_tip: Option<String>,
        link_length_m: Option<f64>,
    ) -> PyResult<Self> {
        let double = match dtype {
            "float32" | "f32" => false,
            "float64" | "f64" => true,
            other => {
                let message =
                    format!("dtype `{other}`\n  fix: \"float32\", as the device, or \"float64\"");
                return Err(UsageError::new_err(message));
            }
        };
        if let Some(length_m) = link_length_m.filter(|m| !(1e-4..=2e-2).contains(m)) {
            let message =
                format!("link_length_m = {length_m} m\n  fix: give metres, from 0.0001 to 0.02");
            return Err(UsageError::new_err(message));
        }
        let settings = named(settings)?;
        Self::build(py, Source { bundle, settings, double, tip, guidewire_tip, link_length_m })
    }

    /// Name of the rig.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Folder of the bundle.
    #[getter]
    fn bundle(&self) -> PathBuf {
        self.source.bundle.clone()
    }

    /// ``"float32"`` or ``"float64"``.
    #[getter]
    fn dtype(&self) -> &'static str {
        if self.rig.is_double() { "float64" } else { "float32" }
    }

    /// Names of the drives' positions, in the order of the columns of an array.
    #[getter]
    fn columns(&self) -> Vec<&'static str> {
        self.layout().columns()
    }

    /// The longest insertion that the links reach \[m\].
    #[getter]
    fn reach_m(&self) -> f64 {
        self.rig.reach_m()
    }

    /// Time of a tick \[s\].
    #[getter]
    fn tick_s(&self) -> f64 {
        match &self.rig {
            Rig::Single(rig) => f64::from(rig.config().model.description().solver.tick_s),
            Rig::Double(rig) => rig.config().model.description().solver.tick_s,
        }
    }

    /// Largest number of links, and of nodes, inside the vessel.
    #[classattr]
    const MAX_LINKS: usize = MAX_LINKS;

    /// Centre of the guide's mouth, (3,) \[m\].
    #[getter]
    fn entry_position_m(&self) -> [f64; 3] {
        match &self.rig {
            Rig::Single(rig) => rig.config().model.description().entry.position_m.map(f64::from),
            Rig::Double(rig) => rig.config().model.description().entry.position_m,
        }
    }

    /// Unit vector of insertion, (3,).
    #[getter]
    fn entry_direction(&self) -> [f64; 3] {
        match &self.rig {
            Rig::Single(rig) => rig.config().model.description().entry.direction.map(f64::from),
            Rig::Double(rig) => rig.config().model.description().entry.direction,
        }
    }

    /// The device image, which `cathforce run` sends to a board.
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.image)
    }

    /// Value of a setting.
    fn value(&self, name: &str) -> PyResult<f64> {
        let key = Key::find(name).ok_or_else(|| {
            let (message, fix) =
                cathforce_bundle::setting::check(name, 0.0).err().unwrap_or_default();
            UsageError::new_err(format!("{message}\n  fix: {fix}"))
        })?;
        let found = match &self.rig {
            Rig::Single(rig) => {
                let config = rig.config();
                key.value(config.model.description(), &config.settings).map(f64::from)
            }
            Rig::Double(rig) => match key {
                Key::Parameter(info) => rig.config().model.description().parameter(info.key),
                Key::Setting(info) => {
                    let config = image::decode(&self.image)
                        .map_err(|error| InputError::new_err(error.to_string()))?;
                    config.settings.get(info.name).map(f64::from)
                }
            },
        };
        found.ok_or_else(|| UsageError::new_err(format!("{name} has no value in this rig")))
    }

    /// The effects of the catalogue that this rig can have: identifier, names of the coordinates of its place, and
    /// plausible sizes, each as names with the value without the effect and with it.
    fn effects(&self) -> Vec<CataloguedEffect> {
        match &self.rig {
            Rig::Single(rig) => catalogued(rig.config().model.description()),
            Rig::Double(rig) => catalogued(rig.config().model.description()),
        }
    }

    /// Makes the model again in another process, of the same bundle.
    fn __reduce__<'py>(slf: &Bound<'py, Self>, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let Source { bundle, settings, tip, guidewire_tip, link_length_m, .. } = &slf.get().source;
        let keywords = PyDict::new(py);
        let of_settings = PyDict::new(py);
        for (name, value) in settings {
            of_settings.set_item(name, value)?;
        }
        keywords.set_item("settings", of_settings)?;
        keywords.set_item("dtype", slf.get().dtype())?;
        keywords.set_item("tip", tip)?;
        keywords.set_item("guidewire_tip", guidewire_tip)?;
        keywords.set_item("link_length_m", link_length_m)?;
        let make = py.import("cathforce._pickling")?.getattr("model")?;
        Ok((make, (std::path::absolute(bundle)?, keywords)))
    }

    fn __repr__(&self) -> String {
        format!("<cathforce.Model {}>", self.shown())
    }
}

impl Model {
    pub fn shown(&self) -> String {
        format!("{} in {}", self.name, self.dtype())
    }
}

/// Identifier, keys of its place, plausible sizes.
type CataloguedEffect = (&'static str, Vec<&'static str>, Vec<Vec<(&'static str, f64, f64)>>);

fn catalogued<T: Real>(nominal: &Description<T>) -> Vec<CataloguedEffect> {
    let can_have = |effect: &Effect, sizes: &[Vec<(&'static str, f64, f64)>]| {
        sizes.iter().all(|size| {
            let mut with = nominal.clone();
            let mut set =
                size.iter().map(|(key, _, value)| with.set_parameter(key, T::lit(*value)));
            effect.plant == Plant::Catheter && set.all(|set| set.is_ok())
        })
    };
    let effects = cathforce_effect_catalogue::all().filter_map(|effect| {
        let size = |start: &Vec<f64>| {
            let values = effect.start(nominal, start);
            let of = |(own, value): (&'static Parameter, T)| {
                (own.key, own.off(nominal).map_or(0.0, |off| off.to_f64()), value.to_f64())
            };
            values.into_iter().map(of).collect::<Vec<_>>()
        };
        let sizes: Vec<_> = effect.starts().iter().map(size).filter(|s| !s.is_empty()).collect();
        let place = effect.parameters.iter().filter(|own| own.role == Role::Place);
        let place = place.map(|own| own.key).collect();
        (can_have(effect, &sizes) && !sizes.is_empty()).then_some((effect.id, place, sizes))
    });
    effects.collect()
}

/// Every setting: name, unit, smallest and largest value, default or None, description.
#[pyfunction]
pub fn settings() -> Vec<SettingRow> {
    let row = |key: Key| {
        let [min, max] = key.range();
        (key.name(), unit(key).trim().to_owned(), min, max, key.default(), key.doc())
    };
    keys().map(row).collect()
}
