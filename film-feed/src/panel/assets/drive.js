// The drive: state diagram, words bit by bit, fault with its remedy, codes.

import { card, drawn, element, field, row } from "./dom.js";
import { word } from "./words.js";

// Where each state stands in the diagram.
const PLACES = {
  "not ready to switch on": [120, 30], "switch-on disabled": [120, 95], "ready to switch on": [120, 160], "switched on": [120, 225],
  "operation enabled": [120, 290], "quick stop active": [400, 290], "fault reaction active": [400, 95], "fault": [400, 30],
};
// Bits by their meaning at 1, as in the profile and in the film feed (sections 3 and 7 of its specification).
const CONTROL = ["switch on", "enable voltage", "no quick stop", "enable operation", "no quick stop in the drive", "no program start", "no program stop", "reset fault", "–", "–", "–", "reset the program", "manual", "manual negative", "manual positive", "print-mark mode"];
const STATUS = ["ready to switch on", "switched on", "operation enabled", "fault", "voltage enabled", "no quick stop", "switch-on inhibited", "warning", "message", "controlled over the bus", "set-value reached", "limit reached", "FAIL-QSP", "–", "program runs", "ended in target"];

let boxes = {}, control, status, fault, remedy, history, leads, transitions, diagnosis, extra, codeName, codeValue, codeShown, lastHistory = "";

export function build(section, hello, send) {
  transitions = hello.transitions;
  const arrows = transitions.flatMap((t) => t.from.slice(0, 1).map((from) => {
    const [x1, y1] = PLACES[from], [x2, y2] = PLACES[t.to];
    return drawn("line", { x1, y1, x2, y2, stroke: "#8b95a0" });
  }));
  const states = hello.states.map((name) => {
    const [x, y] = PLACES[name];
    const box = drawn("rect", { x: x - 105, y: y - 19, width: 210, height: 38, rx: 6, fill: "#fff", stroke: "#1b1f24" });
    const text = drawn("text", { x, y: y + 4, "text-anchor": "middle" });
    text.textContent = name;
    boxes[name] = { box, text };
    return drawn("g", {}, box, text);
  });
  leads = element("ul", {});
  const diagram = drawn("svg", { viewBox: "0 0 520 325", role: "img", "aria-label": "state diagram of the profile" }, ...arrows, ...states);

  const bits = (names) => names.map((name, n) => {
    const box = element("span", { class: "lamp" }, "0");
    return [box, element("div", {}, box, ` ${n} ${name}`)];
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

  section.append(element("div", { class: "columns" },
    card("state", diagram, element("p", { class: "quiet", word: "refused_from" }), leads),
    card("fault", element("p", {}, fault), remedy, element("div", { class: "tools" }, reset),
      element("div", { class: "tools" }, field("cause_fault", name), element("button", { word: "cause", onclick: cause(true) }), element("button", { word: "clear", onclick: cause(false) })),
      element("h2", { word: "history" }), element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "fault memory" }, element("table", {}, history))),
    card("control_word", control.view), card("status_word", status.view), codes,
    card("drive", element("table", {}, element("tbody", {}, row("diagnosis", diagnosis), ...Object.entries(extra).map(([key, out]) => row(key, out)))))));
}

let lastState = "";

export function frame({ drive }) {
  if (drive.state !== lastState) {
    lastState = drive.state;
    for (const [name, { box, text }] of Object.entries(boxes)) {
      const live = name === drive.state;
      box.setAttribute("fill", live ? "#0a4f8f" : "#fff");
      text.style.fill = live ? "#fff" : "";
    }
    leads.replaceChildren(...transitions.filter((t) => t.from.includes(drive.state)).map((t) => element("li", {}, `${t.id} → ${t.to}, ${word("by")}: ${t.trigger}${t.held ? `; ${word("held")}: ${t.held}` : ""}`)));
  }
  control.show(drive.control_word);
  status.show(drive.status_word);
  fault.textContent = drive.fault ? `${drive.fault.number} ${drive.fault.name}: ${drive.fault.cause}` : word("none");
  remedy.textContent = drive.fault ? `${word("remedy")}: ${drive.fault.remedy}` : "";
  const key = JSON.stringify(drive.history);
  if (key !== lastHistory) {
    lastHistory = key;
    history.replaceChildren(...drive.history.map((entry) => element("tr", {}, element("td", { class: "number" }, String(entry.number)), element("td", {}, entry.name), element("td", {}, entry.cause))));
  }
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
