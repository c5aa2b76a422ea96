// The block's inputs and outputs, as the variable table of the original showed them.

import { card, element, lamp } from "./dom.js";

let shown = [];
const outputs = {};

export function build(section, hello, send) {
  const body = element("tbody");
  shown = hello.inputs.map((info) => {
    const scale = 10 ** info.decimals;
    const now = info.max === 1 ? lamp() : element("output");
    const control = info.max === 1
      ? element("select", { "aria-label": info.original }, element("option", { value: 0 }, "0"), element("option", { value: 1 }, "1"))
      : element("input", { type: "number", "aria-label": info.original, min: info.min / scale, max: info.max / scale, step: 1 / scale, id: `in-${info.name}` });
    const order = () => send({ do: "set", input: info.name, value: Math.round(Number(control.value) * scale) });
    control.addEventListener("change", order);
    body.append(element("tr", {},
      element("th", { scope: "row" }, info.name),
      element("td", {}, info.original),
      element("td", { class: "number" }, now),
      element("td", {}, control),
      element("td", {}, info.unit),
      element("td", { class: "number" }, `${info.min / scale}…${info.max / scale}`)));
    return (value) => {
      if (info.max === 1) {
        now.show(value === 1);
        if (document.activeElement !== control) control.value = value;
      } else {
        now.textContent = (value / scale).toFixed(info.decimals);
        if (document.activeElement !== control && control.value === "") control.value = value / scale;
      }
    };
  });
  const heads = (keys) => element("thead", {}, element("tr", {}, ...keys.map((key) => element("th", { scope: "col", word: key }))));
  const out = element("tbody");
  const line = (name, original, content, unit = "") => out.append(element("tr", {},
    element("th", { scope: "row" }, name), element("td", {}, original), element("td", { class: "number" }, content), element("td", {}, unit)));
  for (const [name, original, alarm] of [["switched_on", "Eingeschaltet"], ["drive_ready", "DRIVE_RDY"], ["error", "ERROR", true], ["running", "RUNNING"], ["job_finished", "JOB_FIN"]]) {
    outputs[name] = lamp(alarm);
    outputs[name].id = `out-${name}`;
    line(name, original, outputs[name]);
  }
  outputs.speed = element("output");
  outputs.position = element("output");
  line("speed", "MCTRL_NACT", outputs.speed, "%");
  line("position", "POS_ACT", outputs.position, "mm");
  section.append(element("div", { class: "columns" },
    card("inputs", element("table", {}, heads(["name", "original", "value", "set", "unit", "range"]), body)),
    card("outputs", element("table", {}, heads(["name", "original", "value", "unit"]), out))));
}

export function frame(frame) {
  frame.inputs.forEach((value, place) => shown[place](value));
  for (const name of ["switched_on", "drive_ready", "error", "running", "job_finished"]) outputs[name].show(frame.outputs[name]);
  outputs.speed.textContent = frame.outputs.speed_percent.toFixed(2);
  outputs.position.textContent = frame.outputs.position_mm === null ? "–" : frame.outputs.position_mm.toFixed(4);
}
