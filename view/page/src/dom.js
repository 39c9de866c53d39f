// Elements of the page, made in one call each.

/** An element with attributes, handlers (`on...`) and children, of which text stays text. */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.className = value;
    else if (name in element && name !== "list") element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** Write a text, if it is another one. */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A labelled slider: { row, value(), set() }; `changed` is called when it is let go, `moved` while it moves. */
export function slider(label, { min, max, step, value, unit = "", hint = "", changed, moved, show = (v) => v }) {
  const said = h("output", {}, `${show(value)}${unit}`);
  const input = h("input", {
    type: "range", min, max, step, value, title: hint, ariaLabel: label,
    oninput: () => {
      write(said, `${show(+input.value)}${unit}`);
      moved?.(+input.value);
    },
    onchange: () => changed?.(+input.value),
  });
  write(said, `${show(+input.value)}${unit}`); // a slider keeps to its steps
  const row = h("label", { class: "row", title: hint }, h("span", {}, label), input, said);
  return { row, input, value: () => +input.value, set: (v) => { input.value = v; write(said, `${show(v)}${unit}`); } };
}

export function check(label, checked, hint, changed) {
  const input = h("input", { type: "checkbox", checked, onchange: () => changed(input.checked) });
  return h("label", { class: "tick", title: hint }, input, label);
}

export const LOGO = `<svg viewBox="0 0 64 64" width="26" height="26" aria-hidden="true"><path fill="none" stroke="#D55E00" stroke-width="5" stroke-linecap="round" stroke-linejoin="round" d="M5 30C9 4 15 4 19 24S27 44 31 28s7-14 11 0 6 8 9 2 4-2 8-2"/><path stroke="#0072B2" stroke-width="5" stroke-linecap="round" d="M5 52h54"/></svg>`;

export const theme = () => (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
