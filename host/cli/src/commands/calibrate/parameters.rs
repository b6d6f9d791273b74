//! From names to parameters with their bounds.

use cathforce_bundle::nearest;
use cathforce_config::Key;
use cathforce_effect_catalogue::{Effect, Plant, all};
use cathforce_gap::catheter::{Known, Wanted};
use cathforce_mechanics::parameters;

use super::data::Data;
use super::fit::Fit;
use crate::args::Asked;
use crate::failure::{Code, Failure};

/// Standard deviations of its prior that a parameter is searched on either side of what the rig states.
const BOUNDS_SD: f64 = 4.0;
/// Of a parameter without a prior: this share of its range.
const UNKNOWN_SHARE: f64 = 0.1;
/// Names that say how the model is computed, not what it is.
const SOLVER: &str = "solver.";

/// The parameters that are asked for; the error names all that cannot be fitted.
pub fn wanted(data: &Data, asked: &[Asked]) -> Result<Vec<Fit>, Failure> {
    let (mut found, mut wrong): (Vec<Fit>, Vec<String>) = (Vec::new(), Vec::new());
    for Asked { name, bounds } in asked {
        let keys = match keys(name) {
            Ok(keys) => keys,
            Err(message) => {
                wrong.push(message);
                continue;
            }
        };
        if keys.len() > 1 && bounds.is_some() {
            wrong.push(format!(
                "{name} is an effect with several parameters, which have bounds of their own\n  fix: name \
                 them one by one: {}",
                keys.join(", ")
            ));
            continue;
        }
        for key in keys {
            // An effect beside one of its parameters: the parameter's own bounds count.
            if let Some(own) = found.iter().find(|own| own.wanted.key == key) {
                match bounds {
                    None => continue,
                    Some(_) if own.own_bounds => {
                        wrong.push(format!("{key} is named twice\n  fix: name it once"));
                        continue;
                    }
                    Some(_) => {}
                }
            }
            let Some(known) = data.known(key)? else {
                wrong.push(format!("this rig has no {key}\n  fix: leave it out"));
                continue;
            };
            match fit(key, &known, *bounds) {
                Ok(fit) => {
                    found.retain(|own| own.wanted.key != key);
                    found.push(fit);
                }
                Err(message) => wrong.push(message),
            }
        }
    }
    if wrong.is_empty() { Ok(found) } else { Err(Failure::new(Code::Usage, wrong.join("\n"))) }
}

/// Keys of the settings that a name stands for: of an effect all that a fit changes.
fn keys(name: &str) -> Result<Vec<&'static str>, String> {
    let settings = || parameters().map(|info| info.key).filter(|key| !key.starts_with(SOLVER));
    if let Some(key) = settings().find(|key| *key == name) {
        return Ok(vec![key]);
    }
    let effects = || all().filter(|effect| effect.plant == Plant::Catheter);
    if let Some(effect) = effects().find(|effect| effect.id == name) {
        let fitted = effect.parameters.iter().filter(|parameter| parameter.is_fitted());
        return Ok(fitted.map(|parameter| parameter.key).collect());
    }
    if Key::find(name).is_some() {
        return Err(format!(
            "{name} is a setting of the device that changes no prediction of its model, so it cannot be \
             fitted\n  fix: set it with `cathforce config set`"
        ));
    }
    let known: Vec<&str> = settings().chain(effects().map(|effect| effect.id)).collect();
    let hint = nearest(name, &known).map(|near| format!(", did you mean `{near}`?"));
    Err(format!(
        "there is no setting or effect `{name}`{}\n  fix: `cathforce config list` lists settings, \
         `cathforce gap effects` effects",
        hint.unwrap_or_default()
    ))
}

fn fit(key: &'static str, known: &Known, bounds: Option<(f64, f64)>) -> Result<Fit, String> {
    let Known { info, nominal, scale, .. } = *known;
    let scale = scale.unwrap_or(UNKNOWN_SHARE * (info.max - info.min));
    let reach = BOUNDS_SD * scale;
    let usual = ((nominal - reach).max(info.min), (nominal + reach).min(info.max));
    let (low, high) = bounds.unwrap_or(usual);
    if low < info.min || high > info.max {
        let unit = if info.unit == "1" { String::new() } else { format!(" {}", info.unit) };
        return Err(format!(
            "{key}={low}..{high}: the model takes {} to {}{unit}\n  fix: narrow the bounds",
            info.min, info.max
        ));
    }
    // Who gives bounds knows no more than that it lies between them.
    let scale = if bounds.is_some() { 0.5 * (high - low) } else { scale };
    let start = if (low..=high).contains(&nominal) { nominal } else { 0.5 * (low + high) };
    let wanted = Wanted { key, low, high, scale };
    Ok(Fit { wanted, start, info, own_bounds: bounds.is_some() })
}

/// The motion that shows a setting, from the catalogue.
pub fn excited_by(key: &str) -> Option<&'static str> {
    owner(key).map(|effect| effect.excited_by)
}

/// The effect that a setting belongs to.
pub fn owner(key: &str) -> Option<&'static Effect> {
    all().find(|effect| effect.parameters.iter().any(|parameter| parameter.key == key))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_setting_or_an_effect_and_a_slip_has_its_neighbour() {
        assert_eq!(keys("wall.friction_coefficient").unwrap(), ["wall.friction_coefficient"]);
        assert_eq!(keys("contact.friction").unwrap(), ["wall.friction_coefficient"]);
        assert_eq!(keys("instrument.stiffness").unwrap().len(), 2);
        for (name, said) in [
            ("wall.frction_coefficient", "did you mean `wall.friction_coefficient`?"),
            ("contact.frictoin", "did you mean `contact.friction`?"),
            ("force_gain", "changes no prediction"),
            ("solver.solves", "changes no prediction"),
            ("nothing.like.it", "`cathforce gap effects` effects"),
        ] {
            let message = keys(name).unwrap_err();
            assert!(message.contains(said) && message.contains("fix: "), "{message}");
        }
    }

    #[test]
    fn bounds_are_the_priors_unless_somebody_gives_others() {
        let info = parameters().find(|info| info.key == "wall.friction_coefficient").unwrap();
        let known = Known { info, nominal: 0.3, scale: Some(0.15), effect: None };
        let usual = fit(info.key, &known, None).map_err(drop).unwrap();
        assert_eq!((usual.wanted.low, usual.wanted.scale, usual.start), (0.0, 0.15, 0.3));
        assert!((usual.wanted.high - 0.9).abs() < 1e-12);
        let own = fit(info.key, &known, Some((0.5, 0.7))).map_err(drop).unwrap();
        assert_eq!((own.wanted.low, own.wanted.high, own.start), (0.5, 0.7, 0.6));
        assert!((own.wanted.scale - 0.1).abs() < 1e-12);
        let wide = fit(info.key, &known, Some((-1.0, 0.7))).err().unwrap();
        assert!(wide.contains("takes 0 to 2"), "{wide}");
    }
}
