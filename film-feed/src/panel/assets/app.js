// Connects the page with the program and hands frames to the views.

import { element } from "./dom.js";
import { speak, word } from "./words.js";
import * as machine from "./machine.js";
import * as variables from "./variables.js";
import * as scope from "./scope.js";
import * as drive from "./drive.js";
import * as parameters from "./parameters.js";
import * as bus from "./bus.js";

const VIEWS = { machine, variables, scope, drive, parameters, bus };
const byId = (id) => document.getElementById(id);

let socket;
let mine = false;
let lastSeq = null;
// Counted for whoever wants to know whether a frame was lost.
window.framesLost = 0;

export function send(order) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(order));
}

// What was done or refused stands for a while, then who has the control again.
const TOLD_MS = 8000;
let standing = "", fading;

function note(text, bad = false) {
  byId("note").textContent = text;
  byId("note").classList.toggle("bad", bad);
  clearTimeout(fading);
  fading = setTimeout(() => {
    byId("note").textContent = standing;
    byId("note").classList.remove("bad");
  }, TOLD_MS);
}

function connect() {
  const token = new URLSearchParams(location.search).get("token");
  const query = token ? `?token=${encodeURIComponent(token)}` : "";
  socket = new WebSocket(`ws://${location.host}/live${query}`);
  socket.addEventListener("message", (event) => hear(JSON.parse(event.data)));
  socket.addEventListener("close", (event) => {
    standing = event.reason || word("lost");
    note(standing, true);
  });
}

function hear(told) {
  switch (told.t) {
    case "hello":
      build(told);
      break;
    case "frame":
      if (lastSeq !== null) window.framesLost += told.seq - lastSeq - 1;
      lastSeq = told.seq;
      byId("time").textContent = told.time_s.toFixed(3);
      showSpeed(told.factor);
      for (const view of Object.values(VIEWS)) view.frame?.(told);
      document.body.dataset.frames = told.seq;
      break;
    case "control":
      mine = told.yours;
      byId("control").dataset.word = mine ? "release_control" : "take_control";
      byId("control").textContent = word(byId("control").dataset.word);
      standing = word(mine ? "control_yours" : told.taken ? "control_other" : "control_free");
      note(standing);
      break;
    case "refused":
      note(told.why, true);
      break;
    case "done":
      note(told.what);
      break;
    case "code":
      drive.code(told);
      break;
  }
}

function build(hello) {
  if (byId("tabs").children.length) return;
  for (const [name, view] of Object.entries(VIEWS)) {
    const section = element("section", { id: name, role: "tabpanel", "aria-labelledby": `tab-${name}` });
    view.build(section, hello, send);
    byId("views").append(section);
    const tab = element("button", { id: `tab-${name}`, role: "tab", "aria-controls": name, word: name, onclick: () => choose(name) });
    byId("tabs").append(tab);
  }
  byId("tabs").addEventListener("keydown", (event) => {
    const names = Object.keys(VIEWS);
    const move = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!move) return;
    const at = names.indexOf(document.activeElement.getAttribute("aria-controls"));
    const next = names[(at + move + names.length) % names.length];
    choose(next);
    byId(`tab-${next}`).focus();
  });
  if (hello.is_real) {
    document.querySelector("header h1").append(" – ", element("strong", { word: "real_machine" }));
    for (const id of ["pause", "factor"]) byId(id).disabled = true;
  }
  choose("machine");
}

function choose(name) {
  for (const other of Object.keys(VIEWS)) {
    const chosen = other === name;
    byId(other).hidden = !chosen;
    byId(`tab-${other}`).setAttribute("aria-selected", chosen);
    byId(`tab-${other}`).tabIndex = chosen ? 0 : -1;
    VIEWS[other].visible?.(chosen);
  }
}

// The program says how fast the machine runs: another page, or this one before it was loaded anew, may have chosen it.
let paused = false;
function showSpeed(factor) {
  paused = factor === 0;
  byId("pause").setAttribute("aria-pressed", paused);
  byId("step").disabled = !paused;
  if (!paused && document.activeElement !== byId("factor")) byId("factor").value = factor;
}
const speed = (factor) => send({ do: "speed", factor });
byId("pause").addEventListener("click", () => speed(paused ? Number(byId("factor").value) : 0));
byId("factor").addEventListener("change", () => speed(Number(byId("factor").value)));
byId("step").addEventListener("click", () => send({ do: "step", ms: 5 }));
byId("control").addEventListener("click", () => send({ do: mine ? "release_control" : "take_control" }));
byId("language").addEventListener("change", (event) => {
  speak(event.target.value);
  for (const view of Object.values(VIEWS)) view.spoken?.();
});

connect();
