//! Origin and result of a recorded run.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use cathforce_bus::Counter;
use cathforce_bus::service::Status;
use cathforce_control::TICK_S;
use serde::Serialize;

use super::trial::SensorNoise;

/// Version of the format; recordings of another version are refused.
pub const FORMAT: &str = "cathforce-recording/3";

/// Everything about a run that is known before its first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RunInfo {
    /// Version of the host tool that recorded.
    pub host_version: String,
    /// The link's address, for example `qemu` or `socketcan:can0`.
    pub link: String,
    /// The board's own name.
    pub board: String,
    /// Version of the firmware.
    pub firmware_version: String,
    /// SHA-256 of the device's program if the host has it, else empty.
    pub firmware_sha256: String,
    /// Beginning of the recording, UTC since 1970 \[ns\]; 0 if unknown.
    pub started_unix_ns: u64,
    /// Hash of messages and frames that host and device agreed on.
    pub protocol: String,
    /// Whether SYNC frames granted every tick, which makes virtual time exact.
    pub lock_step: bool,
    /// The rig's name.
    pub rig: String,
    /// The trial that was played.
    pub trial: String,
    /// Origin of the measured columns, shown together with them.
    pub provenance: String,
    /// The rig's stated sensor noise.
    pub noise: SensorNoise,
    /// Length of a tick \[s\].
    pub tick_s: f64,
}

/// Entry of metadata with the checksum over all others: a recording that breaks off has no checksum over
/// the whole data.
pub(crate) const CHECKSUM: &str = "crc32";
/// Shortest and longest tick \[s\], and largest noise of a sensor \[N\] or \[m\], that can be meant.
const TICKS_S: RangeInclusive<f64> = 1e-6..=1.0;
const LARGEST_NOISE: f64 = 1e3;

/// The checksum over the entries of metadata, other than itself.
pub(crate) fn checksum_of(map: &BTreeMap<String, String>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for (key, value) in map.iter().filter(|(key, _)| *key != CHECKSUM) {
        // Lengths, so that no two maps have the same bytes.
        for text in [key, value] {
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        }
    }
    format!("{:08x}", hasher.finalize())
}

fn with_checksum(mut map: BTreeMap<String, String>) -> BTreeMap<String, String> {
    let checksum = checksum_of(&map);
    map.insert(CHECKSUM.to_owned(), checksum);
    map
}

const NOISE_FORCE: &str = "force_noise_sd_n";
const NOISE_DRIVE: &str = "drive_noise_sd_n";
const NOISE_TIP: &str = "tip_noise_sd_m";
const TICK: &str = "tick_s";

impl Default for RunInfo {
    fn default() -> Self {
        let text = String::new;
        Self {
            host_version: text(),
            link: text(),
            board: text(),
            firmware_version: text(),
            firmware_sha256: text(),
            started_unix_ns: 0,
            protocol: text(),
            lock_step: false,
            rig: text(),
            trial: text(),
            provenance: text(),
            noise: SensorNoise::default(),
            tick_s: f64::from(TICK_S),
        }
    }
}

impl RunInfo {
    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("format".to_owned(), FORMAT.to_owned()),
            ("host_version".to_owned(), self.host_version.clone()),
            ("link".to_owned(), self.link.clone()),
            ("board".to_owned(), self.board.clone()),
            ("firmware_version".to_owned(), self.firmware_version.clone()),
            ("firmware_sha256".to_owned(), self.firmware_sha256.clone()),
            ("started_unix_ns".to_owned(), self.started_unix_ns.to_string()),
            ("protocol".to_owned(), self.protocol.clone()),
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
        with_checksum(map)
    }

    /// `Err` says which entry is missing, is no number, or is one that cannot be meant.
    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, String> {
        let text = |key: &str| map.get(key).cloned().ok_or(format!("`{key}` is missing"));
        let number = |key: &str| {
            let value = text(key)?;
            value.parse::<f64>().map_err(|_| format!("`{key}` is no number: {value}"))
        };
        let within = |key: &str, range: RangeInclusive<f64>| {
            let value = number(key)?;
            match range.contains(&value) {
                true => Ok(value),
                false => {
                    Err(format!("`{key}` is {value}, not {} to {}", range.start(), range.end()))
                }
            }
        };
        let noise =
            |key: &str| map.contains_key(key).then(|| within(key, 0.0..=LARGEST_NOISE)).transpose();
        let lock_step = match text("lock_step")?.as_str() {
            "true" => true,
            "false" => false,
            other => return Err(format!("`lock_step` is neither true nor false: {other}")),
        };
        Ok(Self {
            host_version: text("host_version")?,
            link: text("link")?,
            board: text("board")?,
            firmware_version: text("firmware_version")?,
            firmware_sha256: text("firmware_sha256")?,
            started_unix_ns: started(&text("started_unix_ns")?)?,
            protocol: text("protocol")?,
            lock_step,
            rig: text("rig")?,
            trial: text("trial")?,
            provenance: text("provenance")?,
            noise: SensorNoise {
                force_n: noise(NOISE_FORCE)?,
                drive_force_n: noise(NOISE_DRIVE)?,
                tip_m: noise(NOISE_TIP)?,
            },
            tick_s: within(TICK, TICKS_S)?,
        })
    }
}

fn started(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("`started_unix_ns` is no number: {text}"))
}

/// What the device reported at the end of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
pub struct RunResult {
    /// Ticks since configuration.
    pub ticks: u32,
    /// Hash over every output of all these ticks.
    pub digest: u32,
    /// Ticks that began late or not at all.
    pub missed_ticks: u32,
    /// Instructions of the most expensive tick; 0 where the board cannot count them.
    pub worst_instructions: u32,
    /// Processor cycles of the most expensive tick; 0 where the board cannot count them.
    pub worst_cycles: u32,
    /// Number of the most expensive tick.
    pub worst_tick: u32,
    /// Deepest use of the stack \[bytes\]; 0 where it is not measured.
    pub stack_used_bytes: u32,
    /// Frames that the device rejected, whatever the reason.
    pub rejected_frames: u32,
    /// Time that the run took on the host \[ms\].
    pub wall_ms: u32,
}

impl RunResult {
    /// What a device's status says of a run that took so long on the host \[ms\].
    pub fn of(status: &Status, wall_ms: u32) -> Self {
        let good = [Counter::Accepted, Counter::AfterLoss];
        let rejected = Counter::FRAME_KINDS.into_iter().filter(|kind| !good.contains(kind));
        Self {
            ticks: status.tick,
            digest: status.digest,
            missed_ticks: status.load.missed_ticks,
            worst_instructions: status.load.worst_instructions,
            worst_cycles: status.load.worst_cycles,
            worst_tick: status.load.worst_tick,
            stack_used_bytes: status.load.stack_used_bytes,
            rejected_frames: rejected.map(|kind| status.counters.get(kind)).sum(),
            wall_ms,
        }
    }

    const KEYS: [&str; 9] = [
        "ticks",
        "digest",
        "missed_ticks",
        "worst_instructions",
        "worst_cycles",
        "worst_tick",
        "stack_used_bytes",
        "rejected_frames",
        "wall_ms",
    ];

    fn values(&mut self) -> [&mut u32; 9] {
        [
            &mut self.ticks,
            &mut self.digest,
            &mut self.missed_ticks,
            &mut self.worst_instructions,
            &mut self.worst_cycles,
            &mut self.worst_tick,
            &mut self.stack_used_bytes,
            &mut self.rejected_frames,
            &mut self.wall_ms,
        ]
    }

    pub(crate) fn to_map(mut self) -> BTreeMap<String, String> {
        let values = self.values().map(|value| value.to_string());
        with_checksum(Self::KEYS.map(str::to_owned).into_iter().zip(values).collect())
    }

    /// `Err` says which entry is missing or is no number.
    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, String> {
        let mut result = Self::default();
        for (key, value) in Self::KEYS.into_iter().zip(result.values()) {
            let text = map.get(key).ok_or(format!("`{key}` is missing"))?;
            *value = text.parse().map_err(|_| format!("`{key}` is no number: {text}"))?;
        }
        Ok(result)
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
    fn a_result_survives_its_map() {
        let result = RunResult { ticks: 1, digest: 2, wall_ms: 9, ..RunResult::default() };
        assert_eq!(RunResult::from_map(&result.to_map()), Ok(result));
        assert_eq!(RunResult::from_map(&BTreeMap::new()), Err("`ticks` is missing".into()));
    }

    #[test]
    fn what_is_missing_or_no_number_is_named() {
        let mut map = RunInfo::default().to_map();
        map.insert(TICK.into(), "fast".into());
        assert_eq!(RunInfo::from_map(&map), Err("`tick_s` is no number: fast".into()));
        for (key, value, says) in [
            (TICK, "NaN", "`tick_s` is NaN"),
            (TICK, "0", "`tick_s` is 0"),
            (NOISE_FORCE, "-1", "`force_noise_sd_n` is -1, not 0 to 1000"),
            ("lock_step", "tRue", "neither true nor false"),
        ] {
            let mut map = RunInfo::default().to_map();
            map.insert(key.into(), value.into());
            let error = RunInfo::from_map(&map).unwrap_err();
            assert!(error.contains(says), "{key} = {value}: {error}");
            assert_ne!(checksum_of(&map), map[CHECKSUM], "{key}");
        }
        map.remove("board");
        assert_eq!(RunInfo::from_map(&map), Err("`board` is missing".into()));
    }
}
