// A diagnosis: the answer first, then where, which, how far, what next. Both versions of the format are shown.

import { el, svg } from "./dom.js";
import { capital, channel, effect, number, parameter, percent, quantity, significant } from "./format.js";
import { css, colourOf } from "./scene.js";

const VERDICTS = { no_gap: "There is no gap", named: "The cause is named", partial: "A part is explained", unknown: "No known cause explains it", inconclusive: "The data do not decide" };
const list = (names) => (names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`);
const hover = (id, text) => el("span", { title: id }, text);

/** The answer in a sentence, where the file has none. */
function sentence(d) {
  if (d.sentence) return d.sentence;
  const names = (d.effects ?? []).map((e) => effect(e.id)), force = d.gap?.force_rms_N;
  const figures = force ? ` The force error goes from ${quantity(force.before, "N")} to ${quantity(force.after, "N")}; the floor is ${quantity(force.floor, "N")}.` : "";
  switch (d.verdict) {
    case "no_gap": return "The nominal model explains the measurements down to their noise.";
    case "named": return `${capital(list(names))} ${names.length > 1 ? "explain" : "explains"} the gap.${figures}`;
    case "partial": return `${capital(list(names))} ${names.length > 1 ? "explain" : "explains"} a part of the gap; no known effect explains the rest.${figures}`;
    case "inconclusive": return "The measurements do not decide what causes the gap.";
    default: return "There is a gap, and no known effect explains it.";
  }
}

export class Diagnosis {
  constructor(panel, app) {
    const d = app.diagnosis;
    const parts = [
      ["answer", "The answer", this.answer(d)], ["where", "Where", this.where(d)], ["which", "Which", this.which(d)],
      ["far", "How far", this.far(d)], ["alike", "What cannot be told apart", this.alike(d)], ["next", "What to record next", this.next(d)],
      ["shown", "What these trials would have shown", this.detectable(d)], ["caveats", "Caveats", this.caveats(d)], ["again", "The same again", this.again(d)],
    ].filter(([, , part]) => part);
    panel.append(el("nav", { class: "contents", "aria-label": "Contents" }, parts.map(([id, name]) => el("a", { href: `#d-${id}` }, name))),
      ...parts.map(([id, name, part]) => el("section", { id: `d-${id}`, class: "card" }, id === "answer" ? null : el("h2", {}, name), part)));
  }

  answer(d) {
    const force = d.gap?.force_rms_N;
    const tile = (value, label) => el("div", { class: "tile" }, el("b", {}, value), el("span", {}, label));
    return el("div", {}, el("p", { class: "soft" }, `${VERDICTS[d.verdict] ?? d.verdict} · ${d.bundle ?? ""}`), el("h1", { id: "sentence" }, sentence(d)),
      el("div", { class: "tiles" }, force ? [tile(quantity(force.before, "N"), "force error before (RMS, held out)"), tile(quantity(force.after, "N"), "after the correction"), tile(quantity(force.floor, "N"), "floor: noise of the sensor")] : null,
        d.none_of_mine === undefined || d.none_of_mine === null ? null : tile(percent(d.none_of_mine), "probability that the cause is none of the known effects")),
      d.cut ? el("p", { class: "warn" }, "A time budget ended the search before it was done.") : null);
  }

  /** The error along the vessel, from the entry to the depth. */
  where(d) {
    const cells = (d.where ?? []).filter((cell) => cell.arc_m);
    if (cells.length === 0) return null;
    const lanes = [...new Set(cells.map((cell) => `${cell.channel}\u0000${cell.phase}`))].slice(0, 10);
    // Motions at the same place add up.
    const places = new Map();
    for (const cell of cells) {
      const key = [cell.channel, cell.phase, ...cell.arc_m].join("\u0000"), known = places.get(key) ?? { ...cell, gap_share: 0, motions: [] };
      known.gap_share += cell.gap_share;
      known.motions.push(cell.regime);
      places.set(key, known);
    }
    const drawnCells = [...places.values()];
    const reach = Math.max(...cells.map((cell) => cell.arc_m[1])) * 1e3, most = Math.max(...drawnCells.map((cell) => cell.gap_share));
    const mark = [5, 10, 20, 25, 50, 100, 200].find((mm) => reach / mm <= 8) ?? 500, end = mark * Math.ceil(reach / mark);
    const [wide, left, row] = [720, 230, 30], high = lanes.length * row + 46;
    const x = (mm) => left + (mm / end) * (wide - left - 16);
    const drawn = lanes.flatMap((lane, i) => {
      const [name, phase] = lane.split("\u0000"), y = 6 + i * row;
      return [
        svg("text", { x: left - 8, y: y + 17, "text-anchor": "end" }, `${channel(name).replace("force on the vessel along ", "force along ")}, ${phase}`, svg("title", {}, name)),
        svg("rect", { x: left, y, width: wide - left - 16, height: row - 6, class: "lane" }),
        ...drawnCells.filter((cell) => cell.channel === name && cell.phase === phase).map((cell) => svg("rect", { x: x(1e3 * cell.arc_m[0]), y, width: Math.max(2, x(1e3 * cell.arc_m[1]) - x(1e3 * cell.arc_m[0])), height: row - 6, style: `fill: ${css(colourOf(cell.gap_share / most))}`, opacity: 0.9 },
          svg("title", {}, `${number(1e3 * cell.arc_m[0], 0)} to ${number(1e3 * cell.arc_m[1], 0)} mm inside, ${cell.motions.join("; ")}: ${percent(cell.gap_share)} of the gap`))),
      ];
    });
    const marks = Array.from({ length: Math.round(end / mark) + 1 }, (_, i) => i * mark);
    const rows = cells.slice(0, 12).map((cell) => el("tr", {}, el("td", {}, hover(cell.channel, channel(cell.channel))), el("td", {}, cell.phase), el("td", {}, cell.regime), el("td", {}, `${number(1e3 * cell.arc_m[0], 0)} to ${number(1e3 * cell.arc_m[1], 0)} mm`), el("td", {}, percent(cell.time_share)), el("td", {}, `${percent(cell.gap_share)} (${percent(cell.gap_share_low)} to ${percent(cell.gap_share_high)})`), el("td", {}, cell.note ?? "")));
    return el("div", {}, el("figure", { class: "wide" },
      svg("svg", { viewBox: `0 0 ${wide} ${high}`, id: "hero", role: "img", "aria-label": "Share of the gap by channel and by how far the tip is inside" }, drawn,
        marks.flatMap((mm) => [svg("line", { class: "grid", x1: x(mm), x2: x(mm), y1: 0, y2: high - 38 }), svg("text", { x: x(mm), y: high - 24, "text-anchor": "middle" }, number(mm, 0))]),
        svg("text", { x: (left + wide) / 2, y: high - 6, "text-anchor": "middle" }, "length inside the vessel, mm, from the entry")),
      el("figcaption", {}, `How much of the gap lies where: from dark, none, to yellow, ${percent(most)} of it.`)),
      table(["Channel", "Phase", "Motion", "Inside", "Of the time", "Of the gap (90 %)", "Note"], rows));
  }

  which(d) {
    const effects = d.effects ?? [];
    const rows = effects.flatMap((e) => Object.entries(e.parameters ?? {}).map(([name, p], i) => el("tr", {},
      el("td", {}, i === 0 ? hover(e.id, capital(effect(e.id))) : "", i === 0 && e.form?.name ? el("p", { class: "soft" }, `form: ${parameter(e.form.name)}${e.form.probability === undefined ? "" : ` (${percent(e.form.probability)})`}`) : null),
      el("td", {}, hover(`${e.id}.${name}`, parameter(name))), el("td", {}, interval(p)),
      el("td", {}, `${quantity(p.value, p.unit)} (${quantity(p.low, p.unit)} to ${quantity(p.high, p.unit)})`),
      el("td", {}, i === 0 ? percent(e.shrink) : ""), el("td", {}, i === 0 && e.confidence !== null && e.confidence !== undefined ? percent(e.confidence) : ""))));
    const ranking = [...(d.ranking ?? [])].sort((a, b) => b.shrink - a.shrink).slice(0, 14);
    if (rows.length === 0 && ranking.length === 0) return null;
    return el("div", {}, rows.length ? table(["Effect", "Parameter", "90 % interval", "Value", "Closes", "Confidence"], rows) : el("p", {}, "No effect is named."),
      ranking.length ? el("figure", {}, bars(ranking.map((r) => [capital(effect(r.id)), r.shrink, r.id, effects.some((e) => e.id === r.id)]), "share of the gap that each effect closes alone, %"), el("figcaption", {}, "Tried alone, on data that its fit had not seen. Named effects are darker.")) : null);
  }

  far(d) {
    const names = { force_rms_N: ["force, RMS", "N"], force_mae_N: ["force, mean absolute error", "N"], force_peak_N: ["largest force of a trial", "N"], tip_rms_m: ["tip, RMS", "m"], tip_frechet_m: ["path of the tip", "m"], shape_rms_m: ["shape, RMS", "m"] };
    const rows = Object.entries(names).filter(([key]) => d.gap?.[key]).map(([key, [name, unit]]) => { const { before, after, floor } = d.gap[key]; return el("tr", {}, el("td", {}, name), el("td", {}, quantity(before, unit)), el("td", {}, quantity(after, unit)), el("td", {}, quantity(floor, unit)), el("td", {}, threeBars(before, after, floor))); });
    const series = (d.series ?? []).map((of) => trialPlot(of)).filter(Boolean);
    if (rows.length === 0 && series.length === 0) return null;
    return el("div", {}, table(["Held out", "Nominal model", "Corrected", "Floor", ""], rows),
      d.held_out ? el("p", { class: "soft" }, `Counted over the trials ${d.held_out.map((n) => String(n).padStart(3, "0")).join(", ")}, each held out in turn.`) : null,
      series.length ? series : el("p", { class: "soft" }, "The measured, nominal and corrected force of each trial are in the page of `cathforce gap diagnose --report`; this file has no curves."));
  }

  alike(d) {
    const sets = d.confusable ?? [];
    return sets.length ? el("ul", {}, sets.map((set) => el("li", {}, `These data do not tell apart: ${list(set.map(effect))}.`))) : null;
  }

  next(d) {
    const next = d.next_experiment;
    if (!next) return null;
    const what = next.what ? `${capital(next.what)}. ` : "";
    return el("div", {}, el("p", {}, el("b", {}, next.segment), `: ${what}It separates ${list((next.separates ?? []).map(effect))}.`), el("pre", {}, next.command ?? `cathforce gap protocol --segment ${next.segment}`));
  }

  detectable(d) {
    const rows = (d.detectable ?? []).map((e) => el("tr", {}, el("td", {}, hover(e.id, capital(effect(e.id)))), el("td", {}, parameter(e.parameter ?? "")), el("td", {}, e.size === null || e.size === undefined ? "never by these trials" : quantity(e.size, e.unit))));
    return rows.length ? el("div", {}, el("p", { class: "soft" }, "The smallest size of each effect that would have shown with a probability of 90 %."), table(["Effect", "Parameter", "Smallest size"], rows)) : null;
  }

  caveats(d) {
    const remarks = [...(d.remarks ?? [])];
    if (d.left?.words) remarks.unshift(d.left.words);
    return remarks.length ? el("ul", {}, remarks.map((text) => el("li", {}, `${capital(text)}${/[.!?]$/.test(text) ? "" : "."}`))) : null;
  }

  again(d) {
    const r = d.reproduce;
    return r?.command ? el("div", {}, el("pre", {}, r.command), el("p", { class: "soft" }, `version ${r.version}, bundle SHA-256 ${r.bundle_sha256}${d.seconds ? `, ${significant(d.seconds)} s` : ""}`)) : null;
  }

  draw() {}
}

function table(heads, rows) {
  return el("div", { class: "wide" }, el("table", {}, el("thead", {}, el("tr", {}, heads.map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, rows)));
}

/** Bars with their names and shares. */
function bars(rows, axis) {
  const [wide, left, row] = [640, 230, 22], high = rows.length * row + 40, most = Math.max(...rows.map(([, share]) => share), 0.05);
  const x = (share) => left + (Math.max(0, share) / Math.max(1, most)) * (wide - left - 60);
  return svg("svg", { viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": rows.map(([name, share]) => `${name} ${percent(share)}`).join("; ") },
    [0, 0.25, 0.5, 0.75, 1].flatMap((share) => [svg("line", { class: "grid", x1: x(share), x2: x(share), y1: 0, y2: high - 34 }), svg("text", { x: x(share), y: high - 20, "text-anchor": "middle" }, 100 * share)]),
    rows.flatMap(([name, share, id, named], i) => [svg("text", { x: left - 8, y: i * row + 15, "text-anchor": "end" }, name, svg("title", {}, id)), svg("rect", { class: named ? "bar" : "bar faint", x: left, y: i * row + 3, width: Math.max(1, x(share) - left), height: row - 7, rx: 2 }), svg("text", { x: x(share) + 5, y: i * row + 15 }, percent(share))]),
    svg("text", { x: (left + wide) / 2, y: high - 4, "text-anchor": "middle" }, axis));
}

/** A 90 % interval and its value on one line. */
function interval({ value, low, high }) {
  if (![value, low, high].every(Number.isFinite)) return "";
  const from = Math.min(low, value), to = Math.max(high, value), space = (to - from) * 0.25 || Math.abs(value) * 0.1 || 1;
  const x = (v) => 4 + ((v - from + space) / (to - from + 2 * space)) * 112;
  return svg("svg", { viewBox: "0 0 120 16", class: "interval", "aria-hidden": "true" }, svg("line", { class: "whisker", x1: x(low), x2: x(high), y1: 8, y2: 8 }), svg("circle", { class: "bar", cx: x(value), cy: 8, r: 4 }));
}

function threeBars(before, after, floor) {
  const most = Math.max(before, after, floor) || 1;
  return svg("svg", { viewBox: "0 0 160 30", class: "three", "aria-hidden": "true" }, [[before, "bar before"], [after, "bar"], [floor, "bar faint"]].map(([value, kind], i) => svg("rect", { class: kind, x: 0, y: i * 10, width: Math.max(1, 160 * value / most), height: 8, rx: 2 })));
}

/** Measured, nominal and corrected force of one trial in one plot, where the file has them. */
function trialPlot(of) {
  const times = of.t_s, lines = ["measured", "nominal", "corrected"].filter((name) => Array.isArray(of[name]));
  if (!Array.isArray(times) || lines.length === 0) return null;
  const all = lines.flatMap((name) => of[name]).filter(Number.isFinite), [low, high] = [Math.min(...all, 0), Math.max(...all, 1e-9)];
  const x = (t) => 50 + ((t - times[0]) / (times[times.length - 1] - times[0] || 1)) * 580, y = (v) => 150 - ((v - low) / (high - low || 1)) * 135;
  return el("figure", {}, svg("svg", { viewBox: "0 0 640 180", role: "img", "aria-label": `Trial ${of.trial}: ${list(lines)} force` },
    [low, high].map((v) => svg("text", { x: 46, y: y(v) + 4, "text-anchor": "end" }, quantity(v, of.unit ?? "N"))),
    lines.map((name) => svg("path", { class: `curve ${name}`, d: times.map((t, i) => `${i ? "L" : "M"}${x(t).toFixed(1)} ${y(of[name][i]).toFixed(1)}`).join("") })),
    svg("text", { x: 340, y: 174, "text-anchor": "middle" }, "time, s")),
    el("figcaption", {}, `Trial ${of.trial}, ${channel(of.channel ?? "force")}: `, lines.flatMap((name) => [el("i", { class: `line ${name}` }), `${name} `])));
}
