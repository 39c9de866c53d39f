// Helpers that create elements of the page.

/** An element with attributes, handlers (`on...`) and children; strings become text, not HTML. */
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

/** Set an element's text if it differs. */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A labelled slider: { row, value(), set() }; `changed` is called when it is released, `moved` while it moves. */
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
  write(said, `${show(+input.value)}${unit}`); // the value is rounded to a step
  const row = h("label", { class: "row", title: hint }, h("span", {}, label), input, said);
  return { row, input, value: () => +input.value, set: (v) => { input.value = v; write(said, `${show(v)}${unit}`); } };
}

export function check(label, checked, hint, changed) {
  const input = h("input", { type: "checkbox", checked, onchange: () => changed(input.checked) });
  return h("label", { class: "tick", title: hint }, input, label);
}

const LOGO = `<svg viewBox="0 0 64 64" width="26" height="26" fill="none" stroke-width="5" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true"><path stroke="#D55E00" d="M5.0,4.0 6.1,6.7 7.2,12.0 8.4,18.8 9.5,26.0 10.6,32.4 11.8,37.2 12.9,39.9 14.0,40.3 15.1,38.5 16.2,35.1 17.4,30.6 18.5,26.0 19.6,21.8 20.8,18.7 21.9,17.0 23.0,16.8 24.1,17.9 25.2,20.1 26.4,23.0 27.5,26.0 28.6,28.7 29.8,30.7 30.9,31.8 32.0,32.0 33.1,31.2 34.2,29.8 35.4,28.0 36.5,26.0 37.6,24.2 38.8,22.9 39.9,22.2 41.0,22.1 42.1,22.6 43.2,23.5 44.4,24.7 45.5,26.0 46.6,27.1 47.8,28.0 48.9,28.5 50.0,28.5 51.1,28.2 52.2,27.6 53.4,26.8 54.5,26.0 55.6,25.3 56.8,24.7 57.9,24.4 59.0,24.4"/><path stroke="#0072B2" d="M5,56H59"/></svg>`;

/** The logo of the documentation. */
export function logo() {
  const mark = h("span", { class: "logo" });
  mark.innerHTML = LOGO;
  return mark;
}

/** The page's connection to its server; a message of type x calls `page.on_x`. */
export function connected(page) {
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`);
  socket.onmessage = ({ data }) => {
    const { type, ...content } = JSON.parse(data);
    page[`on_${type}`](content, socket);
  };
  return socket;
}

export const theme = () => (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
