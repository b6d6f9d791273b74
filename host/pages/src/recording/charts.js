// Line charts over time on a canvas, all with one cursor.
"use strict";

/** Round steps that give about `count` of them between `low` and `high`. */
function niceTicks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++) ticks.push(i * step);
  return { ticks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** Index of the last sample at or before `t`. */
function indexAt(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

/** Value of one of the style's variables, as the browser's colour scheme has it now. */
const styled = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

class Chart {
  /**
   * spec: { title, unit, digits, lines: [{ name, colour, width, t, y }], area: { t, low, high, colour }, zero }
   * colour: name of a variable of the style
   * area: nine of ten lie between low and high, NaN where nobody knows
   * shared: { from, to, bands: [{ from, to, colour }], onSeek(t) }
   */
  constructor(parent, spec, shared) {
    Object.assign(this, { spec, shared, cursor: shared.from });
    const card = parent.appendChild(document.createElement("div"));
    card.className = "card chart";
    const head = card.appendChild(document.createElement("div"));
    head.className = "chart-head";
    head.appendChild(document.createElement("h2")).textContent = spec.title;
    this.key = head.appendChild(document.createElement("div"));
    this.key.className = "key";
    this.canvas = card.appendChild(document.createElement("canvas"));
    this.range();
    const seek = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const share = (event.clientX - box.left - this.left) / (box.width - this.left - this.right);
      shared.onSeek(shared.from + Math.min(1, Math.max(0, share)) * (shared.to - shared.from));
    };
    this.canvas.addEventListener("pointerdown", (e) => { this.canvas.setPointerCapture(e.pointerId); seek(e); });
    this.canvas.addEventListener("pointermove", (e) => { if (e.buttons) seek(e); });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  range() {
    let low = this.spec.zero ? 0 : Infinity, high = -Infinity;
    const { lines, area } = this.spec;
    for (const y of [...lines.map((line) => line.y), ...(area ? [area.low, area.high] : [])]) for (const v of y) {
      if (v < low) low = v;
      if (v > high) high = v;
    }
    if (!(high > low)) { low = Number.isFinite(low) ? low - 1 : 0; high = low + 2; }
    const margin = 0.06 * (high - low);
    this.low = this.spec.zero ? 0 : low - margin;
    this.high = high + margin;
    this.left = 54; this.right = 10; this.top = 10; this.bottom = 34;
  }

  seek(t) { this.cursor = t; this.draw(); }

  draw() {
    const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = this.canvas;
    if (!w) return;
    this.canvas.width = w * ratio; this.canvas.height = h * ratio;
    const c = this.canvas.getContext("2d"), { from, to, bands } = this.shared;
    c.scale(ratio, ratio);
    const x = (t) => this.left + (t - from) / (to - from) * (w - this.left - this.right);
    const y = (v) => h - this.bottom - (v - this.low) / (this.high - this.low) * (h - this.top - this.bottom);
    const family = getComputedStyle(document.body).fontFamily;
    c.font = `11px ${family}`;
    for (const band of bands) {
      c.fillStyle = styled(band.colour);
      c.fillRect(x(Math.max(from, band.from)), this.top, x(Math.min(to, band.to)) - x(Math.max(from, band.from)), h - this.top - this.bottom);
    }
    const vertical = niceTicks(this.low, this.high, 5), horizontal = niceTicks(from, to, 8);
    c.fillStyle = styled("--soft"); c.lineWidth = 1;
    c.textAlign = "right"; c.textBaseline = "middle";
    for (const v of vertical.ticks) {
      c.beginPath(); c.moveTo(this.left, y(v)); c.lineTo(w - this.right, y(v));
      c.strokeStyle = styled(Math.abs(v) < 1e-12 ? "--grid-zero" : "--grid"); c.stroke();
      c.fillText(v.toFixed(vertical.digits), this.left - 7, y(v));
    }
    c.textAlign = "center"; c.textBaseline = "top";
    for (const t of horizontal.ticks) c.fillText(t.toFixed(horizontal.digits), x(t), h - this.bottom + 6);
    c.fillText("time [s]", (this.left + w - this.right) / 2, h - 14);
    c.save(); c.translate(11, (this.top + h - this.bottom) / 2); c.rotate(-Math.PI / 2);
    c.textBaseline = "middle"; c.fillText(`${this.spec.axis} [${this.spec.unit}]`, 0, 0); c.restore();
    c.save(); c.beginPath(); c.rect(this.left, this.top, w - this.left - this.right, h - this.top - this.bottom); c.clip();
    for (const line of this.spec.lines) {
      // Over what was measured, under what was estimated.
      if (this.spec.area && line === this.spec.lines.at(-1)) this.fill(c, x, y, this.spec.area);
      c.strokeStyle = styled(line.colour); c.lineWidth = line.width; c.lineJoin = "round"; c.beginPath();
      for (let i = 0; i < line.t.length; i++) c.lineTo(x(line.t[i]), y(line.y[i]));
      c.stroke();
    }
    c.restore();
    c.strokeStyle = styled("--ink"); c.globalAlpha = 0.55; c.beginPath();
    c.moveTo(x(this.cursor), this.top); c.lineTo(x(this.cursor), h - this.bottom); c.stroke(); c.globalAlpha = 1;
    this.label();
  }

  /** Each stretch in which both edges are known. */
  fill(c, x, y, { t, low, high, colour }) {
    c.fillStyle = styled(colour); c.globalAlpha = 0.3;
    for (let i = 0; i < t.length; i++) {
      if (!Number.isFinite(low[i] + high[i])) continue;
      const start = i;
      while (i < t.length && Number.isFinite(low[i] + high[i])) i++;
      c.beginPath();
      for (let k = start; k < i; k++) c.lineTo(x(t[k]), y(high[k]));
      for (let k = i - 1; k >= start; k--) c.lineTo(x(t[k]), y(low[k]));
      c.fill();
    }
    c.globalAlpha = 1;
  }

  label() {
    const { area, unit, digits } = this.spec;
    const i = area && indexAt(area.t, this.cursor), half = area && (area.high[i] - area.low[i]) / 2;
    const width = Number.isFinite(half) ? `±${half.toFixed(digits)} ${unit}` : "not known";
    const block = document.createElement("i");
    block.className = "block"; block.style.background = area && `var(${area.colour})`;
    this.key.replaceChildren(...this.spec.lines.flatMap((line) => {
      const mark = document.createElement("i");
      mark.style.background = `var(${line.colour})`;
      const value = line.y.length ? line.y[indexAt(line.t, this.cursor)].toFixed(this.spec.digits) : "–";
      return [mark, `${line.name} ${value} ${this.spec.unit}`];
    }), ...(area ? [block, `9 of 10 within ${width}`] : []));
  }
}
