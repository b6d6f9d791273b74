//! A calibration in a file, which later imports read.

use super::calibrate::{Calibration, FORMAT};

impl Calibration {
    /// The text of the file.
    pub fn to_toml(&self) -> Result<String, String> {
        let text = toml::to_string_pretty(self).map_err(|e| e.to_string())?;
        Ok(format!("# Written by `cathforce import camera`. Lengths are in pixels.\n{text}"))
    }

    /// Reads the text of a file. `Err` says what is wrong, and where.
    pub fn parse(text: &str) -> Result<Self, String> {
        let found: Self = toml::from_str(text).map_err(|e| e.to_string())?;
        if found.format != FORMAT {
            return Err(format!("its format is `{}`, not `{FORMAT}`", found.format));
        }
        let lens = &found.lens;
        let numbers = lens.parameters();
        if numbers.iter().any(|x| !x.is_finite()) || lens.focal_px.iter().any(|f| *f <= 0.0) {
            return Err("a number of its lens is impossible".into());
        }
        Ok(found)
    }
}
