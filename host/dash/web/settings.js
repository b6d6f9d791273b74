// The settings of the device: find, stage, compare, apply, read back.

import { card, el, say, svg } from "./dom.js";
import { significant } from "./format.js";
import { get } from "./server.js";

const GROUPS = { control: "control and limits", rig: "rig", effects: "effects" };
const unitOf = (entry) => (entry.unit === "1" ? "" : entry.unit);
const shown = (value) => String(Number(value.toPrecision(7)));

export class Settings {
  constructor(panel, app) {
    this.app = app;
    this.entries = [];
    this.staged = new Map();
    this.tips = null;
    this.tip = null;
    this.search = el("input", { type: "search", id: "search", placeholder: "name, unit or words", oninput: () => this.list() });
    this.group = el("select", { id: "group", onchange: () => this.list() }, el("option", { value: "" }, "all"), Object.entries(GROUPS).map(([key, name]) => el("option", { value: key }, name)));
    this.modified = el("input", { type: "checkbox", id: "modified", onchange: () => this.list() });
    this.count = el("p", { class: "soft", role: "status" });
    this.body = el("tbody");
    this.diff = el("div", { id: "diff" });
    this.shapes = el("div", { id: "tips", class: "tips", role: "radiogroup", "aria-label": "Tip of the catheter" });
    this.state = el("p", { id: "settings-state", role: "status" });
    panel.append(
      el("div", { class: "tools" }, el("label", { for: "search" }, "Search "), this.search, el("label", { for: "group" }, "Group "), this.group,
        el("label", {}, this.modified, " only what is modified"), el("button", { type: "button", onclick: () => { say(this.state, ""); this.load(); } }, "Read again")),
      this.state,
      card("Changes", this.diff),
      card("Tip of the catheter", this.shapes),
      el("div", { class: "card wide" }, this.count, el("table", { class: "settings" },
        el("thead", {}, el("tr", {}, ["Setting", "Value", "Unit", "Range", "Default", ""].map((text) => el("th", { scope: "col" }, text)))), this.body)),
      card("Keep them", el("p", {}, "Settings that are applied last until the device is switched off or configured again. To keep them in a file:"),
        el("pre", {}, `cathforce config save BUNDLE SETTINGS.toml --link LINK`)));
    this.load();
  }

  async load() {
    try {
      [this.entries, this.tips] = await Promise.all([get("/api/settings"), get("/api/tips")]);
    } catch (error) {
      this.entries = [];
      say(this.state, `The settings are not known: ${error.message}.`);
    }
    this.list();
    this.drawTips();
    this.compare();
  }

  /** Every tip with its drawing; the device's own first where it is none of them. */
  drawTips() {
    if (!this.tips) { this.shapes.replaceChildren(el("p", { class: "soft" }, "The tip is not known.")); return; }
    const own = this.tips.in_use ? [] : [{ name: null, text: "The tip that rig.toml describes.", outline_mm: this.tips.own_outline_mm }];
    const chosen = this.tip ?? this.tips.in_use;
    this.shapes.replaceChildren(...[...own, ...this.tips.known].map((tip) => el("label", { class: "tip", title: tip.text },
      el("input", { type: "radio", name: "tip", id: `tip-${tip.name ?? "own"}`, checked: tip.name === chosen, disabled: !this.app.source.can_change, onchange: () => { this.tip = tip.name === this.tips.in_use || tip.name === null ? null : tip.name; this.compare(); } }),
      outline(tip.outline_mm), el("span", {}, tip.name ?? "its own"))));
  }

  list() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const fits = (entry) => words.every((word) => `${entry.name} ${entry.text} ${entry.unit}`.toLowerCase().includes(word))
      && (!this.group.value || entry.group === this.group.value) && (!this.modified.checked || entry.modified || this.staged.has(entry.name));
    const found = this.entries.filter(fits);
    say(this.count, `${found.length} of ${this.entries.length} settings, ${this.entries.filter((entry) => entry.modified).length} modified`);
    this.body.replaceChildren(...found.map((entry) => this.row(entry)));
  }

  row(entry) {
    const id = `set-${entry.name}`;
    const field = el("input", { id, inputmode: "decimal", autocomplete: "off", value: shown(this.staged.get(entry.name) ?? entry.value), disabled: !this.app.source.can_change, "aria-describedby": `${id}-text`, onchange: () => this.stage(entry, field) });
    const reset = entry.default === null || !this.app.source.can_change ? null : el("button", { type: "button", "aria-label": `Default of ${entry.name}`, onclick: () => { field.value = shown(entry.default); this.stage(entry, field); } }, "Default");
    return el("tr", { class: `${entry.modified ? "modified" : ""} ${this.staged.has(entry.name) ? "staged" : ""}` },
      el("th", { scope: "row" }, el("label", { for: id }, entry.name), entry.modified ? el("span", { class: "badge" }, "modified") : null, el("p", { class: "soft", id: `${id}-text` }, entry.text)),
      el("td", { "data-label": "value" }, field), el("td", { "data-label": "unit" }, unitOf(entry) || "–"),
      el("td", { "data-label": "range" }, `${significant(entry.min)} to ${significant(entry.max)}${entry.whole ? ", whole" : ""}`),
      el("td", { "data-label": "default" }, entry.default === null ? "rig.toml states it" : shown(entry.default)), el("td", {}, reset));
  }

  stage(entry, field) {
    const value = Number(field.value.trim().replace(",", ".")), row = field.closest("tr");
    const wrong = field.value.trim() === "" || !Number.isFinite(value) ? "is no number" : value < entry.min || value > entry.max ? `is outside ${significant(entry.min)} to ${significant(entry.max)} ${unitOf(entry)}` : entry.whole && !Number.isInteger(value) ? "must be a whole number" : null;
    field.setAttribute("aria-invalid", String(Boolean(wrong)));
    field.setCustomValidity(wrong ?? "");
    if (wrong) { say(this.state, `${entry.name}: ${field.value} ${wrong}. It is not among the changes.`); this.staged.delete(entry.name); }
    else {
      say(this.state, "");
      if (Math.fround(value) === Math.fround(entry.value)) this.staged.delete(entry.name); else this.staged.set(entry.name, value);
    }
    row.classList.toggle("staged", this.staged.has(entry.name));
    this.compare();
  }

  compare() {
    const entries = new Map(this.entries.map((entry) => [entry.name, entry]));
    if (this.staged.size === 0 && !this.tip) { this.diff.replaceChildren(el("p", { class: "soft" }, this.app.source.can_change ? "Nothing is staged. Change a value below; nothing reaches the device before Apply." : "This server sends nothing to the device, so nothing can be changed.")); return; }
    this.diff.replaceChildren(
      el("ul", { class: "diff" }, this.tip ? el("li", {}, "tip: ", el("del", {}, this.tips.in_use ?? "its own"), " → ", el("ins", {}, this.tip)) : null, [...this.staged].map(([name, value]) => { const entry = entries.get(name); return el("li", {}, el("code", {}, name), ": ", el("del", {}, entry ? shown(entry.value) : "?"), " → ", el("ins", {}, shown(value)), ` ${entry ? unitOf(entry) : ""}`); })),
      el("div", { class: "row" },
        el("button", { type: "button", class: "primary", id: "apply", onclick: () => this.apply() }, "Apply to the device"),
        el("button", { type: "button", id: "discard", onclick: () => { this.staged.clear(); this.tip = null; this.list(); this.drawTips(); this.compare(); } }, "Discard")));
  }

  async apply() {
    say(this.state, "Sending the settings and reading them back …");
    const wanted = new Map(this.staged), tip = this.tip, count = wanted.size + (tip ? 1 : 0);
    const done = await this.app.change({ do: "apply", changes: Object.fromEntries(wanted), tip });
    if (!done) { say(this.state, "Nothing was changed."); return; }
    this.entries = done.settings;
    const back = new Map(this.entries.map((entry) => [entry.name, entry.value]));
    this.tips = await get("/api/tips");
    const wrong = [...wanted].filter(([name, value]) => Math.fround(back.get(name)) !== Math.fround(value));
    if (tip && this.tips.in_use !== tip) wrong.push(["tip"]);
    this.staged.clear();
    this.tip = null;
    say(this.state, wrong.length ? `The device reads back other values: ${wrong.map(([name]) => name).join(", ")}.` : `${count === 1 ? "One setting was" : `${count} settings were`} applied and read back from the device.${done.band_dropped ? " The device states no uncertainty any more, because that belonged to the model before." : ""}`);
    this.list();
    this.drawTips();
    this.compare();
  }

  draw(frame) {
    // Another program may configure the device as well. What was said of our own change stays.
    if (frame.scene !== undefined && frame.scene !== this.known) { this.known = frame.scene; if (frame.scene > 0) this.load(); }
  }
}

/** The centre line of a tip, the shaft at the left. */
function outline(points) {
  const xs = points.map(([x]) => x), ys = points.map(([, y]) => -y);
  const [left, top] = [Math.min(...xs), Math.min(...ys)].map((v) => v - 3), wide = Math.max(...xs) - left + 3, high = Math.max(...ys) - top + 3;
  return svg("svg", { viewBox: `${left} ${top} ${wide} ${high}`, "aria-hidden": "true" }, svg("path", { d: points.map(([x, y], i) => `${i ? "L" : "M"}${x} ${-y}`).join("") }));
}
