// The oscilloscope: channels, trigger with pre-trigger, cursors, export. Samples are checked by their numbers.

import { card, element, field, save } from "./dom.js";
import { word } from "./words.js";

const KEPT = 60000;
const COLOURS = ["#0a4f8f", "#a11d1d", "#1c6b3c", "#6a3d9a", "#8a5a00", "#005f6b", "#444444", "#a0006e"];
const DASHES = [[], [8, 3], [2, 2], [10, 3, 2, 3], [4, 4], [1, 3], [14, 4], [6, 2, 2, 2]];

let rows = [], names = [], units = [], expected = null, lost = 0;
let canvas, windowS, hold, trigger, edge, level, pre, cursors = [0.25, 0.75], chosen = 0, lostText, readings, isVisible = false, send, boxes;
let caught = null;

export function build(section, hello, orders) {
  send = orders;
  boxes = hello.signals.map(([name, unit, meaning]) => element("input", { type: "checkbox", value: name, title: meaning, onchange: channels }));
  const list = element("fieldset", {}, element("legend", { word: "signals" }), element("div", { class: "bits" },
    ...hello.signals.map(([name, unit], n) => element("label", {}, boxes[n], ` ${name}${unit ? ` (${unit})` : ""}`))));
  canvas = element("canvas", { width: 1100, height: 460, tabindex: 0, role: "img", "aria-label": "oscilloscope", onkeydown: keys, onpointerdown: point });
  windowS = element("select", { onchange: draw }, ...[0.5, 1, 2, 5, 10, 30].map((s) => element("option", { value: s, selected: s === 2 }, String(s))));
  trigger = element("select", { onchange: arm }, element("option", { value: "", word: "trigger_off" }), ...hello.signals.map(([name]) => element("option", { value: name }, name)));
  edge = element("select", { "aria-label": "edge", onchange: arm }, element("option", { value: 1, word: "rising" }), element("option", { value: -1, word: "falling" }));
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
      element("button", { onclick: () => save("scope.svg", svg(), "image/svg+xml") }, "SVG"),
      element("button", { onclick: png }, "PNG"), lostText, element("span", { class: "quiet", word: "zoom_hint" })),
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
  hold.setAttribute("aria-pressed", false);
}

export function frame({ samples }) {
  if (samples.channels.join() !== names.join()) {
    names = samples.channels;
    units = samples.units;
    rows = [];
    expected = null;
    caught = null;
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

function draw() {
  const g = canvas.getContext("2d"), { width, height } = canvas;
  const part = shown(), [from, to] = span();
  g.fillStyle = "#fff";
  g.fillRect(0, 0, width, height);
  const left = 10, right = width - 10, top = 22, bottom = height - 28;
  const x = (t) => left + ((t - from) / (to - from)) * (right - left);
  g.strokeStyle = "#d5dbe1";
  g.fillStyle = "#1b1f24";
  g.font = "13px sans-serif";
  for (let n = 0; n <= 10; n++) {
    const t = from + ((to - from) * n) / 10;
    g.beginPath();
    g.moveTo(x(t), top);
    g.lineTo(x(t), bottom);
    g.stroke();
    if (n % 2 === 0) g.fillText(`${t.toFixed(2)} s`, Math.min(x(t), right - 52), height - 8);
  }
  names.forEach((name, n) => {
    if (!part.length) return;
    const [low, high] = bounds(part, n + 1);
    const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
    g.strokeStyle = COLOURS[n];
    g.lineWidth = 1.6;
    g.setLineDash(DASHES[n]);
    g.beginPath();
    part.forEach((row, k) => (k ? g.lineTo(x(row[0]), y(row[n + 1])) : g.moveTo(x(row[0]), y(row[n + 1]))));
    g.stroke();
    g.fillStyle = COLOURS[n];
    g.fillText(`${name} ${low.toPrecision(3)}…${high.toPrecision(3)} ${units[n]}`, left + 4 + (n % 4) * 265, 14 + Math.floor(n / 4) * 15);
  });
  g.setLineDash([]);
  cursors.forEach((share, n) => {
    g.strokeStyle = "#1b1f24";
    g.lineWidth = n === chosen ? 2 : 1;
    g.beginPath();
    g.moveTo(left + share * (right - left), top);
    g.lineTo(left + share * (right - left), bottom);
    g.stroke();
    g.fillStyle = "#1b1f24";
    g.fillText("AB"[n], left + share * (right - left) + 3, bottom - 4);
  });
  read(part, from, to);
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

function keys(event) {
  const move = { ArrowLeft: -0.005, ArrowRight: 0.005 }[event.key];
  if (event.key === "a" || event.key === "b") chosen = event.key === "a" ? 0 : 1;
  else if (move) cursors[chosen] = Math.max(0, Math.min(1, cursors[chosen] + move));
  else return;
  event.preventDefault();
  draw();
}

function point(event) {
  // The curves leave 10 of the canvas' own units free on either side.
  const x = (event.offsetX * canvas.width) / canvas.clientWidth;
  const share = Math.max(0, Math.min(1, (x - 10) / (canvas.width - 20)));
  chosen = Math.abs(share - cursors[0]) <= Math.abs(share - cursors[1]) ? 0 : 1;
  cursors[chosen] = share;
  draw();
}

export function csv() {
  const head = ["time_s", ...names.map((name, n) => (units[n] ? `${name} ${units[n]}` : name))].join(",");
  return [head, ...shown().map((row) => row.join(","))].join("\n") + "\n";
}

function svg() {
  const part = shown(), [from, to] = span();
  const x = (t) => (10 + ((t - from) / (to - from)) * 1080).toFixed(1);
  const curves = names.map((name, n) => {
    const [low, high] = bounds(part, n + 1);
    const y = (value) => (430 - ((value - low) / (high - low)) * 400).toFixed(1);
    const points = part.map((row) => `${x(row[0])},${y(row[n + 1])}`).join(" ");
    return `<polyline fill="none" stroke="${COLOURS[n]}" stroke-dasharray="${DASHES[n].join(" ")}" points="${points}"/>` +
      `<text x="${14 + n * 260}" y="18" fill="${COLOURS[n]}">${name} ${low.toPrecision(3)}…${high.toPrecision(3)} ${units[n]}</text>`;
  });
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1100 460" font-family="sans-serif" font-size="13"><rect width="1100" height="460" fill="#fff"/>${curves.join("")}<text x="10" y="452">${from.toFixed(3)} s</text><text x="1040" y="452">${to.toFixed(3)} s</text></svg>`;
}

function png() {
  canvas.toBlob((blob) => save("scope.png", blob, "image/png"));
}
