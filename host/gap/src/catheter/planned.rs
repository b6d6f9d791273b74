//! A recording that has not been made yet: the protocol as a trial with encoders and no measurements.

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{CatheterTrial, GuidewireTrial, Trial, TrialData, VectorColumn};

use crate::planning::protocol::Protocol;

/// Rows a second where the rig states no rate, and of the tip.
const ROWS_HZ: f64 = 250.0;
const TIP_HZ: f64 = 25.0;

fn reading(row: usize) -> f64 {
    1e-9 * row as f64
}

/// Why a rig cannot be planned for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlannedError {
    #[error("a drive without an instrument has no protocol")]
    NoCatheter,
    #[error(
        "neither the noise of the force nor that of the tip is stated, so nothing can be said about \
         the size from which an effect is visible\n  fix: give force_noise_sd_N or tip_noise_sd_m under [sensor] in \
         rig.toml"
    )]
    NoNoise,
}

/// The bundle with the protocol in the place of its trials. A channel is there when rig.toml
/// states its noise; what it reads means nothing, but changes, as no dead sensor's reading does.
pub fn planned(bundle: &Bundle, protocol: &Protocol) -> Result<Bundle, PlannedError> {
    if bundle.catheter().is_none() {
        return Err(PlannedError::NoCatheter);
    }
    let sensor = &bundle.rig.sensor;
    let known = |noise: Option<f64>| noise.is_some_and(|sd| sd > 0.0);
    if !known(sensor.force_noise_sd_n) && !known(sensor.tip_noise_sd_m) {
        return Err(PlannedError::NoNoise);
    }
    let rate_hz = sensor.force_rate_hz.filter(|&hz| hz > 0.0).unwrap_or(ROWS_HZ);
    let rows = (protocol.duration_s() * rate_hz) as usize + 1;
    let tip_every = (rate_hz / TIP_HZ).round().max(1.0) as usize;
    let t_s: Vec<f64> = (0..rows).map(|row| row as f64 / rate_hz).collect();
    let at: Vec<_> = t_s.iter().map(|&t| protocol.at(t)).collect();
    let column = |is_there: bool, every: usize| -> Option<VectorColumn> {
        let row = |row: usize| row.is_multiple_of(every).then_some([reading(row); 3]);
        is_there.then(|| (0..rows).map(row).collect())
    };
    // A guidewire stays at the entry: the protocol is the catheter's.
    let wire = bundle.catheter().and_then(|rig| rig.guidewire.as_ref());
    let data = CatheterTrial {
        insertion_m: at.iter().map(|p| p.insertion_m).collect(),
        rotation_rad: at.iter().map(|p| p.rotation_rad).collect(),
        force_n: column(known(sensor.force_noise_sd_n), 1),
        drive_force_n: known(sensor.drive_noise_sd_n)
            .then(|| (0..rows).map(|row| Some(reading(row))).collect()),
        tip_m: column(known(sensor.tip_noise_sd_m), tip_every),
        shape_m: Vec::new(),
        guidewire: wire.map(|_| GuidewireTrial {
            insertion_m: vec![0.0; rows],
            rotation_rad: vec![0.0; rows],
            drive_force_n: None,
        }),
        // Tendons rest where each is taut in the straight instrument.
        tendons_m: vec![vec![0.0; rows]; bundle.catheter().map_or(0, |rig| rig.tendons.len())],
    };
    let trial = Trial { number: 0, t_s, data: TrialData::Catheter(data) };
    Ok(Bundle { trials: vec![trial], ..bundle.clone() })
}
