// How old the picture is, and why.

import { card, el, facts, say, svg } from "./dom.js";
import { number, percent } from "./format.js";

const BINS = 51, WINDOW = 1200;

export class Timing {
  constructor(panel, app) {
    this.app = app;
    this.ages = [];
    this.waterfall = el("div", { id: "waterfall" });
    this.histogram = el("div", { id: "histogram" });
    this.ticks = el("div", { id: "ticks" });
    const still = app.source.kind === "recording";
    panel.append(
      card(still ? "From encoder to record" : "From encoder to screen", el("p", { class: "soft" }, "Bars end at the median, lines at the 99th percentile."), this.waterfall),
      ...(still ? [] : [card("Age of what is on the screen", this.histogram)]),
      card("Ticks", this.ticks));
  }

  /** The age when a picture was drawn [ms]. */
  note(age, travel, drawing) {
    this.ages.push({ age, travel, drawing });
    if (this.ages.length > WINDOW) this.ages.shift();
  }

  draw(frame) {
    const now = performance.now();
    if (now - (this.drawn ?? -1e9) < 500) return;
    this.drawn = now;
    const still = this.app.recording;
    const stages = still ? still.stages : [...(frame.timing?.stages ?? []), ...this.own()];
    this.bars(stages);
    if (!still) this.bins();
    this.figures(frame, still);
  }

  own() {
    const stage = (name, what, key) => {
      const times = this.ages.map((entry) => entry[key]).filter(Number.isFinite).sort((a, b) => a - b);
      const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))];
      return times.length ? [{ name, what, p50_ms: Math.max(0, at(0.5)), p99_ms: Math.max(0, at(0.99)), max_ms: Math.max(0, at(1)) }] : [];
    };
    return [...stage("to the browser", "from the picture of it to its arrival here", "travel"), ...stage("drawing", "from its arrival to the screen", "drawing")];
  }

  bars(stages) {
    if (stages.length === 0) { this.waterfall.replaceChildren(el("p", { class: "soft" }, this.app.recording?.lock_step ? "In lock step a frame has the time of its tick, so only the age in the device is known." : "Nothing has been timed yet.")); return; }
    const row = 34, wide = 640, left = 170, high = stages.length * row + 26;
    const total = stages.reduce((sum, stage) => sum + stage.p50_ms, 0) + Math.max(...stages.map((stage) => stage.p99_ms - stage.p50_ms), 0);
    const end = Math.max(1, total * 1.15), x = (ms) => left + (ms / end) * (wide - left - 90);
    let from = 0;
    const drawn = stages.flatMap((stage, i) => {
      const y = i * row + 8, start = from;
      from += stage.p50_ms;
      return [
        svg("text", { x: left - 8, y: y + 14, "text-anchor": "end" }, stage.name, svg("title", {}, stage.what)),
        svg("rect", { x: x(start), y, width: Math.max(1.5, x(from) - x(start)), height: 20, rx: 3, class: "bar" }),
        svg("line", { x1: x(from), x2: x(start + stage.p99_ms), y1: y + 10, y2: y + 10, class: "whisker" }),
        svg("text", { x: Math.max(x(start + stage.p99_ms), x(from)) + 6, y: y + 14 }, `${number(stage.p50_ms, 1)} (${number(stage.p99_ms, 1)}) ms`),
      ];
    });
    this.waterfall.replaceChildren(svg("svg", { viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": stages.map((stage) => `${stage.name}: median ${number(stage.p50_ms, 1)} ms, 99th percentile ${number(stage.p99_ms, 1)} ms`).join("; ") },
      drawn, svg("text", { x: left, y: high - 4 }, `median of all stages ${number(from, 1)} ms`)));
  }

  bins() {
    const ages = this.ages.map((entry) => entry.age).filter(Number.isFinite), bins = new Array(BINS).fill(0);
    for (const age of ages) bins[Math.min(BINS - 1, Math.max(0, Math.floor(age / 2)))] += 1;
    const sorted = [...ages].sort((a, b) => a - b), at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
    const [wide, high, left, foot] = [640, 170, 40, 34], most = Math.max(...bins, 1);
    const x = (i) => left + (i / BINS) * (wide - left - 8), y = (n) => high - foot - (n / most) * (high - foot - 12);
    this.histogram.replaceChildren(
      svg("svg", { viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": `Histogram of the age of ${ages.length} pictures` },
        bins.map((n, i) => svg("rect", { class: "bar", x: x(i) + 0.5, width: x(1) - x(0) - 1, y: y(n), height: high - foot - y(n) }, svg("title", {}, `${2 * i} to ${i === BINS - 1 ? "more" : 2 * i + 2} ms: ${n}`))),
        [0, 20, 40, 60, 80, 100].map((ms) => svg("text", { x: x(ms / 2), y: high - foot + 16, "text-anchor": "middle" }, ms === 100 ? "≥ 100" : ms)),
        svg("text", { x: left - 4, y: y(most) + 4, "text-anchor": "end" }, most), svg("text", { x: (left + wide) / 2, y: high - 3, "text-anchor": "middle" }, "age when drawn, ms")),
      el("p", { id: "age-summary" }, ages.length ? `median ${number(at(0.5), 0)} ms, 99th percentile ${number(at(0.99), 0)} ms, of the last ${ages.length} pictures` : "No picture has been drawn yet."));
  }

  figures(frame, still) {
    const rows = [];
    if (still) {
      const result = still.result;
      if (result) rows.push(["missed ticks", String(result.missed_ticks)], ["most instructions in a tick", `${result.worst_instructions} in tick ${result.worst_tick}`], ["stack used", `${result.stack_used_bytes} bytes`]);
      rows.push(["missing frames", still.dropouts.length ? still.dropouts.map((lost) => `${lost.frames} × ${lost.cause} at ${number(lost.t_s, 3)} s`).join(", ") : "none"]);
    } else {
      const { load, lost_ticks = [], dropouts = {}, rejected_frames = 0 } = frame.timing ?? {};
      rows.push(["ticks a second", String(frame.tick_hz ?? "–")], ["encoder frames a second", String(frame.encoder_hz ?? "–")], ["bus load", percent(frame.bus_load)]);
      rows.push(["ticks", frame.lock_step ? "granted one by one, at this computer's pace" : "by the device's own clock"]);
      if (load) {
        rows.push(["missed ticks", String(load.missed_ticks)], ["ticks that ran into the next one", String(load.overruns)]);
        rows.push(["most instructions in a tick", load.worst_instructions ? `${load.worst_instructions} in tick ${load.worst_tick}` : "not measured by this board"]);
        rows.push(["latest start of a tick", `${number(load.latest_start_ns * 1e-3, 1)} µs`], ["stack used", `${load.stack_used_bytes} of ${load.stack_size_bytes} bytes`]);
      }
      rows.push(["ticks lost on the bus, by number", lost_ticks.length ? lost_ticks.join(", ") : "none"]);
      rows.push(["frames missing here", Object.entries(dropouts).map(([cause, n]) => `${cause} ${n}`).join(", ") || "none"], ["frames that the device rejected", String(rejected_frames)]);
      rows.push(["ticks that the model did not resolve", String(frame.unresolved_ticks ?? "–")]);
      if (frame.twin && frame.lock_step) rows.push(["device against this computer, digests", `${frame.twin.agreed} agree, ${frame.twin.differed} differ`]);
    }
    this.ticks.replaceChildren(facts(rows));
  }
}
