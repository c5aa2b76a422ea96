// The parameter channel: its Petri net with the tokens, the telegram at work, what was refused.

import { arrowHead, card, drawn, element, row } from "./dom.js";
import { word } from "./words.js";

const PLACES = { 1: [50, 60], 2: [170, 60], 3: [290, 60], 4: [430, 60], 5: [430, 140], 6: [560, 60], 7: [430, 215], 8: [680, 215], 9: [680, 100], 10: [50, 190], 11: [200, 190] };
const TRANSITIONS = { 1: [110, 60], 2: [125, 172], 3: [230, 40], 4: [230, 80], 5: [350, 75], 6: [350, 160], 7: [495, 60], 8: [610, 85], 9: [560, 165], 10: [655, 158], 11: [705, 158], 12: [300, 250], 13: [125, 208] };
let circles = {}, values = {}, troubles;

export function build(section, hello) {
  const arcs = [];
  for (const t of hello.net) {
    const [x, y] = TRANSITIONS[t.n];
    // From rim to rim: a place has a radius of 15, a transition is 6 wide.
    const arc = (from, to, startGap, endGap) => {
      const length = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
      const [dx, dy] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
      return drawn("line", { x1: from[0] + dx * startGap, y1: from[1] + dy * startGap, x2: to[0] - dx * endGap, y2: to[1] - dy * endGap, stroke: "#4d5661", "marker-end": "url(#net-arrow)" });
    };
    for (const place of t.takes) arcs.push(arc(PLACES[place], [x, y], 16, 5));
    for (const place of t.puts) arcs.push(arc([x, y], PLACES[place], 4, 17));
    const text = drawn("text", { x: x - 8, y: y - 11 });
    text.textContent = `T${t.n}`;
    arcs.push(drawn("rect", { x: x - 3, y: y - 8, width: 6, height: 16, fill: "#1b1f24" }), text);
  }
  const places = Object.entries(PLACES).map(([number, [cx, cy]]) => {
    const circle = drawn("circle", { cx, cy, r: 15, fill: "#fff", stroke: "#1b1f24", "stroke-width": 2 });
    const token = drawn("circle", { cx, cy, r: 7, fill: "#0a4f8f" });
    const text = drawn("text", { x: cx + 18, y: cy - 10 });
    text.textContent = number;
    circles[number] = token;
    return drawn("g", {}, circle, token, text);
  });
  const net = card("net", drawn("svg", { viewBox: "0 0 740 265", role: "img", label: "net_picture" }, arrowHead("net-arrow", "#4d5661"), ...arcs, ...places));
  net.classList.add("wide");
  values = Object.fromEntries(["telegram", "sent", "received", "rounds", "round_time"].map((key) => [key, element("output", { class: "mono" })]));
  troubles = element("ul", {});
  section.append(element("div", { class: "columns" }, net,
    card("telegram", element("table", {}, element("tbody", {}, ...Object.entries(values).map(([key, out]) => row(key, out))))),
    card("troubles", troubles)));
}

let last = null;

export function spoken() {
  last = null;
}

export function frame({ parameters }) {
  for (const [number, token] of Object.entries(circles)) token.setAttribute("visibility", parameters.marked.includes(Number(number)) ? "visible" : "hidden");
  values.telegram.textContent = parameters.telegram;
  values.sent.textContent = parameters.sent;
  values.received.textContent = parameters.received;
  values.rounds.textContent = parameters.rounds;
  values.round_time.textContent = parameters.round_ms.toFixed(0);
  const now = parameters.troubles.join("\n");
  if (now !== last) {
    last = now;
    const lines = parameters.troubles.length ? parameters.troubles : [word("none")];
    troubles.replaceChildren(...lines.map((line) => element("li", {}, line)));
  }
}
