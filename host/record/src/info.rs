//! Where a recording comes from.

use std::collections::BTreeMap;

use crate::trial::SensorNoise;

/// Version of what recordings hold; another one is refused.
pub const FORMAT: &str = "cathforce-recording/1";

/// Where a recording comes from: everything that is known before the first frame.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct RunInfo {
    /// Version of the host tool that recorded.
    pub host_version: String,
    /// The link as it was asked for, e.g. `qemu` or `socketcan:can0`.
    pub link: String,
    /// The board's name for itself.
    pub board: String,
    /// Version of the firmware.
    pub firmware_version: String,
    /// Hash of the firmware's code, as the board states it.
    pub firmware_hash: String,
    /// Whether SYNC frames granted every tick, which makes virtual time exact.
    pub lock_step: bool,
    /// The rig's name.
    pub rig: String,
    /// The trial that was played.
    pub trial: String,
    /// Where the measured columns come from, shown wherever they are shown.
    pub provenance: String,
    /// The rig's stated sensor noise.
    pub noise: SensorNoise,
    /// Length of a tick \[s\].
    pub tick_s: f64,
}

const NOISE_FORCE: &str = "force_noise_sd_n";
const NOISE_DRIVE: &str = "drive_noise_sd_n";
const NOISE_TIP: &str = "tip_noise_sd_m";
const TICK: &str = "tick_s";

impl RunInfo {
    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("format".to_owned(), FORMAT.to_owned()),
            ("host_version".to_owned(), self.host_version.clone()),
            ("link".to_owned(), self.link.clone()),
            ("board".to_owned(), self.board.clone()),
            ("firmware_version".to_owned(), self.firmware_version.clone()),
            ("firmware_hash".to_owned(), self.firmware_hash.clone()),
            ("lock_step".to_owned(), self.lock_step.to_string()),
            ("rig".to_owned(), self.rig.clone()),
            ("trial".to_owned(), self.trial.clone()),
            ("provenance".to_owned(), self.provenance.clone()),
            (TICK.to_owned(), self.tick_s.to_string()),
        ]);
        let optional = [
            (NOISE_FORCE, self.noise.force_n),
            (NOISE_DRIVE, self.noise.drive_force_n),
            (NOISE_TIP, self.noise.tip_m),
        ];
        for (key, value) in optional {
            map.extend(value.map(|x| (key.to_owned(), x.to_string())));
        }
        map
    }

    /// `Err` says which entry is missing or is no number.
    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, String> {
        let text = |key: &str| map.get(key).cloned().ok_or(format!("`{key}` is missing"));
        let number = |key: &str| {
            let value = text(key)?;
            value.parse::<f64>().map_err(|_| format!("`{key}` is no number: {value}"))
        };
        let optional = |key: &str| map.contains_key(key).then(|| number(key)).transpose();
        Ok(Self {
            host_version: text("host_version")?,
            link: text("link")?,
            board: text("board")?,
            firmware_version: text("firmware_version")?,
            firmware_hash: text("firmware_hash")?,
            lock_step: text("lock_step")? == "true",
            rig: text("rig")?,
            trial: text("trial")?,
            provenance: text("provenance")?,
            noise: SensorNoise {
                force_n: optional(NOISE_FORCE)?,
                drive_force_n: optional(NOISE_DRIVE)?,
                tip_m: optional(NOISE_TIP)?,
            },
            tick_s: number(TICK)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn info_survives_its_map() {
        let noise = SensorNoise { force_n: Some(0.01), drive_force_n: Some(0.02), tip_m: None };
        let info = RunInfo { link: "sim".into(), lock_step: true, noise, ..RunInfo::default() };
        assert_eq!(RunInfo::from_map(&info.to_map()), Ok(info));
    }

    #[test]
    fn what_is_missing_or_no_number_is_named() {
        let mut map = RunInfo::default().to_map();
        map.insert(TICK.into(), "fast".into());
        assert_eq!(RunInfo::from_map(&map), Err("`tick_s` is no number: fast".into()));
        map.remove("board");
        assert_eq!(RunInfo::from_map(&map), Err("`board` is missing".into()));
    }
}
