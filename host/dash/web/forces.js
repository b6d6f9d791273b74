// Forces and torque over time.

import { Chart, nearest } from "./charts.js";
import { el } from "./dom.js";

const CHARTS = [
  { title: "Force on the vessel, x", unit: "N", digits: 3, of: 0 },
  { title: "Force on the vessel, y", unit: "N", digits: 3, of: 1 },
  { title: "Force on the vessel, z", unit: "N", digits: 3, of: 2 },
  { title: "Force on the vessel, size", unit: "N", digits: 3, of: "size", limit: 1, zeroBased: true },
  { title: "Force behind the guide", unit: "N", digits: 3, of: 3 },
  { title: "Torque behind the guide", unit: "mN·m", digits: 2, of: 4 },
];

export class Forces {
  constructor(panel, app) {
    this.app = app;
    this.tare = null;
    this.charts = CHARTS.map((kind) => {
      const chart = new Chart({ ...kind, sync: "forces" });
      chart.kind = kind;
      chart.onZoom = (from, to) => this.zoom(from, to);
      return chart;
    });
    const toggle = (id, text, does) => el("button", { type: "button", id, "aria-pressed": "false", onclick: (event) => {
      const on = event.target.getAttribute("aria-pressed") !== "true";
      event.target.setAttribute("aria-pressed", String(on));
      does(on);
    } }, text);
    this.window = el("select", { id: "window", onchange: () => this.zoom(null, null) },
      ...[5, 10, 30, 60].map((s) => el("option", { value: s, selected: s === 10 }, `last ${s} s`)),
      el("option", { value: "all" }, "all of it"));
    if (app.source.kind === "recording") this.window.value = "all";
    this.bandText = el("span", {});
    panel.append(
      el("div", { class: "tools", role: "group", "aria-label": "Charts" },
        el("label", { for: "window" }, "Time "), this.window,
        el("button", { type: "button", id: "unzoom", onclick: () => this.zoom(null, null) }, "Whole width"),
        app.source.kind === "link" ? toggle("freeze", "Freeze", (on) => { this.frozen = on ? this.app.series.copy() : null; this.dirty = true; }) : null,
        toggle("peak-hold", "Peak hold", (on) => { this.holds = on; for (const chart of this.charts) chart.peak = null; this.dirty = true; }),
        toggle("tare", "Tare", (on) => { this.tare = on ? this.app.series.tareAt(nearest(this.app.series.t, this.app.now())) : null; for (const chart of this.charts) chart.peak = null; this.dirty = true; }),
        el("p", { class: "key" }, el("i", { class: "line estimated" }), "estimated ", el("i", { class: "line measured" }), "measured ", el("i", { class: "block band" }), "nine of ten true forces ", el("i", { class: "block unknown" }), "band unknown")),
      el("div", { class: "charts" }, this.charts.map((chart) => chart.root)),
      el("p", { class: "soft" }, "Drag across a chart to zoom, double-click for the whole width. Arrow keys move the cursor of a focused chart, with Shift by 50 points."));
  }

  zoom(from, to) {
    this.span = from === null ? null : [from, to];
    this.dirty = true;
    this.draw();
  }

  /** Charts cost the most: half of the screen's rate is smooth. */
  draw() {
    const now = performance.now();
    if (!this.dirty && now - (this.drawn ?? 0) < 30) return;
    this.drawn = now;
    this.dirty = false;
    const series = this.frozen ?? this.app.series, times = series.t;
    if (times.length === 0) return;
    const still = this.app.source.kind === "recording";
    const end = times[times.length - 1];
    const width = this.window.value === "all" ? Infinity : Number(this.window.value);
    const about = still ? this.app.now() : end;
    let [from, to] = this.span ?? (still && width < Infinity ? [about - width / 2, about + width / 2] : [Math.max(times[0], end - width), end]);
    if (!(to > from)) to = from + 1;
    // Only what is seen is handed over, at most three points a pixel.
    const low = Math.max(0, nearest(times, from) - 1), high = Math.min(times.length, nearest(times, to) + 2);
    const step = Math.max(1, Math.ceil((high - low) / 3000));
    const index = [];
    for (let i = low; i < high; i += step) index.push(step === 1 ? i : series.largest(i, Math.min(i + step, high)));
    const shown = index.map((i) => times[i]);
    for (const chart of this.charts) {
      const of = chart.kind.of, scale = of === 4 ? 1e3 : 1, tare = this.tare;
      const estimated = index.map((i) => series.value(of, i, tare, scale));
      const measured = index.map((i) => series.measuredValue(of, i, tare));
      const half = index.map((i) => series.halfWidth(of, i));
      chart.saysBand = of !== "size" && of !== 4;
      chart.now = still ? about : null;
      if (this.holds) {
        const most = Math.max(...estimated.filter((x) => x !== null).map(Math.abs), 0);
        if (chart.peak === null || most > Math.abs(chart.peak)) chart.peak = estimated.reduce((a, b) => (b !== null && Math.abs(b) > Math.abs(a) ? b : a), 0);
      }
      const edge = (side) => estimated.map((x, i) => (x === null || half[i] === null ? null : x + side * half[i]));
      chart.show(shown, [measured, estimated, edge(-1), edge(1)], from, to);
    }
  }
}
