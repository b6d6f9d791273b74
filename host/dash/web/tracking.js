// The catheter in its vessel, and the force along it.

import { el, say, svg } from "./dom.js";
import { number } from "./format.js";
import { Scene, VIEWS, colourOf, css } from "./scene.js";

export class Tracking {
  constructor(panel, app) {
    this.app = app;
    this.views = [];
    this.stages = el("div", { class: "stages" });
    this.note = el("p", { class: "soft", id: "shape-note" });
    this.read = el("dl", { class: "readout", id: "readout" });
    this.along = el("div", { class: "along", id: "along" });
    this.second = el("button", { type: "button", id: "two-views", "aria-pressed": "false", onclick: () => this.toggleSecond() }, "Two views");
    panel.append(el("div", { class: "tools" }, this.second),
      el("div", { class: "tracks" },
        el("div", { class: "card" }, this.stages, this.legend(), this.note),
        el("div", { class: "card" }, el("h2", {}, "Force along the catheter"), this.along, this.read)));
    this.add("perspective");
  }

  add(preset) {
    const canvas = el("canvas", { class: "vessel", tabindex: "0", role: "img", "aria-label": "The catheter in the vessel, coloured by contact force; arrow keys turn it, plus and minus zoom" });
    const choose = el("select", { "aria-label": "View", onchange: () => scene.look(choose.value) }, VIEWS.map((name) => el("option", { value: name, selected: name === preset }, name)));
    const stage = el("div", { class: "stage" }, canvas, el("div", { class: "presets" }, choose));
    this.stages.append(stage);
    let scene;
    try {
      scene = new Scene(canvas, preset);
    } catch (error) {
      stage.append(el("p", { class: "bad" }, `Nothing can be drawn here: ${error.message}.`));
      return;
    }
    this.views.push({ scene, stage });
    if (this.vessel) scene.load(this.vessel, this.radius);
    this.dirty = true;
  }

  toggleSecond() {
    const on = this.views.length < 2;
    this.second.setAttribute("aria-pressed", String(on));
    if (on) this.add("top");
    else for (const view of this.views.splice(1)) view.stage.remove();
    this.stages.classList.toggle("two", on);
  }

  legend() {
    const stops = Array.from({ length: 11 }, (_, i) => `${css(colourOf(i / 10))} ${10 * i}%`).join(", ");
    return el("div", { class: "legend", role: "img", "aria-label": "Colours from 0 N to 1 N and more" },
      el("span", {}, "0 N"), el("i", { style: `background: linear-gradient(to right, ${stops})` }), el("span", {}, "1 N and more"),
      el("span", { class: "soft" }, "contact force on the vessel; arrows show its direction, the pink line the way of the tip"));
  }

  load(vessel, radius) {
    Object.assign(this, { vessel, radius });
    for (const { scene } of this.views) scene.load(vessel, radius);
    this.dirty = true;
  }

  draw(frame) {
    const { at, force, from } = frame.shape ?? { at: [], force: [] };
    for (const { scene } of this.views) scene.show(at, force);
    say(this.note, at.length === 0
      ? "No shape is known: the device has not settled, or its vessel has not been read yet."
      : this.app.recording
        ? "The shape comes from the recording, 25 times a second where it could be replayed."
        : from === "host"
        ? "The shape is computed on this computer by the device's own tick, from the same encoder frames. The bus alone would bring a whole one three times a second."
        : "The shape is the last whole one that the bus brought, up to half a second old.");
    const now = performance.now();
    if (now - (this.drawn ?? 0) < 60) return;
    this.drawn = now;
    this.plot(at, force);
    this.numbers(frame, at, force);
  }

  numbers(frame, at, force) {
    const tip = at.length ? `${number(at[0], 1)} · ${number(at[1], 1)} · ${number(at[2], 1)} mm` : "–";
    let most = 0, where = 0;
    for (let i = 0; 3 * i < force.length; i++) {
      const size = Math.hypot(force[3 * i], force[3 * i + 1], force[3 * i + 2]);
      if (size > most) { most = size; where = i; }
    }
    const rows = [
      ["insertion", frame.insertion_m === null || frame.insertion_m === undefined ? "–" : `${number(1e3 * frame.insertion_m, 2)} mm`],
      ["rotation", frame.rotation_rad === null || frame.rotation_rad === undefined ? "–" : `${number(frame.rotation_rad * 180 / Math.PI, 1)}°`],
      ["tip from the entry, x · y · z", tip],
      ["total force on the vessel", frame.forces?.norm_N === null || frame.forces?.norm_N === undefined ? "–" : `${number(frame.forces.norm_N, 3)} N`],
      ["largest contact", at.length ? `${number(most, 3)} N at node ${where}` : "–"],
    ];
    if (this.read.children.length !== 2 * rows.length) this.read.replaceChildren(...rows.flatMap(() => [el("dt"), el("dd")]));
    rows.forEach(([name, value], i) => { say(this.read.children[2 * i], name); say(this.read.children[2 * i + 1], value); });
  }

  /** Contact force over the length from the tip. */
  plot(at, force) {
    const [wide, high, left, foot] = [360, 210, 44, 36];
    let length = 0, most = 0.1;
    const points = [];
    for (let i = 0; 3 * i < at.length; i++) {
      if (i > 0) length += Math.hypot(at[3 * i] - at[3 * i - 3], at[3 * i + 1] - at[3 * i - 2], at[3 * i + 2] - at[3 * i - 1]);
      const size = Math.hypot(force[3 * i], force[3 * i + 1], force[3 * i + 2]);
      points.push([length, size]);
      most = Math.max(most, size);
    }
    const top = most <= 0.1 ? 0.1 : most <= 0.25 ? 0.25 : most <= 0.5 ? 0.5 : Math.ceil(most);
    const end = Math.max(50, 50 * Math.ceil(length / 50));
    const x = (mm) => left + (mm / end) * (wide - left - 18), y = (n) => high - foot - (n / top) * (high - foot - 10);
    const grid = [0, 0.25, 0.5, 0.75, 1].flatMap((share) => [
      svg("line", { class: "grid", x1: left, x2: wide - 18, y1: y(share * top), y2: y(share * top) }),
      svg("text", { x: left - 5, y: y(share * top) + 4, "text-anchor": "end" }, number(share * top, 2)),
      svg("text", { x: x(share * end), y: high - foot + 15, "text-anchor": "middle" }, number(share * end, 0)),
    ]);
    const bars = points.map(([mm, n]) => svg("line", { x1: x(mm), x2: x(mm), y1: y(0), y2: y(Math.min(n, top)), style: `stroke: ${css(colourOf(n))}; stroke-width: 3.5` }));
    this.along.replaceChildren(svg("svg", { viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": `Contact force over the length from the tip, at most ${number(most, 3)} N` },
      grid, bars, svg("text", { x: (left + wide) / 2, y: high - 4, "text-anchor": "middle" }, "mm from the tip"),
      svg("text", { x: 11, y: high / 2 - 14, transform: `rotate(-90 11 ${high / 2 - 14})`, "text-anchor": "middle" }, "N")));
  }
}
