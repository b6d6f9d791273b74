// Numbers with units, and identifiers in words.

/** A number with so many digits; a dash where there is none. */
export function number(value, digits) {
  return value === null || value === undefined || Number.isNaN(value) ? "–" : value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1");
}

/** A quantity in a unit with a prefix that keeps three digits. */
export function quantity(value, unit) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const name = unit === "1" || !unit ? "" : unit;
  const scaled = { N: [1e3, "mN"], m: [1e3, "mm"], s: [1, "s"], "N·m": [1e3, "mN·m"] }[name];
  const [factor, shown] = scaled && Math.abs(value) < 1 ? scaled : [1, name];
  return `${significant(value * factor)}${shown ? " " + shown : ""}`;
}

/** Three significant digits, without an exponent where that can be read. */
export function significant(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(2);
  return String(Number(value.toPrecision(3)));
}

/** A share with two digits. */
export const percent = (share) => (share === null || share === undefined || !Number.isFinite(share) ? "–" : `${significant(Number((100 * share).toPrecision(2)))} %`);

/** Seconds as minutes and seconds. */
export function clock(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const whole = Math.abs(seconds), minutes = Math.floor(whole / 60);
  return `${seconds < 0 ? "-" : ""}${minutes}:${(whole - 60 * minutes).toFixed(2).padStart(5, "0")}`;
}

const CHANNELS = {
  fx_N: "force on the vessel along x", fy_N: "force on the vessel along y", fz_N: "force on the vessel along z",
  drive_fx_N: "force behind the guide", drive_torque_N_m: "torque behind the guide",
  tip_x_m: "tip along x", tip_y_m: "tip along y", tip_z_m: "tip along z",
};

const EFFECTS = {
  "drive.ripple": "ripple of the drive", "drive.slip": "slip of the drive", "drive.backlash": "backlash of the drive",
  "drive.encoder_scale": "scale of the encoder", "drive.latency": "delay of the drive", "drive.coulomb": "dry friction of the drive",
  "drive.viscous": "viscous friction of the drive", "drive.stribeck": "Stribeck friction of the drive",
  "drive.load_friction": "friction of the drive under load", "drive.offset": "offset of the drive",
  "entry.drag": "drag at the entry", "entry.guide": "the guide at the entry",
  "contact.friction": "friction at the wall", "contact.stribeck": "Stribeck friction at the wall",
  "contact.load_friction": "friction at the wall under load",
  "wall.stiffness": "stiffness of the wall", "wall.hyperelastic": "stiffening of the wall", "wall.viscoelastic": "viscosity of the wall",
  "wall.motion": "motion of the wall", "wall.registration": "place of the vessel", "wall.narrowing": "a narrowing of the vessel",
  "instrument.stiffness": "stiffness of the catheter", "instrument.stored_curvature": "stored curvature of the catheter",
  "instrument.tip_precurve": "curve of the tip", "instrument.torsional_windup": "windup of the catheter",
  "instrument.viscoelastic": "viscosity of the catheter", "instrument.softening": "softening of the catheter",
  "instrument.weight": "weight of the catheter", "tendon.friction": "friction of a tendon", "tendon.slack": "slack of a tendon",
  "fluid.drag": "drag of the fluid", "sensor.bias": "bias of the sensor", "sensor.drift": "drift of the sensor",
  "sensor.gain": "gain of the sensor", "sensor.misalignment": "misalignment of the sensor", "sensor.time_constant": "lag of the sensor",
};

const words = (id) => id.replace(/^.*\./, "").replaceAll("_", " ");

export const channel = (id) => CHANNELS[id] ?? words(id);
export const effect = (id) => EFFECTS[id] ?? words(id);
/** The unit at the end of a parameter's identifier stands beside its value. */
export const parameter = (id) => words(id.replace(/_(s|m|n|rad|n_m|per_m|m_per_s)$/, ""));

/** A sentence begins with a capital. */
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
