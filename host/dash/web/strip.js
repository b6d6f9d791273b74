// What is always visible.

import { el, say } from "./dom.js";
import { number, percent } from "./format.js";

export class Strip {
  constructor(root, app) {
    this.app = app;
    const item = (name, title) => {
      const value = el("b", {}, "–");
      const whole = el("div", { class: "item", title }, el("span", {}, name), value);
      return { whole, value };
    };
    this.items = {
      mode: item("device", "Mode of the device: it gives out forces only while armed"),
      fault: item("faults", "Faults that nobody has acknowledged"),
      age: item("age", "From the encoder's sample to this screen"),
      load: item("bus", "Share of 1 Mbit/s"),
      tick: item("tick", "Number of the newest tick"),
      recording: item("recording", "Whether this program records"),
    };
    const known = app.source.kind === "link" ? Object.keys(this.items) : app.source.kind === "recording" ? ["mode", "fault", "tick"] : [];
    root.replaceChildren(
      el("div", { class: "name" }, el("b", {}, "cathforce"), el("span", { id: "source-name" }, app.source.name)),
      ...known.map((name) => this.items[name].whole),
      el("div", { class: "actions" }, ...this.buttons()),
      el("p", { class: "use" }, "For research use only"));
  }

  buttons() {
    if (!this.app.source.can_change) return [];
    const ask = (what) => () => this.app.change({ do: what });
    this.arm = el("button", { type: "button", id: "arm", onclick: () => this.app.change({ do: this.armed ? "disarm" : "arm" }) }, "Arm");
    this.play = el("button", { type: "button", id: "play-trial", hidden: true, onclick: () => this.app.change({ do: this.playing ? "pause" : "play" }) }, "Play trial");
    this.test = el("button", { type: "button", onclick: ask("self_test"), hidden: true }, "Self-test");
    this.record = el("button", { type: "button", id: "record", hidden: !this.app.source.can_record, onclick: () => this.app.change({ do: this.recording ? "stop_recording" : "record" }) }, "Record");
    return [this.arm, this.play, this.test, this.record];
  }

  draw(frame, age) {
    const { mode, fault, load, tick, recording } = this.items;
    this.armed = frame.armed;
    say(mode.value, frame.mode ? (frame.armed ? "ARMED" : frame.mode) : "silent");
    mode.whole.className = `item ${frame.armed ? "warn" : ""}`;
    const faults = frame.faults ?? [];
    const active = faults.filter((f) => f.active).length;
    say(fault.value, faults.length === 0 ? "none" : `${faults[0].name}${faults.length > 1 ? ` +${faults.length - 1}` : ""}${active ? "" : " (over)"}`);
    fault.whole.className = `item ${faults.length ? "alarm" : ""}`;
    say(tick.value, frame.tick === null || frame.tick === undefined ? "–" : String(frame.tick));
    if (this.app.source.kind !== "link") return;
    this.age(age);
    say(load.value, percent(frame.bus_load));
    this.recorded(frame.recording);
    if (!this.arm) return;
    say(this.arm, frame.armed ? "Disarm" : "Arm");
    this.playing = frame.playing?.playing ?? false;
    this.play.hidden = !frame.playing;
    say(this.play, this.playing ? "Pause trial" : "Play trial");
    this.test.hidden = Boolean(frame.playing) || frame.mode !== "boot";
  }

  /** Whether this program records, how long already, and into which file. */
  recorded(state) {
    const { whole, value } = this.items.recording;
    this.recording = Boolean(state);
    say(value, state ? `● ${number(state.s, 0)} s` : "off");
    whole.title = state ? `Recording into ${state.file}` : "Whether this program records";
    whole.className = `item ${state ? "warn" : ""}`;
    if (this.record) say(this.record, state ? "Stop recording" : "Record");
  }

  age(ms) {
    const { age } = this.items;
    say(age.value, ms === null ? "–" : ms > 9999 ? "> 10 s" : `${number(ms, 0)} ms`);
    age.whole.className = `item ${ms === null || ms > 100 ? "alarm" : ms > 50 ? "warn" : ""}`;
  }
}
