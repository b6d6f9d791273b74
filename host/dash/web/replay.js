// A recording: its time, its marks, and pictures and films of it.

import { nearest } from "./charts.js";
import { card, download, el, facts, say } from "./dom.js";
import { clock, number } from "./format.js";
import { floats, shorts, words } from "./scene.js";
import { Series } from "./series.js";

/** A measured row is drawn until the next one, if that comes within this time [s]. */
const MEASURED_WITHIN = 0.1;

/** A recording as the views need it. */
export class Recording {
  constructor(data) {
    Object.assign(this, { title: data.title, provenance: data.provenance, complete: data.complete, rows: data.rows, faults: data.faults, stages: data.stages, result: data.result, dropouts: data.dropouts, lock_step: data.lock_step });
    this.series = new Series();
    this.series.t = floats(data.t_s);
    const measured = { t: floats(data.measured.t_s), forces: data.measured.forces.map(floats) };
    const rowOf = Int32Array.from(this.series.t, (t) => {
      if (measured.t.length === 0 || t < measured.t[0]) return -1;
      const row = nearest(measured.t, t);
      return t - measured.t[row] < MEASURED_WITHIN ? row : -1;
    });
    this.hasMeasured = measured.forces.some((column) => column.some((x) => !Number.isNaN(x)));
    const overlay = measured.forces.map((column) => Float32Array.from(rowOf, (row) => (row < 0 ? NaN : column[row])));
    // The bus carries some quantities every few ticks: they hold until they come again.
    const held = (column) => { let last = NaN; return column.map((x) => (Number.isNaN(x) ? last : (last = x))); };
    this.series.columns = [...data.forces.map(floats).map(held), ...overlay, ...data.bands.map(floats).map(held).map((column) => column.map((x) => (x < 0 ? NaN : x)))];
    this.insertion = held(floats(data.insertion_m));
    this.rotation = held(floats(data.rotation_rad));
    this.tick = data.tick;
    this.mode = data.mode.map((code) => data.modes[code]);
    this.shapes = { t: floats(data.shape.t_s), count: words(data.shape.count), position: shorts(data.shape.position), force: shorts(data.shape.force) };
    let from = 0;
    this.shapes.from = Array.from(this.shapes.count, (count) => { const at = from; from += 3 * count; return at; });
    this.start = this.series.t[0] ?? 0;
    this.end = this.series.t[this.series.t.length - 1] ?? 0;
  }

  /** Everything at a time. */
  frame(t) {
    if (this.series.t.length === 0) return { shape: { at: [], force: [] } };
    const i = nearest(this.series.t, t), value = (k) => this.series.column(k, i);
    const fault = this.faults.find((f) => f.first_s <= t && t <= f.last_s + 1e-3);
    const { t: times, count, from, position, force } = this.shapes;
    let shape = { at: [], force: [], from: "host" };
    if (times.length && t >= times[0] - 0.05) {
      const k = nearest(times, t);
      shape = { from: "host", at: Float32Array.from(position.subarray(from[k], from[k] + 3 * count[k]), (x) => x * 0.02), force: Float32Array.from(force.subarray(from[k], from[k] + 3 * count[k]), (x) => x * 1e-4) };
    }
    return {
      t, mode: this.mode[i], armed: this.mode[i] === "armed", tick: this.tick[i], faults: fault ? [{ ...fault, active: true }] : [],
      forces: { norm_N: this.series.vector(0, i, null), drive_fx_N: value(3) },
      insertion_m: this.insertion[i], rotation_rad: this.rotation[i], shape,
    };
  }
}

/** The bar under the tabs: play, scrub, speed. */
export class Transport {
  constructor(root, app) {
    this.app = app;
    const { start, end } = app.recording;
    this.play = el("button", { type: "button", id: "play", onclick: () => this.toggle() }, "Play");
    this.slider = el("input", { type: "range", id: "scrub", min: start, max: end, step: "any", value: start, "aria-label": "Time of the recording", oninput: () => this.go(Number(this.slider.value)) });
    this.speed = el("select", { id: "speed", "aria-label": "Speed" }, [0.1, 0.25, 0.5, 1, 2, 5, 10, 50].map((x) => el("option", { value: x, selected: x === 1 }, `${x}×`)));
    this.clock = el("output", { id: "clock" });
    const step = (seconds, text, label) => el("button", { type: "button", "aria-label": label, onclick: () => this.go(app.t + seconds) }, text);
    root.replaceChildren(this.play, step(-0.01, "−10 ms", "−10 ms: back by 10 milliseconds"), step(0.01, "+10 ms", "+10 ms: on by 10 milliseconds"), this.slider, this.clock, this.speed);
    root.className = "transport";
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.app.t >= this.app.recording.end) this.app.t = this.app.recording.start;
    this.last = null;
    say(this.play, this.playing ? "Pause" : "Play");
    this.app.redraw();
  }

  go(t) {
    const { start, end } = this.app.recording;
    this.app.t = Math.min(end, Math.max(start, t));
    this.app.redraw();
  }

  /** Time goes on by so much as has passed. */
  advance(now) {
    if (this.playing) {
      if (this.last) this.app.t += (now - this.last) * 1e-3 * Number(this.speed.value);
      this.last = now;
      if (this.app.t >= this.app.recording.end) { this.app.t = this.app.recording.end; this.toggle(); }
    }
    this.slider.value = this.app.t;
    say(this.clock, `${clock(this.app.t)} of ${clock(this.app.recording.end)}`);
  }
}

export class Replay {
  constructor(panel, app) {
    this.app = app;
    const { recording } = app;
    this.key = `cathforce-marks ${recording.title} ${recording.end}`;
    try { this.marks = JSON.parse(localStorage.getItem(this.key)) ?? []; } catch { this.marks = []; }
    this.list = el("ul", { class: "marks", id: "marks" });
    this.name = el("input", { id: "mark-name", placeholder: "what is here", maxlength: "80" });
    this.film = el("button", { type: "button", id: "film", onclick: () => this.toggleFilm() }, "Record a film");
    this.canFilm = typeof MediaRecorder !== "undefined" && typeof HTMLCanvasElement.prototype.captureStream === "function";
    this.film.disabled = !this.canFilm;
    panel.append(
      el("h1", {}, recording.title), recording.provenance ? el("p", { class: "soft" }, recording.provenance) : null,
      el("div", { class: "pair" },
        card("Marks", el("form", { class: "row", onsubmit: (event) => { event.preventDefault(); this.mark(); } },
          el("label", { for: "mark-name" }, "Mark "), this.name, el("button", { type: "submit", id: "mark" }, "Mark this time")), this.list),
        card("Pictures and films", el("p", {}, "They show the vessel and the size of the force as they are at this time."),
          el("div", { class: "row" }, el("button", { type: "button", id: "png", onclick: () => this.picture() }, "Save a PNG"), this.film),
          el("p", { class: "soft", id: "film-note" }, this.canFilm ? "A film records while the recording plays, as WebM, until it is stopped." : "This browser cannot record films."))),
      card("Run", facts([...recording.rows, ["recording complete", recording.complete]])));
    this.draw();
  }

  mark() {
    this.marks.push({ t: this.app.t, name: this.name.value.trim() || clock(this.app.t) });
    this.marks.sort((a, b) => a.t - b.t);
    this.name.value = "";
    this.keep();
  }

  keep() {
    localStorage.setItem(this.key, JSON.stringify(this.marks));
    this.draw(true);
  }

  draw(changed) {
    if (!changed && this.list.dataset.drawn) return;
    this.list.dataset.drawn = "yes";
    this.list.replaceChildren(...(this.marks.length === 0 ? [el("li", { class: "soft" }, "No time is marked yet.")] : this.marks.map((mark, i) => el("li", {},
      el("button", { type: "button", onclick: () => this.app.transport.go(mark.t) }, clock(mark.t)), " ", mark.name, " ",
      el("button", { type: "button", "aria-label": `Delete the mark ${mark.name}`, onclick: () => { this.marks.splice(i, 1); this.keep(); } }, "×")))));
  }

  /** One picture of the vessel and the force under it. */
  compose(canvas) {
    const scene = this.app.scene(), series = this.app.recording.series, t = this.app.t;
    const style = getComputedStyle(document.documentElement), [wide, high, chart] = [1280, 720, 180];
    Object.assign(canvas, { width: wide, height: high });
    const context = canvas.getContext("2d"), ink = style.getPropertyValue("--ink"), soft = style.getPropertyValue("--soft");
    context.fillStyle = style.getPropertyValue("--ground");
    context.fillRect(0, 0, wide, high);
    if (scene && scene.canvas.width) {
      const share = Math.min(wide / scene.canvas.width, (high - chart - 40) / scene.canvas.height);
      const [w, h] = [scene.canvas.width * share, scene.canvas.height * share];
      context.drawImage(scene.canvas, (wide - w) / 2, 40 + (high - chart - 40 - h) / 2, w, h);
    }
    context.fillStyle = ink;
    context.font = "600 18px system-ui, sans-serif";
    context.fillText(`${this.app.recording.title}   ${number(t, 2)} s`, 20, 28);
    const left = 60, foot = high - 24, top = high - chart + 10, points = Math.min(1200, series.t.length);
    let most = 0.1;
    const values = Array.from({ length: points }, (_, i) => { const k = Math.floor(i * series.t.length / points), to = Math.max(k + 1, Math.floor((i + 1) * series.t.length / points)); const at = series.largest(k, to), size = series.vector(0, at, null) ?? 0; most = Math.max(most, size); return [series.t[at], size]; });
    const x = (s) => left + (s - this.app.recording.start) / Math.max(1e-9, this.app.recording.end - this.app.recording.start) * (wide - left - 20), y = (n) => foot - n / most * (foot - top);
    context.strokeStyle = style.getPropertyValue("--estimated");
    context.lineWidth = 1.5;
    context.beginPath();
    values.forEach(([s, n], i) => (i ? context.lineTo(x(s), y(n)) : context.moveTo(x(s), y(n))));
    context.stroke();
    context.fillStyle = soft;
    context.font = "13px system-ui, sans-serif";
    context.fillText(`${number(most, 2)} N`, 8, top + 6);
    context.fillText("0 N", 8, foot);
    context.fillText("size of the force on the vessel · for research use only", left, high - 6);
    context.fillStyle = ink;
    context.fillRect(x(t), top, 1.5, foot - top);
  }

  picture() {
    const canvas = document.createElement("canvas");
    this.compose(canvas);
    canvas.toBlob((blob) => { this.saved = blob; download(blob, `cathforce-${number(this.app.t, 2)}s.png`); this.app.say("The picture was saved."); }, "image/png");
  }

  toggleFilm() {
    if (this.recorder) { this.recorder.stop(); return; }
    const canvas = document.createElement("canvas");
    this.compose(canvas);
    const parts = [], stream = canvas.captureStream(30);
    this.recorder = new MediaRecorder(stream, { mimeType: "video/webm" });
    this.bytes = 0;
    this.recorder.addEventListener("dataavailable", (event) => { parts.push(event.data); this.bytes += event.data.size; });
    this.recorder.addEventListener("stop", () => {
      this.recorder = null;
      this.filmed = null;
      say(this.film, "Record a film");
      this.saved = new Blob(parts, { type: "video/webm" });
      download(this.saved, "cathforce.webm");
      this.app.say("The film was saved.");
    });
    this.filmed = canvas;
    this.recorder.start(500);
    say(this.film, "Stop the film");
    if (!this.app.transport.playing) this.app.transport.toggle();
  }

  /** Called for every picture that is drawn. */
  shoot() { if (this.filmed) this.compose(this.filmed); }
}
