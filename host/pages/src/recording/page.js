// Fills the page from the embedded data.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const element = (id) => document.getElementById(id);
const make = (parent, tag, text, name) => {
  const child = parent.appendChild(document.createElement(tag));
  if (text !== undefined) child.textContent = text;
  if (name) child.className = name;
  return child;
};
/** Little-endian numbers from base64; the page's hosts are little-endian. */
const unpack = (text, Kind) => new Kind(Uint8Array.from(atob(text), (ch) => ch.charCodeAt(0)).buffer);
const floats = (text) => unpack(text, Float32Array);

element("title").textContent = data.title;
element("subtitle").textContent = data.subtitle;
element("provenance").textContent = data.provenance;
for (const { label, value, unit: of, note, verdict } of data.tiles) {
  const tile = make(element("tiles"), "div", undefined, `tile ${verdict}`);
  make(tile, "div", label, "label");
  make(make(tile, "div", value, "value"), "span", of, "unit");
  make(tile, "div", note, "note");
}
for (const { section, rows } of data.facts) {
  const head = make(element("facts"), "tr", undefined, "section");
  make(head, "td", section).colSpan = 2;
  for (const [label, value] of rows) {
    const row = make(element("facts"), "tr");
    make(row, "td", label); make(row, "td", value);
  }
}
for (const line of data.footnotes) make(element("footer"), "p", line);

// Charts.
// Colours are names of the style's variables, so that they follow the browser's light or dark scheme.
const MEASURED = "--measured", ESTIMATED = "--estimated", ERROR = "--error";
const estimated = { t: floats(data.estimated.t), y: data.estimated.y.map(floats) };
const measured = data.measured && { t: floats(data.measured.t), y: data.measured.y.map((y) => y && floats(y)) };
const finite = (t, y) => {
  const keep = [...t.keys()].filter((i) => Number.isFinite(y[i]));
  return { t: Float32Array.from(keep, (i) => t[i]), y: Float32Array.from(keep, (i) => y[i]) };
};
const band = data.band && { t: floats(data.band.t), low: data.band.low.map(floats), high: data.band.high.map(floats) };
const shared = {
  from: estimated.t[0], to: estimated.t[estimated.t.length - 1],
  bands: data.unscored.map(([from, to, snap]) => ({ from, to, colour: snap ? "--snap" : "--unscored" })),
  onSeek: (t) => seek(t),
};
const charts = data.charts.map(({ title, axis, unit: of, digits, channel, error, line: name }) => {
  const lines = [];
  const area = !error && band?.low[channel] && { t: band.t, low: band.low[channel], high: band.high[channel], colour: ESTIMATED };
  if (error) {
    lines.push({ name: "estimated − measured", colour: ERROR, width: 1.2, ...unpackError(error) });
  } else {
    if (measured?.y[channel]) {
      const line = finite(measured.t, measured.y[channel]);
      if (line.t.length) lines.push({ name: "measured", colour: MEASURED, width: 1, ...line });
    }
    lines.push({ name, colour: ESTIMATED, width: 1.7, ...finite(estimated.t, estimated.y[channel]) });
  }
  return new Chart(element("charts"), { title, axis, unit: of, digits, lines, area, zero: Boolean(error) }, shared);
});
function unpackError({ t, y }) { return { t: floats(t), y: floats(y) }; }

// Scene.
const shape = {
  t: floats(data.shape.t), count: unpack(data.shape.count, Uint16Array),
  position: unpack(data.shape.position, Int16Array), force: unpack(data.shape.force, Uint16Array),
  bare: data.shape.bare && floats(data.shape.bare),
};
const first = [0];
for (const n of shape.count) first.push(first[first.length - 1] + n);
const full = data.shape.full_scale_mn;
let scene = null;
try {
  const v = data.vessel;
  scene = new Scene(element("vessel"), {
    vertices: Float32Array.from(unpack(v.vertices, Int16Array), (x, i) => data.shape.entry_mm[i % 3] + x * 0.02),
    normals: Float32Array.from(unpack(v.normals, Int8Array), (x) => x / 127),
    indices: unpack(v.indices, Uint32Array),
  }, data.shape.radius_mm, data.shape.guidewire_radius_mm);
  scene.onDraw = scaleBar;
} catch (error) {
  make(element("vessel").parentElement, "p", `No 3-D view: ${error.message}.`, "scale");
}

function showShape(t) {
  const i = indexAt(shape.t, t), points = [], shares = [];
  let peak = 0, node = 0;
  for (let j = first[i]; j < first[i + 1]; j++) {
    points.push([0, 1, 2].map((k) => data.shape.entry_mm[k] + shape.position[3 * j + k] * 0.02));
    const force = shape.force[j] * 0.1;
    shares.push(force / full);
    if (force > peak) { peak = force; node = j - first[i]; }
  }
  if (scene && points.length) {
    // From the last node back to the guide's mouth; a node that is at the mouth gives way to it.
    const gap = Math.hypot(...[0, 1, 2].map((k) => points[points.length - 1][k] - data.shape.entry_mm[k]));
    if (gap < 1 && points.length > 1) { points.pop(); shares.pop(); }
    points.push(data.shape.entry_mm); shares.push(0);
    scene.setCatheter(points, shares, shape.bare ? shape.bare[i] : 0);
  }
  const at = indexAt(estimated.t, t), y = (k) => estimated.y[k][at];
  element("readout").replaceChildren();
  const rows = [
    ["insertion", `${y(4).toFixed(1)} mm`], ["rotation", `${y(5).toFixed(0)}°`],
    ...(shape.bare ? [["guidewire", `${y(7).toFixed(1)} mm, ${y(8).toFixed(0)}°`]] : []),
    ["force on the vessel", `${Math.hypot(y(0), y(1), y(2)).toFixed(0)} mN`],
    ["largest at a node", `${peak.toFixed(0)} mN, node ${node}`],
  ];
  for (const [label, value] of rows) { make(element("readout"), "dt", label); make(element("readout"), "dd", value); }
}

function colourBar() {
  const bar = element("bar"), c = bar.getContext("2d");
  for (let y = 0; y < bar.height; y++) {
    c.fillStyle = `rgb(${colourOf(1 - y / bar.height).map((x) => Math.round(255 * x))})`;
    c.fillRect(0, y, bar.width, 1);
  }
  element("bar-title").textContent = "contact force at a node [mN]";
  for (const v of niceTicks(0, full, 5).ticks) {
    const tick = make(element("bar-ticks"), "i", v.toFixed(0));
    tick.style.bottom = `${v / full * bar.height}px`;
  }
}

function scaleBar() {
  const mm = [1, 2, 5, 10, 20, 50, 100].find((x) => x * scene.pixelPerMm >= 60) ?? 100;
  const box = element("scale");
  box.replaceChildren();
  make(box, "b").style.width = `${mm * scene.pixelPerMm}px`;
  box.append(`${mm} mm`);
}

// Time.
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach((chart) => chart.draw()));
const slider = element("slider");
let playing = null;
slider.min = shared.from; slider.max = shared.to;
slider.addEventListener("input", () => seek(Number(slider.value)));
function seek(t) {
  slider.value = t;
  element("clock").textContent = `${t.toFixed(2)} s of ${shared.to.toFixed(2)} s`;
  for (const chart of charts) chart.seek(t);
  showShape(t);
}
function step(now) {
  if (!playing) return;
  let t = playing.from + (now - playing.since) / 1000;
  if (t >= shared.to) { t = shared.to; play(false); }
  seek(t);
  if (playing) requestAnimationFrame(step);
}
function play(on) {
  const from = Number(slider.value) >= shared.to ? shared.from : Number(slider.value);
  playing = on ? { from, since: performance.now() } : null;
  element("play").textContent = on ? "Pause" : "Play";
  if (on) requestAnimationFrame(step);
}
element("play").addEventListener("click", () => play(!playing));
colourBar();
seek(data.start_s);
