// Common parts of the four scenes: where they draw, their state, and the plots below the picture.
import type { Plot, Slider } from "./house.js";
import { h, slider } from "./house.js";
import type { State } from "./state.js";
import { RANGES } from "./state.js";
import type { Key } from "./words.js";
import { say } from "./words.js";

export interface Page {
  canvas: HTMLCanvasElement;
  solid: HTMLCanvasElement;
  plots: HTMLElement;
  panel: HTMLElement;
  /** Show the large figure and the sentence below it. */
  result(large: string, small: string): void;
  /** Change the state by a control. */
  change(part: Partial<State>): void;
}

export interface SceneOf {
  /** Show a state: the first one, or a changed one. */
  show(state: State): void;
  /** Draw a frame; seconds since the last one. */
  frame(seconds: number): void;
  leave(): void;
}

/** A slider of one number of the state. */
export function control(page: Page, name: keyof typeof RANGES, label: Key, step: number, unit: string, digits: number, hint: Key): Slider {
  const [min, max] = RANGES[name];
  const made = slider(say(label), {
    min, max, step, value: min, unit, hint: say(hint), show: (v) => v.toFixed(digits).replace("-", "−"), moved: (value) => page.change({ [name]: value }),
  });
  made.row.classList.add("slide");
  return made;
}

/** A choice among the catalogue's shapers. */
export function choice(page: Page, names: string[]): { row: HTMLElement; set(name: string): void } {
  const select = h("select", { ariaLabel: say("shaper"), onchange: () => page.change({ s: select.value }) },
    ...names.map((name) => h("option", { value: name }, name.toUpperCase().replace("_", " ")))) as HTMLSelectElement;
  return { row: h("label", { class: "row" }, h("span", {}, say("shaper")), select), set: (name) => (select.value = name) };
}

/** A vertical line in a plot at a share of its width. */
export function marker(plot: Plot): (share: number) => void {
  const line = h("div", { class: "mark" });
  const over = plot.box.querySelector(".u-over");
  over?.append(line);
  return (share) => (line.style.left = `${100 * Math.min(1, Math.max(0, share))}%`);
}
