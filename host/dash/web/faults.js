// The faults of the device, until somebody acknowledges them.

import { card, el } from "./dom.js";
import { get } from "./server.js";
import { number } from "./format.js";

const time = (ms) => new Date(ms).toLocaleTimeString([], { hour12: false });

export class Faults {
  constructor(panel, app) {
    this.app = app;
    this.list = el("div", { id: "fault-list" });
    this.all = el("div", {});
    panel.append(this.list, card("Every fault that there is", this.all));
    get("/api/faults").then((pages) => {
      this.pages = pages;
      this.all.replaceChildren(...Object.entries(pages).map(([name, text]) => el("details", {}, el("summary", {}, name), page(text))));
      this.key = null;
      this.app.redraw();
    });
  }

  draw(frame) {
    const faults = this.app.recording?.faults ?? frame.faults ?? [];
    // Rebuilt only when something changed, so that a button stays the same under the pointer.
    const key = JSON.stringify(faults.map((f) => [f.name, f.count, f.active, Math.floor((f.last_ms ?? 0) / 1000)])) + Boolean(this.pages);
    if (key === this.key) return;
    const focused = document.activeElement?.dataset?.fault;
    const open = new Set([...this.list.querySelectorAll("details[open]")].map((d) => d.dataset.fault));
    this.key = key;
    const when = (f) => (f.first_ms === undefined
      ? `first at ${number(f.first_s, 3)} s, last at ${number(f.last_s, 3)} s`
      : `first at ${time(f.first_ms)}, last at ${time(f.last_ms)}`);
    this.list.replaceChildren(...(faults.length === 0 ? [el("p", { class: "card good" }, this.app.recording ? "The device had no fault in this recording." : "No fault waits to be acknowledged.")] : faults.map((f) => {
      const text = this.pages?.[f.name];
      return el("section", { class: `card fault ${f.active ? "active" : ""}` },
        el("h2", {}, f.name, " ", el("small", {}, f.active === undefined ? "" : f.active ? "the device has it now" : "over, not acknowledged")),
        el("p", {}, `${when(f)}, ${f.count === 1 ? "once" : `${f.count} times`}.`),
        el("p", {}, el("b", {}, "Cause: "), `${f.cause}.`), el("p", {}, el("b", {}, "Next: "), `${f.next}.`),
        this.app.source.can_change ? el("button", { type: "button", class: "primary", "data-fault": f.name, onclick: () => this.app.change({ do: "acknowledge", fault: f.name }) }, f.active ? "Acknowledge and clear" : "Acknowledge") : null,
        text ? el("details", { "data-fault": f.name, open: open.has(f.name) }, el("summary", {}, `The page about ${f.name}`), page(text)) : null);
    })));
    if (focused) this.list.querySelector(`button[data-fault="${CSS.escape(focused)}"]`)?.focus();
  }
}

/** A page of the book as text: headings, lists and paragraphs. */
function page(text) {
  const parts = text.split(/\n\s*\n/).map((block) => {
    const heading = block.match(/^#+ (.*)/);
    if (heading) return el("h3", {}, heading[1]);
    if (/^( {4}|```)/.test(block)) return el("pre", {}, block.replace(/^```.*\n?|```$/gm, ""));
    if (/^(\d+\.|-|\*) /.test(block)) return el("ul", {}, block.split(/\n(?=(?:\d+\.|-|\*) )/).map((item) => el("li", {}, plain(item.replace(/^(\d+\.|-|\*) /, "")))));
    return el("p", {}, plain(block));
  });
  return el("div", { class: "page" }, parts);
}

const plain = (text) => text.replaceAll("\n", " ").replace(/\[([^\]]*)\]\([^)]*\)/g, "$1").replaceAll("`", "").replaceAll("**", "");
