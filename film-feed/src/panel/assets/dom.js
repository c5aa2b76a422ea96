// Elements in one line each.

import { phrase, word } from "./words.js";

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "word") {
      made.dataset.word = value;
      made.textContent = word(value);
    } else if (key === "phrase") {
      made.dataset.phrase = value;
      made.textContent = phrase(value);
    } else if (key === "label") {
      made.dataset.label = value;
      made.setAttribute("aria-label", word(value));
    } else if (key.startsWith("on")) {
      made.addEventListener(key.slice(2), value);
    } else if (value !== false && value !== undefined) {
      made.setAttribute(key, value === true ? "" : value);
    }
  }
  made.append(...children);
  return made;
}

const SVG = "http://www.w3.org/2000/svg";

export function drawn(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "label") {
      made.dataset.label = value;
      made.setAttribute("aria-label", word(value));
    } else {
      made.setAttribute(key, value);
    }
  }
  made.append(...children);
  return made;
}

/// A text in a drawing, in the middle of its place.
export function lettering(text, x, y, attributes = {}) {
  const made = drawn("text", { x, y, "text-anchor": "middle", ...attributes });
  made.textContent = text;
  return made;
}

/// The heads of arrows of a drawing, which `marker-end` names by colour: each drawing needs its own.
export function arrowHead(id, colour) {
  return drawn("defs", {}, drawn("marker", { id, viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto-start-reverse" },
    drawn("path", { d: "M0 0 L8 4 L0 8 z", fill: colour })));
}

/// A field with its label before it.
export function field(key, control) {
  return element("label", {}, element("span", { word: key }), " ", control);
}

export function card(key, ...children) {
  return element("div", { class: "card" }, element("h2", { word: key }), ...children);
}

/// A lamp: a text that also says on or off.
export function lamp(alarm = false) {
  const made = element("span", { class: alarm ? "lamp alarm" : "lamp" }, "0");
  made.show = (on) => {
    made.classList.toggle("on", on);
    made.textContent = on ? "1" : "0";
  };
  return made;
}

/// A table row of a name and something that changes.
export function row(key, content) {
  return element("tr", {}, element("th", { scope: "row", word: key }), element("td", {}, content));
}

export function save(name, text, kind) {
  const link = element("a", { href: URL.createObjectURL(new Blob([text], { type: kind })), download: name });
  document.body.append(link);
  link.click();
  link.remove();
}
