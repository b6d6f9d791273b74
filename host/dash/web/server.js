// Everything that is asked of the server.

import { el } from "./dom.js";

const KEY = "cathforce-token";

async function answered(answer) {
  const body = await answer.json().catch(() => ({}));
  if (!answer.ok) throw Object.assign(new Error(body.error ?? `the server answered ${answer.status}`), { status: answer.status });
  return body;
}

/** A page that was saved as a file holds its answers: this is the one to a path. */
const packed = (path) => document.getElementById(`packed${path}`);

export const get = async (path) => {
  const own = packed(path);
  return own ? JSON.parse(own.textContent) : answered(await fetch(path));
};

const post = (path, token, body) => fetch(path, {
  method: "POST",
  headers: { "Content-Type": "application/json", Authorization: `Bearer ${token}` },
  body: JSON.stringify(body),
});

/** Asks for a change; asks for the token first where it is not known. */
export async function change(body) {
  const token = sessionStorage.getItem(KEY) ?? (await askForToken());
  if (!token) throw new Error("nothing was changed: a change needs the token");
  const answer = await post("/api/do", token, body);
  if (answer.status === 401) sessionStorage.removeItem(KEY);
  return answered(answer);
}

/** Shows the dialogue until the right token is given or the viewer gives up. */
function askForToken() {
  const dialogue = document.getElementById("token");
  return new Promise((resolve) => {
    const field = el("input", { type: "password", id: "token-field", autocomplete: "off", spellcheck: "false", required: true });
    const wrong = el("p", { class: "bad", role: "alert" });
    const form = el("form", { method: "dialog" },
      el("h2", { id: "token-title" }, "Token"),
      el("p", {}, "Watching needs none, but a change does. The token is in the file whose path `cathforce dash` printed."),
      el("label", { for: "token-field" }, "Token"), field, wrong,
      el("div", { class: "row" },
        el("button", { type: "submit", class: "primary" }, "Use it"),
        el("button", { type: "button", onclick: () => dialogue.close() }, "Cancel")));
    let token = null;
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const given = field.value.trim();
      const answer = await post("/api/token", given, {});
      if (!answer.ok) { wrong.textContent = "This is not the token of this server."; return; }
      sessionStorage.setItem(KEY, given);
      token = given;
      dialogue.close();
    });
    dialogue.replaceChildren(form);
    dialogue.addEventListener("close", () => resolve(token), { once: true });
    dialogue.showModal();
  });
}

/**
 * Follows a link. `onPicture` gets each picture; `onLost` is told when the server is gone. A picture is asked
 * for only when the one before has been drawn.
 */
export class Live {
  constructor(onPicture, onLost) {
    Object.assign(this, { onPicture, onLost, offset: null, best: Infinity, closed: false });
    this.connect();
    setInterval(() => this.askClock(), 1000);
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/ws`);
    this.socket.addEventListener("open", () => { this.best = Infinity; this.askClock(); });
    this.socket.addEventListener("message", (event) => this.take(JSON.parse(event.data)));
    this.socket.addEventListener("close", () => { this.onLost(); setTimeout(() => this.connect(), 1000); });
  }

  askClock() {
    // A round trip becomes longer and shorter, and clocks drift: the shortest of late counts.
    this.best *= 1.1;
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(`clock ${performance.now()}`);
  }

  take(message) {
    if (message.clock !== undefined) {
      const now = performance.now(), sent = Number(message.clock), trip = now - sent;
      if (trip <= this.best) { this.best = trip; this.offset = message.server_ms - (now + sent) / 2; }
      return;
    }
    message.arrived = performance.now();
    this.onPicture(message);
  }

  drawn() {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send("drawn");
  }

  /** The server's clock at this moment, as well as it is known [ms]. */
  now() {
    return this.offset === null ? null : performance.now() + this.offset;
  }
}
