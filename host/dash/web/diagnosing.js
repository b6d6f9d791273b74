// A diagnosis that runs: how far it is, the best explanation so far, and then its page.

import { el, say } from "./dom.js";
import { percent } from "./format.js";
import { get } from "./server.js";

/** From one question to the next [ms]. */
const EVERY = 500;

/** A time as it is said: to five seconds, and in minutes where it is long. */
const roughly = (seconds) => (seconds < 90 ? `${Math.max(5, 5 * Math.round(seconds / 5))} s` : `${Math.round(seconds / 60)} min`);

export class Diagnosing {
  constructor(panel) {
    this.done = el("progress", { id: "done", max: 1, value: 0, "aria-label": "Simulations done" });
    this.count = el("p", { id: "count" }, "The trials are read.");
    this.left = el("p", { id: "left", class: "soft" }, "");
    this.best = el("div", { id: "best" }, el("p", { class: "soft" }, "Each effect is tried on its own first."));
    panel.append(
      el("section", { class: "card" }, el("h1", {}, "The diagnosis runs"), this.done, this.count, this.left),
      el("section", { class: "card" }, el("h2", {}, "Best explanation so far"), this.best));
    this.ask();
  }

  async ask() {
    try {
      const state = await get("/api/state");
      // The page of the answer is another one.
      if (state.mode !== "diagnosing") return location.reload();
      this.show(state);
    } catch {
      say(this.left, "The program has ended.");
      return;
    }
    setTimeout(() => this.ask(), EVERY);
  }

  show({ simulations, expected, seconds, seconds_left: left, best }) {
    if (seconds === null) return;
    this.done.value = expected ? Math.min(0.99, simulations / expected) : 0;
    say(this.count, `${simulations} simulations of trials are done, of about ${expected}, in ${Math.round(seconds)} s.`);
    const early = simulations < expected ? "Too early to say how long it will take." : "It takes longer than usual.";
    say(this.left, left === null ? early : `About ${roughly(left)} are left.`);
    if (best && JSON.stringify(best) !== this.known) {
      this.known = JSON.stringify(best);
      const lines = best.sentences.length
        ? [...best.sentences, `That closes ${percent(Math.max(0, best.closes))} of the gap above the floor.`]
        : ["The nominal model explains the measurements as well as any effect that was tried."];
      this.best.replaceChildren(...lines.map((text) => el("p", {}, text)), el("p", { class: "soft" }, `${best.sets} sets of effects were compared. This may still change.`));
    }
  }
}
