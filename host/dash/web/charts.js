// Lines over time, by uPlot.

import uPlot from "/vendor/uPlot.esm.js";
import { el, say } from "./dom.js";
import { number } from "./format.js";

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/**
 * One chart. `lines`: measured, then estimated, then the lower and the upper edge of the band; each an array as
 * long as the times, or null where there is none.
 */
export class Chart {
  constructor({ title, unit, digits, limit, zeroBased, sync }) {
    Object.assign(this, { title, unit, digits, limit, peak: null });
    this.values = el("p", { class: "values" });
    this.holder = el("div", { class: "plot" });
    this.root = el("figure", { class: "chart card", tabindex: "0", "aria-label": `${title} in ${unit} over time; arrow keys move the cursor` },
      el("figcaption", {}, el("h2", {}, `${title} `, el("small", {}, unit)), this.values), this.holder);
    const axis = { stroke: () => colour("--soft"), grid: { stroke: () => colour("--grid"), width: 1 }, ticks: { stroke: () => colour("--grid"), width: 1 }, font: "11px system-ui, sans-serif" };
    this.plot = new uPlot({
      width: 400, height: 190, legend: { show: false }, padding: [8, 8, 0, 0],
      cursor: { sync: { key: sync, setSeries: false }, drag: { x: true, y: false, setScale: false }, points: { size: 5 } },
      scales: { x: { time: false }, y: { range: (_, low, high) => this.range(low, high, zeroBased) } },
      axes: [{ ...axis, size: 34, values: (_, at) => at.map((x) => `${number(x, at.length > 1 && at[1] - at[0] < 0.5 ? 2 : 0)} s`) }, { ...axis, size: 54 }],
      series: [
        {},
        { stroke: () => colour("--measured"), width: 1.2, points: { show: false }, spanGaps: false },
        { stroke: () => colour("--estimated"), width: 1.6, points: { show: false } },
        { stroke: "transparent", points: { show: false } },
        { stroke: "transparent", points: { show: false } },
      ],
      bands: [{ series: [4, 3], fill: () => colour("--band") }],
      hooks: {
        drawClear: [(u) => this.under(u)],
        draw: [(u) => this.over(u)],
        setCursor: [(u) => this.say(u.cursor.idx)],
        setSelect: [(u) => { if (u.select.width <= 4) return; const [from, to] = [u.select.left, u.select.left + u.select.width].map((at) => u.posToVal(at, "x")); u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false); this.onZoom?.(from, to); }],
      },
    }, [[0], [null], [null], [null], [null]], this.holder);
    this.plot.over.addEventListener("dblclick", () => this.onZoom?.(null, null));
    new ResizeObserver(() => this.fit()).observe(this.holder);
    this.root.addEventListener("keydown", (event) => this.key(event));
  }

  fit() {
    const width = this.holder.clientWidth;
    if (width > 40 && width !== this.plot.width) this.plot.setSize({ width, height: 190 });
  }

  range(low, high, zeroBased) {
    if (low === null || !Number.isFinite(low)) return [zeroBased ? 0 : -1, 1];
    const least = zeroBased ? Math.min(0, low) : low, space = Math.max((high - least) * 0.08, 1e-6 * Math.max(1, Math.abs(high)));
    const flat = Math.max(0, 0.02 * (this.limit ?? 0.05) - (high - least)) / 2;
    return [zeroBased && low >= 0 ? 0 : least - space - flat, high + space + flat];
  }

  /** Shows what there is; `from` and `to` are the ends of the axis. */
  show(times, lines, from, to) {
    this.plot.setData([times, ...lines], false);
    this.plot.batch(() => {
      this.plot.setScale("x", { min: from, max: to > from ? to : from + 1 });
    });
    this.say(this.plot.cursor.idx);
  }

  /** Where no band is known the chart says so at its foot. */
  under(u) {
    const [times, , , low] = u.data;
    if (!this.saysBand || times.length < 2) return;
    const { ctx, bbox } = u, high = 4 * devicePixelRatio;
    ctx.save();
    ctx.fillStyle = colour("--unknown");
    let from = null;
    for (let i = 0; i <= times.length; i++) {
      const unknown = i < times.length && (low[i] === null || Number.isNaN(low[i]));
      if (unknown && from === null) from = times[i];
      if (!unknown && from !== null) {
        const [a, b] = [from, times[Math.min(i, times.length - 1)]].map((t) => Math.min(bbox.left + bbox.width, Math.max(bbox.left, u.valToPos(t, "x", true))));
        ctx.fillRect(a, bbox.top + bbox.height - high, Math.max(0, b - a), high);
        from = null;
      }
    }
    ctx.restore();
  }

  over(u) {
    const { ctx, bbox } = u;
    const level = (value, style, text) => {
      const y = u.valToPos(value, "y", true);
      if (y < bbox.top || y > bbox.top + bbox.height) return;
      ctx.save();
      ctx.strokeStyle = ctx.fillStyle = style;
      ctx.lineWidth = devicePixelRatio;
      ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
      ctx.beginPath(); ctx.moveTo(bbox.left, y); ctx.lineTo(bbox.left + bbox.width, y); ctx.stroke();
      ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      ctx.fillText(text, bbox.left + 6 * devicePixelRatio, y - 4 * devicePixelRatio);
      ctx.restore();
    };
    if (this.limit) level(this.limit, colour("--alarm"), `${this.limit} N can damage a vessel`);
    if (this.peak !== null) level(this.peak, colour("--soft"), `peak ${number(this.peak, this.digits)}`);
    if (this.now !== null && this.now !== undefined) {
      const x = u.valToPos(this.now, "x", true);
      if (x >= bbox.left && x <= bbox.left + bbox.width) {
        ctx.save(); ctx.fillStyle = colour("--ink"); ctx.fillRect(x, bbox.top, devicePixelRatio, bbox.height); ctx.restore();
      }
    }
  }

  /** The values under the cursor, or the newest. */
  say(index) {
    const [times, measured, estimated, low, high] = this.plot.data;
    let i = index;
    if (i === null || i === undefined) i = this.now === null || this.now === undefined ? times.length - 1 : nearest(times, this.now);
    const value = (line) => (line && line[i] !== null && line[i] !== undefined && !Number.isNaN(line[i]) ? number(line[i], this.digits) : null);
    const parts = [`${value(estimated) ?? "–"}`];
    const width = low && high && value(low) !== null ? (high[i] - low[i]) / 2 : null;
    if (this.saysBand) parts[0] += width === null ? " ± unknown" : ` ± ${number(width, this.digits)}`;
    if (value(measured) !== null) parts.push(`measured ${value(measured)}`);
    if (index !== null && index !== undefined) parts.push(`at ${number(times[i], 3)} s`);
    say(this.values, parts.join(" · "));
  }

  key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const [times] = this.plot.data;
    const far = event.shiftKey ? 50 : 1;
    const i = Math.min(times.length - 1, Math.max(0, (this.plot.cursor.idx ?? times.length - 1) + step * far));
    this.plot.setCursor({ left: this.plot.valToPos(times[i], "x"), top: this.plot.over.clientHeight / 2 });
  }
}

/** Index of the last time that is not after `at`. */
export function nearest(times, at) {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= at) low = middle; else high = middle - 1;
  }
  return low;
}
