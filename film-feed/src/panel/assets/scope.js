// The oscilloscope: channels, trigger with pre-trigger, cursors, export. Samples are checked by their numbers.

import { card, element, field, save } from "./dom.js";
import { word } from "./words.js";

const KEPT = 60000;
const COLOURS = ["#0a4f8f", "#a11d1d", "#1c6b3c", "#6a3d9a", "#8a5a00", "#005f6b", "#444444", "#a0006e"];
const DASHES = [[], [8, 3], [2, 2], [10, 3, 2, 3], [4, 4], [1, 3], [14, 4], [6, 2, 2, 2]];

let rows = [], names = [], units = [], expected = null, lost = 0;
let canvas, windowS, hold, trigger, edge, level, pre, cursors = [0.25, 0.75], chosen = 0, lostText, readings, isVisible = false, send, boxes;
let caught = null;
// The part of the window that is looked at closely, or none.
let zoomed = null;

export function build(section, hello, orders) {
  send = orders;
  boxes = hello.signals.map(([name]) => element("input", { type: "checkbox", value: name, onchange: channels }));
  const list = element("fieldset", {}, element("legend", { word: "signals" }), element("div", { class: "bits" },
    ...hello.signals.map(([name, unit, meaning], n) => element("label", {}, boxes[n], ` ${name}${unit ? ` (${unit})` : ""}: `, element("span", { class: "quiet", phrase: meaning })))));
  canvas = element("canvas", { width: WIDTH, height: HEIGHT, tabindex: 0, role: "img", label: "curves", onkeydown: keys, onpointerdown: point, onwheel: wheel });
  windowS = element("select", { onchange: whole }, ...[0.5, 1, 2, 5, 10, 30].map((s) => element("option", { value: s, selected: s === 2 }, String(s))));
  trigger = element("select", { onchange: arm }, element("option", { value: "", word: "trigger_off" }), ...hello.signals.map(([name]) => element("option", { value: name }, name)));
  edge = element("select", { label: "edge", onchange: arm }, element("option", { value: 1, word: "rising" }), element("option", { value: -1, word: "falling" }));
  level = element("input", { type: "number", step: "any", value: 0, onchange: arm });
  pre = element("input", { type: "number", min: 0, max: 100, value: 10, onchange: arm });
  hold = element("button", { word: "hold", "aria-pressed": "false", onclick: () => { hold.setAttribute("aria-pressed", hold.getAttribute("aria-pressed") !== "true"); } });
  lostText = element("output", { id: "lost" });
  readings = element("tbody");
  const heads = ["signals", "cursor_a", "cursor_b", "difference"].map((key) => element("th", { scope: "col", word: key }));
  const view = card("scope",
    element("div", { class: "tools" }, field("window", windowS), field("trigger", trigger), edge, field("level", level), field("pre_trigger", pre), hold,
      element("button", { id: "figure73", word: "figure_73", onclick: figure73 })),
    canvas,
    element("div", { class: "tools" },
      element("button", { id: "csv", onclick: () => save("scope.csv", csv(), "text/csv") }, "CSV"),
      element("button", { id: "svg", onclick: () => save("scope.svg", svg(), "image/svg+xml") }, "SVG"),
      element("button", { id: "png", onclick: png }, "PNG"),
      element("button", { id: "zoom-in", word: "zoom_in", onclick: () => zoom(0.5) }), element("button", { id: "zoom-out", word: "zoom_out", onclick: () => zoom(2) }),
      element("button", { id: "zoom-all", word: "zoom_all", onclick: whole }), lostText),
    element("p", { class: "quiet", word: "zoom_hint" }),
    element("table", {}, element("thead", {}, element("tr", {}, ...heads)), readings));
  view.classList.add("wide");
  section.append(element("div", { class: "columns" }, view, card("signals", list)));
}

function channels() {
  const wanted = boxes.filter((box) => box.checked).map((box) => box.value);
  if (wanted.length) send({ do: "channels", names: wanted.slice(0, 8) });
}

// Interpolator and motor speed over one feed, from the start on: figure 73 of the thesis.
function figure73() {
  for (const box of boxes) box.checked = ["POS-NOUT", "MCTRL-NACT"].includes(box.value);
  channels();
  windowS.value = 2;
  trigger.value = "POS-NOUT";
  edge.value = 1;
  level.value = 0.5;
  pre.value = 5;
  arm();
  send({ do: "start" });
}

function arm() {
  caught = null;
  zoomed = null;
  hold.setAttribute("aria-pressed", false);
}

export function spoken() {
  draw();
}

export function frame({ samples }) {
  if (samples.channels.join() !== names.join()) {
    names = samples.channels;
    units = samples.units;
    rows = [];
    expected = null;
    caught = null;
    zoomed = null;
    for (const box of boxes) box.checked = names.includes(box.value);
  }
  if (expected !== null && samples.first !== expected) lost += samples.first - expected;
  expected = samples.first + samples.rows.length;
  window.samplesLost = lost;
  if (hold.getAttribute("aria-pressed") === "true") return;
  for (const row of samples.rows) {
    rows.push(row);
    look();
  }
  if (rows.length > KEPT) rows.splice(0, rows.length - KEPT);
  lostText.textContent = lost ? `${lost} ${word("loss")}` : word("no_loss");
  if (isVisible) draw();
}

// The trigger: freezes the picture once enough has come after it.
function look() {
  const place = names.indexOf(trigger.value) + 1;
  if (!place || rows.length < 2) return;
  const last = rows.at(-1), before = rows.at(-2);
  const at = Number(level.value), up = Number(edge.value);
  if (caught === null && (before[place] - at) * up < 0 && (last[place] - at) * up >= 0) caught = last[0];
  const share = Number(pre.value) / 100;
  if (caught !== null && last[0] - caught >= Number(windowS.value) * (1 - share)) hold.setAttribute("aria-pressed", true);
}

function span() {
  return zoomed ?? fullSpan();
}

function fullSpan() {
  const length = Number(windowS.value);
  const end = rows.length ? rows.at(-1)[0] : length;
  if (caught === null) return [end - length, end];
  const from = caught - (length * Number(pre.value)) / 100;
  return [from, from + length];
}

const shown = () => {
  const [from, to] = span();
  return rows.filter((row) => row[0] >= from && row[0] <= to);
};

// Channels of one unit share one scale, or their curves could not be compared.
function bounds(part, place) {
  const places = names.map((_, n) => n + 1).filter((other) => units[other - 1] === units[place - 1]);
  let low = Infinity, high = -Infinity;
  for (const row of part) {
    for (const other of places) {
      low = Math.min(low, row[other]);
      high = Math.max(high, row[other]);
    }
  }
  const margin = high > low ? 0.06 * (high - low) : Math.max(1, 0.01 * Math.abs(high));
  return [low - margin, high + margin];
}

export function visible(now) {
  isVisible = now;
  if (now) draw();
}

const WIDTH = 1100, HEIGHT = 460, LEFT = 64, RIGHT = WIDTH - 64, TOP = 40, BOTTOM = HEIGHT - 34;

/// Round values from low to high, about eight of them.
function ticks(low, high) {
  const rough = (high - low) / 8;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((each) => each >= rough);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const made = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) made.push([n * step, (n * step).toFixed(decimals)]);
  return made;
}

/// Everything that is drawn, as lines and texts in the units of the picture: on the screen and in the SVG alike. One axis stands left, and
/// one right for a second unit; further units are told by their range alone.
function drawing() {
  const part = shown(), [from, to] = span();
  const x = (time) => LEFT + ((time - from) / (to - from)) * (RIGHT - LEFT);
  const lines = [], texts = [];
  for (const [time, label] of ticks(from, to)) {
    lines.push({ points: [[x(time), TOP], [x(time), BOTTOM]], colour: "#d5dbe1", width: 1, dash: [] });
    texts.push({ text: label, x: x(time), y: BOTTOM + 16, anchor: "middle", colour: "#1b1f24" });
  }
  texts.push({ text: `${word("time")}`, x: (LEFT + RIGHT) / 2, y: HEIGHT - 3, anchor: "middle", colour: "#1b1f24" });
  const kinds = [...new Set(units)];
  names.forEach((name, n) => {
    const [low, high] = part.length ? bounds(part, n + 1) : [0, 1];
    const y = (value) => BOTTOM - ((value - low) / (high - low)) * (BOTTOM - TOP);
    const side = kinds.indexOf(units[n]);
    if (side < 2 && units.indexOf(units[n]) === n) {
      const [at, anchor, edge] = side === 0 ? [LEFT - 6, "end", LEFT] : [RIGHT + 6, "start", RIGHT];
      lines.push({ points: [[edge, TOP], [edge, BOTTOM]], colour: "#1b1f24", width: 1, dash: [] });
      for (const [value, label] of ticks(low, high)) {
        if (side === 0) lines.push({ points: [[LEFT, y(value)], [RIGHT, y(value)]], colour: "#e6eaee", width: 1, dash: [] });
        texts.push({ text: label, x: at, y: y(value) + 4, anchor, colour: "#1b1f24" });
      }
      texts.push({ text: units[n], x: at, y: TOP - 8, anchor, colour: "#1b1f24" });
    }
    // One place each in two rows of four, with a piece of the line: readable in black and white.
    const [place, height] = [LEFT + 20 + (n % 4) * 235, 12 + Math.floor(n / 4) * 15];
    lines.push({ points: [[place, height - 4], [place + 30, height - 4]], colour: COLOURS[n], width: 1.6, dash: DASHES[n] });
    const range = side < 2 ? "" : ` ${low.toPrecision(3)}…${high.toPrecision(3)}`;
    texts.push({ text: `${name}${range}${units[n] ? ` ${units[n]}` : ""}`, x: place + 36, y: height, anchor: "start", colour: COLOURS[n] });
    lines.push({ points: part.map((row) => [x(row[0]), y(row[n + 1])]), colour: COLOURS[n], width: 1.6, dash: DASHES[n] });
  });
  return { lines, texts };
}

function draw() {
  const g = canvas.getContext("2d");
  const { lines, texts } = drawing();
  g.fillStyle = "#fff";
  g.fillRect(0, 0, WIDTH, HEIGHT);
  g.font = "13px sans-serif";
  for (const { points, colour, width, dash } of lines) {
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.setLineDash(dash);
    g.beginPath();
    points.forEach(([px, py], n) => (n ? g.lineTo(px, py) : g.moveTo(px, py)));
    g.stroke();
  }
  g.setLineDash([]);
  for (const { text, x, y, anchor, colour } of texts) {
    g.fillStyle = colour;
    g.textAlign = anchor === "middle" ? "center" : anchor;
    g.fillText(text, x, y);
  }
  g.textAlign = "start";
  cursors.forEach((share, n) => {
    const x = LEFT + share * (RIGHT - LEFT);
    g.strokeStyle = "#1b1f24";
    g.lineWidth = n === chosen ? 2 : 1;
    g.beginPath();
    g.moveTo(x, TOP);
    g.lineTo(x, BOTTOM);
    g.stroke();
    g.fillStyle = "#1b1f24";
    g.fillText("AB"[n], x + 3, BOTTOM - 4);
  });
  read(shown(), ...span());
}

function read(part, from, to) {
  const at = (share) => part.find((row) => row[0] >= from + share * (to - from)) ?? part.at(-1);
  const [a, b] = [at(cursors[0]), at(cursors[1])];
  if (!a || !b) return readings.replaceChildren();
  const line = (name, values) => element("tr", {}, element("th", { scope: "row" }, name), ...values.map((value) => element("td", { class: "number" }, value)));
  readings.replaceChildren(
    line("t (s)", [a[0].toFixed(3), b[0].toFixed(3), (b[0] - a[0]).toFixed(3)]),
    ...names.map((name, n) => line(`${name}${units[n] ? ` (${units[n]})` : ""}`, [a[n + 1].toFixed(3), b[n + 1].toFixed(3), (b[n + 1] - a[n + 1]).toFixed(3)])));
}

/// Zooms about the chosen cursor, or about a share of the window: below 1 closer, above 1 wider. The picture stands still from then on.
function zoom(factor, about = cursors[chosen]) {
  hold.setAttribute("aria-pressed", true);
  const [from, to] = span(), full = fullSpan();
  const length = Math.max(0.01, (to - from) * factor);
  if (length >= full[1] - full[0]) return whole();
  const at = from + about * (to - from);
  const begin = Math.min(Math.max(full[0], at - about * length), full[1] - length);
  zoomed = [begin, begin + length];
  draw();
}

function whole() {
  zoomed = null;
  draw();
}

function pan(share) {
  if (!zoomed) return;
  const full = fullSpan(), length = zoomed[1] - zoomed[0];
  const begin = Math.min(Math.max(full[0], zoomed[0] + share * length), full[1] - length);
  zoomed = [begin, begin + length];
}

function keys(event) {
  const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (event.key === "a" || event.key === "b") chosen = event.key === "a" ? 0 : 1;
  else if (event.key === "+" || event.key === "-") zoom(event.key === "+" ? 0.5 : 2);
  else if (move && event.shiftKey) pan(0.1 * move);
  else if (move) cursors[chosen] = Math.max(0, Math.min(1, cursors[chosen] + 0.005 * move));
  else return;
  event.preventDefault();
  draw();
}

/// Where in the window something on the canvas is.
function shareOf(event) {
  const x = (event.offsetX * canvas.width) / canvas.clientWidth;
  return Math.max(0, Math.min(1, (x - LEFT) / (RIGHT - LEFT)));
}

function wheel(event) {
  event.preventDefault();
  zoom(event.deltaY < 0 ? 0.8 : 1.25, shareOf(event));
}

function point(event) {
  const share = shareOf(event);
  chosen = Math.abs(share - cursors[0]) <= Math.abs(share - cursors[1]) ? 0 : 1;
  cursors[chosen] = share;
  draw();
}

export function csv() {
  const head = ["time_s", ...names.map((name, n) => (units[n] ? `${name} ${units[n]}` : name))].join(",");
  return [head, ...shown().map((row) => row.join(","))].join("\n") + "\n";
}

export function svg() {
  const { lines, texts } = drawing();
  const escape = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
  const drawnLines = lines.map(({ points, colour, width, dash }) =>
    `<polyline fill="none" stroke="${colour}" stroke-width="${width}" stroke-dasharray="${dash.join(" ")}" points="${points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ")}"/>`);
  const drawnTexts = texts.map(({ text, x, y, anchor, colour }) => `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" fill="${colour}">${escape(text)}</text>`);
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${WIDTH} ${HEIGHT}" font-family="sans-serif" font-size="13"><rect width="${WIDTH}" height="${HEIGHT}" fill="#fff"/>${drawnLines.join("")}${drawnTexts.join("")}</svg>`;
}

function png() {
  canvas.toBlob((blob) => save("scope.png", blob, "image/png"));
}
