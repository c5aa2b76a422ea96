// The drive: state diagram, words bit by bit, fault with its remedy, codes.

import { arrowHead, card, drawn, element, field, lettering, row } from "./dom.js";
import { phrase, word } from "./words.js";

// Where each state stands in the diagram.
const PLACES = {
  "not ready to switch on": [130, 30], "switch-on disabled": [130, 100], "ready to switch on": [130, 170], "switched on": [130, 240],
  "operation enabled": [130, 310], "quick stop active": [430, 310], "fault reaction active": [610, 170], "fault": [610, 30],
};
// How the transitions run, and where their numbers stand. Number 0 comes from nowhere, 13 from everywhere.
const WAYS = {
  0: ["M130 -12 V11", 144, 4], 1: ["M130 48 V81", 144, 68], 2: ["M100 118 V151", 88, 138], 7: ["M160 152 V119", 174, 138], 3: ["M100 188 V221", 88, 208],
  6: ["M160 222 V189", 174, 208], 4: ["M100 258 V291", 88, 278], 5: ["M160 292 V259", 174, 278], 8: ["M34 310 H12 V170 H33", 22, 240], 10: ["M226 240 H262 V108 H227", 276, 180],
  9: ["M226 302 H300 V100 H227", 314, 220], 11: ["M226 316 H333", 280, 332], 12: ["M430 291 V92 H227", 444, 200], 13: ["M610 234 V190", 628, 216], 14: ["M610 151 V50", 628, 105], 15: ["M514 30 H330 V84 H227", 344, 62],
};
// Bits by their meaning at 1, as in the profile and in the film feed (sections 3 and 7 of its specification).
const CONTROL = ["switch on", "enable voltage", "no quick stop", "enable operation", "no quick stop in the drive", "no program start", "no program stop", "reset fault", "–", "–", "–", "reset the program", "manual", "manual negative", "manual positive", "print-mark mode"];
const STATUS = ["ready to switch on", "switched on", "operation enabled", "fault", "voltage enabled", "no quick stop", "switch-on inhibited", "warning", "message", "controlled over the bus", "set-value reached", "limit reached", "FAIL-QSP", "–", "program runs", "ended in target"];

let boxes = {}, ways = {}, control, status, fault, remedy, history, leads, transitions, diagnosis, extra, codeName, codeValue, codeShown;

export function build(section, hello, send) {
  transitions = hello.transitions;
  const arrows = transitions.filter((t) => WAYS[t.id]).map((t) => {
    const [d, x, y] = WAYS[t.id];
    const way = drawn("path", { d, fill: "none", stroke: "#4d5661", "stroke-width": 1.2, "marker-end": "url(#drive-arrow)" });
    const number = lettering(t.id, x, y);
    ways[t.id] = { way, number };
    return drawn("g", {}, way, number);
  });
  const states = hello.states.map((name) => {
    const [x, y] = PLACES[name];
    const box = drawn("rect", { x: x - 96, y: y - 18, width: 192, height: 36, rx: 6, fill: "#fff", stroke: "#1b1f24" });
    const text = lettering(phrase(name), x, y + 4, { "data-phrase": name });
    boxes[name] = { box, text };
    return drawn("g", {}, box, text);
  });
  leads = element("ul", { id: "leads" });
  const anywhere = lettering(word("any_state"), 610, 250, { "data-word": "any_state" });
  const diagram = drawn("svg", { viewBox: "0 -16 716 356", role: "img", label: "diagram" }, arrowHead("drive-arrow", "#4d5661"), ...arrows, anywhere, ...states);

  const bits = (names) => names.map((name, n) => {
    const box = element("span", { class: "lamp" }, "0");
    return [box, element("div", {}, box, ` ${n} `, element("span", { phrase: name }))];
  });
  const make = (names) => {
    const made = bits(names), value = element("output", { class: "mono" });
    return { view: element("div", {}, value, element("div", { class: "bits" }, ...made.map(([, line]) => line))), show(number) {
      value.textContent = `0x${number.toString(16).toUpperCase().padStart(4, "0")}`;
      made.forEach(([box], n) => {
        box.textContent = (number >> n) & 1;
        box.classList.toggle("on", ((number >> n) & 1) === 1);
      });
    } };
  };
  control = make(CONTROL);
  status = make(STATUS);

  fault = element("output", { id: "fault" });
  remedy = element("p", { class: "quiet", id: "remedy" });
  history = element("tbody");
  const name = element("select", {}, ...hello.faults.map((each) => element("option", { selected: each === "OC2" }, each)));
  const cause = (present) => () => send({ do: "fault", name: name.value, present });
  // The block resets while Error_RESET is up.
  const reset = element("button", { id: "reset", word: "reset", onclick: () => {
    send({ do: "set", input: "error_reset", value: 1 });
    setTimeout(() => send({ do: "set", input: "error_reset", value: 0 }), 600);
  } });

  diagnosis = element("output");
  extra = Object.fromEntries(["record", "current", "link", "heat"].map((key) => [key, element("output")]));

  const known = element("datalist", { id: "known-codes" }, ...hello.codes.map(([code, unit, meaning]) => element("option", { value: code }, `${meaning} ${unit}`)));
  codeName = element("input", { list: "known-codes", value: "C0061", id: "code-name" });
  codeValue = element("input", { id: "code-value" });
  codeShown = element("output", { id: "code-shown" });
  const codes = card("codes", known,
    element("div", { class: "tools" }, field("code", codeName), element("button", { id: "code-read", word: "read", onclick: () => send({ do: "read_code", code: codeName.value }) })),
    element("div", { class: "tools" }, field("value", codeValue), element("button", { id: "code-write", word: "write", onclick: () => {
      send({ do: "write_code", code: codeName.value, value: codeValue.value });
      send({ do: "read_code", code: codeName.value });
    } })),
    codeShown);

  const state = card("state", diagram, element("p", { class: "quiet", word: "refused_from" }), leads);
  state.classList.add("double");
  section.append(element("div", { class: "columns" }, state,
    card("fault", element("p", {}, fault), remedy, element("div", { class: "tools" }, reset),
      element("div", { class: "tools" }, field("cause_fault", name), element("button", { word: "cause", onclick: cause(true) }), element("button", { word: "clear", onclick: cause(false) })),
      element("h2", { word: "history" }), element("div", { class: "scroll", tabindex: "0", role: "region", label: "history" }, element("table", {}, history))),
    card("control_word", control.view), card("status_word", status.view), codes,
    card("drive", element("table", {}, element("tbody", {}, row("diagnosis", diagnosis), ...Object.entries(extra).map(([key, out]) => row(key, out)))))));
}

let last = "";

// What the program sends anew each time but changes seldom is drawn when it, or the language, changes.
export function spoken() {
  last = "";
}

/// A transition that leaves the present state: what sets it off, and, where it is commanded and does not come, what holds it back.
function lead(t, drive) {
  const parts = t.trigger.split(" | ");
  const commanded = parts.some((part) => drive.commands.includes(part));
  const made = element("li", {}, `${phrase(t.id)} → ${phrase(t.to)}, ${word("by")}: ${parts.map(phrase).join(" | ")}`);
  if (commanded && t.held) made.append(" – ", element("strong", {}, `${word("asked")}, ${word("held")} ${phrase(t.held)}`));
  else if (t.held) made.append(`; ${word("held")} ${phrase(t.held)}`);
  return made;
}

export function frame({ drive }) {
  const now = JSON.stringify([drive.state, drive.commands, drive.history, drive.fault]);
  if (now !== last) {
    last = now;
    for (const [name, { box, text }] of Object.entries(boxes)) {
      const live = name === drive.state;
      box.setAttribute("fill", live ? "#0a4f8f" : "#fff");
      text.style.fill = live ? "#fff" : "";
    }
    const leaving = transitions.filter((t) => t.from.includes(drive.state));
    for (const [id, { way, number }] of Object.entries(ways)) {
      const leaves = leaving.some((t) => t.id === id);
      way.setAttribute("stroke-width", leaves ? 2.4 : 1.2);
      number.style.fontWeight = leaves ? "700" : "";
    }
    leads.replaceChildren(...leaving.map((t) => lead(t, drive)));
    fault.textContent = drive.fault ? `${drive.fault.number} ${drive.fault.name}: ${phrase(drive.fault.cause)}` : word("none");
    remedy.textContent = drive.fault ? `${word("remedy")}: ${phrase(drive.fault.remedy)}` : "";
    history.replaceChildren(...drive.history.map((entry) => element("tr", {}, element("td", { class: "number" }, String(entry.number)), element("td", {}, entry.name), element("td", {}, phrase(entry.cause)))));
  }
  control.show(drive.control_word);
  status.show(drive.status_word);
  // Of a real drive the bus does not tell these.
  const told = (value, digits, unit) => (value === null ? "–" : `${value.toFixed(digits)} ${unit}`.trim());
  diagnosis.textContent = told(drive.diagnosis, 0, "");
  extra.record.textContent = told(drive.record, 0, "");
  extra.current.textContent = told(drive.current_a, 3, "A");
  extra.link.textContent = told(drive.dc_link_v, 1, "V");
  extra.heat.textContent = told(drive.heat_sink_c, 1, "°C");
}

export function code(told) {
  codeShown.textContent = `${told.code} = ${told.shown} (${told.meaning})`;
  if (document.activeElement !== codeValue) codeValue.value = told.value;
}
