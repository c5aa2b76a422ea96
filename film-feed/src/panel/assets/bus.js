// The bus: state, figures, telegrams in words; disturbing the line.

import { card, element, field, row, save } from "./dom.js";
import { phrase, word } from "./words.js";

let values, list, stations, asking, plugged, second, heard = [], known = "", isVisible = false;

export function build(section, hello, send) {
  values = Object.fromEntries(["slave", "baud", "cycle", "telegrams", "retries"].map((key) => [key, element("output")]));
  values.slave.id = "slave";
  plugged = element("button", { id: "unplug", word: "unplug", "aria-pressed": "false", onclick: () => send({ do: "cable", plugged: plugged.getAttribute("aria-pressed") === "true" }) });
  const noise = element("select", { onchange: () => send({ do: "noise", bit_error_rate: Number(noise.value) }) },
    ...["0", "1e-6", "1e-5", "1e-4", "1e-3"].map((rate) => element("option", { value: rate }, rate)));
  second = element("button", { id: "second-master", word: "second_master", "aria-pressed": "false", onclick: () => send({ do: "second_master", present: second.getAttribute("aria-pressed") !== "true" }) });
  list = element("tbody");
  const heads = ["time", "telegrams", "octets"].map((key) => element("th", { scope: "col", word: key }));
  stations = element("tbody");
  asking = element("output", { class: "quiet" });
  const live = card("live",
    element("div", { class: "tools" }, element("button", { onclick: () => save("telegrams.csv", csv(), "text/csv") }, "CSV"),
      element("a", { id: "pcapng", href: `/capture.pcapng${location.search}`, download: "capture.pcapng" }, "pcapng")),
    element("div", { class: "scroll", tabindex: "0", role: "region", label: "telegrams" }, element("table", { class: "mono" }, element("thead", {}, element("tr", {}, ...heads)), list)));
  live.classList.add("wide");
  section.append(element("div", { class: "columns" },
    card("bus", element("table", {}, element("tbody", {}, ...Object.entries(values).map(([key, out]) => row(key, out))))),
    card("stations",
      element("div", { class: "tools" }, element("button", { id: "ask-all", word: "ask_all", onclick: () => send({ do: "live_list" }) }), asking),
      element("table", { id: "stations" }, element("thead", {}, element("tr", {}, element("th", { scope: "col", class: "number", word: "address" }), element("th", { scope: "col", word: "station" }))), stations)),
    card("disturb_line", element("div", { class: "tools" }, plugged, second), element("div", { class: "tools" }, field("noise", noise))), live));
}

export function frame({ bus }) {
  values.slave.textContent = phrase(bus.slave);
  asking.textContent = bus.asking ? word("asking") : bus.stations.length ? "" : word("live_none");
  const now = JSON.stringify([bus.stations, word("address")]);
  if (now !== known) {
    known = now;
    stations.replaceChildren(...bus.stations.map(([address, kind]) => element("tr", {}, element("td", { class: "number" }, String(address)), element("td", {}, phrase(kind)))));
  }
  values.baud.textContent = bus.baud / 1000;
  values.cycle.textContent = bus.cycle_us.toFixed(1);
  values.telegrams.textContent = bus.telegrams;
  values.retries.textContent = bus.retries;
  plugged.setAttribute("aria-pressed", !bus.plugged);
  second.setAttribute("aria-pressed", bus.second_master);
  heard.push(...bus.heard);
  heard.splice(0, Math.max(0, heard.length - 400));
  if (isVisible) show();
}

export function visible(now) {
  isVisible = now;
  if (now) show();
}

function show() {
  list.replaceChildren(...heard.slice(-40).toReversed().map(([time, what, octets]) => element("tr", {},
    element("td", { class: "number" }, time.toFixed(6)), element("td", {}, what), element("td", {}, octets))));
}

function csv() {
  return `time_s,what,octets\n${heard.map(([time, what, octets]) => `${time},"${what.replaceAll('"', '""')}",${octets}`).join("\n")}\n`;
}
