// The page: what is shown, its views, and the loop that draws them.

import { el, say } from "./dom.js";
import { Diagnosing } from "./diagnosing.js";
import { Diagnosis } from "./diagnosis.js";
import { Faults } from "./faults.js";
import { Forces } from "./forces.js";
import { Recording, Replay, Transport } from "./replay.js";
import { vesselOf } from "./scene.js";
import { Series } from "./series.js";
import { Live, change, get } from "./server.js";
import { Settings } from "./settings.js";
import { Strip } from "./strip.js";
import { Timing } from "./timing.js";
import { Tracking } from "./tracking.js";

/** What is older is drawn grey [ms]. */
const OLD = 100;
const VIEWS = {
  link: [["tracking", "Tracking", Tracking], ["forces", "Forces", Forces], ["settings", "Settings", Settings], ["timing", "Timing", Timing], ["faults", "Faults", Faults]],
  recording: [["tracking", "Tracking", Tracking], ["forces", "Forces", Forces], ["timing", "Timing", Timing], ["faults", "Faults", Faults], ["replay", "Replay", Replay]],
  diagnosis: [["diagnosis", "Diagnosis", Diagnosis]],
  diagnosing: [["diagnosing", "Diagnosis", Diagnosing]],
};

class App {
  constructor(source) {
    this.source = source;
    this.series = new Series();
    this.views = {};
    this.frame = { faults: [], shape: { at: [], force: [] } };
    this.said = document.getElementById("said");
  }

  async start() {
    const { kind, name } = this.source;
    document.title = `${name} – cathforce`;
    document.body.classList.add(kind);
    if (kind === "recording") {
      this.recording = new Recording(await get("/api/data"));
      this.series = this.recording.series;
      this.t = this.recording.start;
    }
    if (kind === "diagnosis") this.diagnosis = await get("/api/data");
    this.strip = new Strip(document.getElementById("strip"), this);
    this.tabs();
    if (kind === "recording") this.transport = new Transport(document.getElementById("transport"), this);
    if (kind === "link") {
      this.series.push(await get("/api/data"));
      this.live = new Live((picture) => this.take(picture), () => this.lose());
    }
    if (kind === "recording") this.vessel();
    // Charts take their colours when they are drawn.
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      if (this.views.forces) this.views.forces.dirty = true;
      this.redraw();
    });
    const loop = (now) => { this.loop(now); requestAnimationFrame(loop); };
    requestAnimationFrame(loop);
    // A hidden page is not drawn, and a picture that is not drawn is not asked for; the age still shows.
    setInterval(() => this.age(), 250);
    this.ready = true;
  }

  tabs() {
    const panels = document.getElementById("panels"), bar = document.getElementById("tabs"), views = VIEWS[this.source.kind];
    const wanted = location.hash.slice(1);
    const buttons = views.map(([id, title, View], i) => {
      const panel = el("section", { id: `panel-${id}`, role: "tabpanel", "aria-labelledby": `tab-${id}`, hidden: true, class: `panel ${id}` });
      panels.append(panel);
      return el("button", { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": `panel-${id}`, onclick: () => this.choose(id), onkeydown: (event) => {
        const to = { ArrowLeft: i - 1, ArrowRight: i + 1, Home: 0, End: views.length - 1 }[event.key];
        if (to === undefined) return;
        event.preventDefault();
        const next = buttons[(to + views.length) % views.length];
        next.focus();
        next.click();
      } }, title);
    });
    bar.replaceChildren(...buttons);
    if (views.length === 1) bar.parentElement.hidden = true;
    this.choose(views.some(([id]) => id === wanted) ? wanted : views[0][0]);
  }

  choose(id) {
    for (const [other, , View] of VIEWS[this.source.kind]) {
      const tab = document.getElementById(`tab-${other}`), panel = document.getElementById(`panel-${other}`), on = other === id;
      tab.setAttribute("aria-selected", String(on));
      tab.tabIndex = on ? 0 : -1;
      panel.hidden = !on;
      if (on && !this.views[id]) this.views[id] = new View(panel, this);
    }
    this.shown = id;
    if (VIEWS[this.source.kind].length > 1) history.replaceState(null, "", `#${id}`);
    if (this.packed && id === "tracking" && !this.views.tracking.vessel) this.views.tracking.load(this.packed.vessel, this.packed.radius);
    this.redraw();
  }

  /** A change of the device; what came of it, or null where it was refused. */
  async change(body) {
    try {
      const done = await change(body);
      this.say(body.do === "apply" ? "The settings were applied." : `Done: ${Object.values(done).join(", ")}.`);
      return done;
    } catch (error) {
      this.say(`Refused: ${error.message}.`, true);
      return null;
    }
  }

  say(text, bad = false) {
    say(this.said, text);
    this.said.className = bad ? "bad" : "";
    clearTimeout(this.quiet);
    this.quiet = setTimeout(() => say(this.said, ""), 8000);
  }

  scene() { return this.views.tracking?.views[0]?.scene; }

  async vessel() {
    try {
      const scene = await get("/api/scene");
      this.packed = { vessel: vesselOf(scene.vessel), radius: scene.radius_mm };
      this.views.tracking?.load(this.packed.vessel, this.packed.radius);
      this.redraw();
    } catch {
      this.sceneKnown = null;
    }
  }

  take(picture) {
    const { at, force, from } = picture.shape;
    picture.shape = { from, at: Float32Array.from(at, (x) => x * 0.01), force: Float32Array.from(force, (x) => x * 1e-4) };
    this.series.push(picture.points);
    if (!this.frame.drawn && this.frame.arrived) this.live.drawn();
    this.frame = picture;
    if (picture.scene > 0 && picture.scene !== this.sceneKnown) { this.sceneKnown = picture.scene; this.vessel(); }
    if (picture.said && picture.said !== this.heard) { this.heard = picture.said; this.say(picture.said, true); }
    this.dirty = true;
  }

  lose() { this.isLost = true; this.age(); }

  redraw() { this.dirty = true; }

  /** Time of what is shown [s]. */
  now() { return this.recording ? this.t : this.series.t[this.series.t.length - 1] ?? 0; }

  /** Age of what is shown at this moment [ms]. */
  age() {
    if (!this.live) return null;
    const now = this.live.now(), at = this.frame.sample_ms ?? this.frame.heard_ms;
    const age = now === null || at === null || at === undefined ? null : Math.max(0, now - at);
    this.strip.age(age);
    const isOld = age === null || age > OLD;
    document.body.classList.toggle("old", isOld);
    if (this.frame.lost) this.say(`The link is lost: ${this.frame.lost}`, true);
    return age;
  }

  loop(now) {
    if (this.transport) {
      if (this.transport.playing) this.dirty = true;
      if (this.dirty) { this.transport.advance(now); this.frame = this.recording.frame(this.t); }
    }
    if (!this.dirty) return;
    this.dirty = false;
    const begun = performance.now(), { frame } = this;
    const age = this.age();
    this.strip.draw(frame, age);
    const view = this.views[this.shown];
    view?.draw?.(frame);
    // A film shows the vessel whichever view is open.
    if (this.views.replay?.filmed) { this.views.tracking?.draw(frame); this.views.replay.shoot(); }
    if (this.live && !frame.drawn && frame.arrived) {
      frame.drawn = true;
      this.live.drawn();
      const travel = this.live.offset === null ? NaN : frame.arrived + this.live.offset - frame.server_ms;
      this.note(age, travel, performance.now() - frame.arrived);
    }
    this.cost = 0.95 * (this.cost ?? 0) + 0.05 * (performance.now() - begun);
  }

  note(age, travel, drawing) {
    if (!this.views.timing) {
      // Ages count from the first picture, whether or not anybody looks at them.
      this.early ??= [];
      this.early.push([age, travel, drawing]);
      if (this.early.length > 1200) this.early.shift();
      return;
    }
    for (const entry of this.early?.splice(0) ?? []) this.views.timing.note(...entry);
    this.views.timing.note(age, travel, drawing);
  }
}

const source = await get("/api/source");
const app = new App(source);
globalThis.cathforce = app;
app.start().catch((error) => app.say(`Nothing can be shown: ${error.message}`, true));
