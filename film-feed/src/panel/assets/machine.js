// Film with print marks, reader, roller and tool; the last feeds against their band.

import { card, drawn, element, field, row } from "./dom.js";
import { word } from "./words.js";

// The film in the picture: a millimetre is 0.45 of its units, the reader stands at 700.
const READER = 700;
const SCALE = 0.45;
let warnings, hazards, told = "", marks, roller, readerLamp, position, velocity, bars, list, enabled, toMark, guard, empty;
const feeds = [];

export function build(section, hello, send) {
  const set = (input, value) => send({ do: "set", input, value });
  enabled = element("button", { word: "enable", "aria-pressed": "false", onclick: () => set("enable", enabled.getAttribute("aria-pressed") === "true" ? 0 : 1) });
  toMark = element("button", { word: "to_mark", "aria-pressed": "false", onclick: () => set("read_mark", toMark.getAttribute("aria-pressed") === "true" ? 0 : 1) });
  const start = element("button", { id: "start", class: "main", word: "start_feed", onclick: () => send({ do: "start" }) });

  marks = drawn("g");
  readerLamp = drawn("circle", { cx: READER, cy: 30, r: 8, fill: "none", stroke: "#1b1f24", "stroke-width": 2 });
  roller = drawn("line", { x1: 830, y1: 110, x2: 830, y2: 70, stroke: "#1b1f24", "stroke-width": 4 });
  const label = (key, x, y) => {
    const text = drawn("text", { x, y, "text-anchor": "middle", "data-word": key });
    text.textContent = word(key);
    return text;
  };
  const picture = drawn(
    "svg", { viewBox: "0 0 1000 190", role: "img", label: "film_picture" },
    drawn("rect", { x: 0, y: 66, width: 1000, height: 5, fill: "#cfd8e0", stroke: "#4d5661" }),
    marks,
    drawn("path", { d: `M${READER} 38 V62`, stroke: "#1b1f24", "stroke-width": 3 }), readerLamp, label("reader", READER, 14),
    drawn("circle", { cx: 830, cy: 110, r: 40, fill: "#f2f4f6", stroke: "#1b1f24", "stroke-width": 2 }), roller, label("roller", 830, 170),
    drawn("path", { d: "M950 20 V50 M942 50 h16 l-8 12 z", stroke: "#1b1f24", fill: "#1b1f24", "stroke-width": 3 }), label("tool", 950, 14),
  );
  position = element("output");
  velocity = element("output");
  const values = element("table", {}, element("tbody", {}, row("film_position", position), row("film_speed", velocity)));

  bars = drawn("svg", { viewBox: "0 0 500 220", role: "img", label: "feeds_picture" });
  list = element("tbody");
  empty = element("p", { class: "quiet", word: "no_feed" });
  const heads = ["number", "mode", "error", "duration"].map((key) => element("th", { scope: "col", word: key }));
  const table = element("table", { id: "feeds" }, element("thead", {}, element("tr", {}, ...heads)), list);

  // Pressed is what the frames say, not what was clicked: an order may be refused, and another page may have given it.
  guard = element("button", { word: "guard", "aria-pressed": "false", onclick: () => send({ do: "terminal28", high: guard.getAttribute("aria-pressed") === "true" }) });
  const load = element("input", { type: "number", min: -3, max: 3, step: 0.05, value: 0 });
  const disturb = card("disturb",
    element("div", { class: "tools" },
      // Frames do not tell the mains: two buttons, neither of which claims a state.
      element("button", { word: "mains_off", onclick: () => send({ do: "mains", on: false }) }),
      element("button", { word: "mains_on", onclick: () => send({ do: "mains", on: true }) }),
      guard,
      element("button", { id: "blank-mark", word: "blank_mark", onclick: () => send({ do: "blank_mark" }) }),
      element("button", { word: "no_print", onclick: () => send({ do: "rethread", printed: false }) }),
      element("button", { word: "print", onclick: () => send({ do: "rethread", printed: true }) })),
    element("div", { class: "tools" }, field("load", load), element("button", { word: "set", onclick: () => send({ do: "load", nm: Number(load.value) }) })));

  warnings = element("ul", { id: "warnings" });
  hazards = element("ul", {});
  const advice = card("advice", warnings, element("details", {}, element("summary", { word: "hazards" }), hazards));
  advice.hidden = hello.is_real;

  const film = card("film", picture, element("div", { class: "tools" }, enabled, toMark, start), values);
  film.classList.add("wide");
  section.append(element("div", { class: "columns" }, film, card("feeds", empty, element("p", { class: "quiet", word: "error_band" }), bars, element("div", { class: "scroll", tabindex: "0", role: "region", label: "feeds" }, table)), disturb, advice));
  chart();
}

export function frame({ machine, inputs, drive, advice }) {
  const now = JSON.stringify([advice, word("advice")]);
  if (now !== told) {
    told = now;
    const lines = (fails) => advice.filter((each) => each.fails === fails).map((each) => element("li", {}, element("strong", {}, each.id.replaceAll("_", " ")), ` – ${each.cause}; `, element("em", {}, each.remedy)));
    const found = lines(true);
    warnings.replaceChildren(...(found.length ? found : [element("li", {}, word("advice_none"))]));
    warnings.classList.toggle("alarm", found.length > 0);
    hazards.replaceChildren(...lines(false));
  }
  marks.replaceChildren(...machine.marks.map(([ahead, printed]) => drawn("rect", {
    x: READER - ahead * SCALE - 3, y: 60, width: 6, height: 16, fill: printed ? "#1b1f24" : "#ffffff", stroke: "#1b1f24",
  })));
  readerLamp.setAttribute("fill", machine.reader ? "#1c6b3c" : "none");
  roller.setAttribute("transform", `rotate(${(machine.roller_rad * 180) / Math.PI} 830 110)`);
  position.textContent = `${machine.film_mm.toFixed(3)} mm`;
  velocity.textContent = `${machine.speed_mm_s.toFixed(1)} mm/s`;
  enabled.setAttribute("aria-pressed", inputs[0] === 1);
  toMark.setAttribute("aria-pressed", inputs[4] === 1);
  guard.setAttribute("aria-pressed", !drive.terminal_28);
  if (machine.feeds.length) {
    feeds.push(...machine.feeds);
    feeds.splice(0, Math.max(0, feeds.length - 20));
    spoken();
  }
}

export function spoken() {
  empty.hidden = feeds.length > 0;
  list.replaceChildren(...feeds.toReversed().map((feed) => element("tr", {},
    element("td", { class: "number" }, String(feed.n)),
    element("td", {}, word(feed.mode)),
    element("td", { class: "number" }, feed.error_um === null ? "–" : feed.error_um.toFixed(2)),
    element("td", { class: "number" }, feed.seconds.toFixed(3)))));
  chart();
}

// ±20 µm high, the band drawn.
function chart() {
  const y = (um) => 110 - Math.max(-20, Math.min(20, um)) * 5;
  const line = (um, dash) => drawn("line", { x1: 40, x2: 495, y1: y(um), y2: y(um), stroke: "#4d5661", "stroke-dasharray": dash });
  const label = (um) => {
    const text = drawn("text", { x: 34, y: y(um) + 4, "text-anchor": "end" });
    text.textContent = um;
    return text;
  };
  bars.replaceChildren(
    drawn("rect", { x: 40, width: 455, y: y(10), height: y(-10) - y(10), fill: "#eaf2ec" }),
    line(10, "6 4"), line(-10, "6 4"), line(0, ""), label(10), label(0), label(-10),
    ...feeds.filter((feed) => feed.error_um !== null).map((feed, n) => drawn("rect", {
      x: 46 + n * 22, width: 14, y: Math.min(y(feed.error_um), 110), height: Math.max(2, Math.abs(y(feed.error_um) - 110)),
      fill: Math.abs(feed.error_um) <= 10 ? "#0a4f8f" : "#a11d1d",
    })));
}
