// Types of the JavaScript that this page shares with `tvist view`: elements, plots, the stage of the UR5e.
// @ts-expect-error untyped
import * as dom from "../src/dom.js";
// @ts-expect-error untyped
import * as plots from "../src/plots.js";
// @ts-expect-error untyped
import { Scene } from "../src/scene.js";
// @ts-expect-error untyped
import * as tracks from "../src/tracks.js";

type Child = Node | string | null;
export interface Slider {
  row: HTMLElement;
  input: HTMLInputElement;
  value(): number;
  set(value: number): void;
}
interface SliderOptions {
  min: number;
  max: number;
  step: number;
  value: number;
  unit?: string;
  hint?: string;
  moved?: (value: number) => void;
  show?: (value: number) => string;
}
export interface Line {
  label: string;
  colour: string;
  points?: boolean;
}
export interface Plot {
  box: HTMLElement;
  top: number;
  title: string;
  say(note: string): void;
  show(columns: (number | null)[][]): void;
  remove(): void;
}
export interface Track {
  times: Float32Array;
  samples: Record<string, Float32Array>;
  robot: { show(row: Float32Array, appearance: object): void; forget(): void };
  row(time: number): Float32Array;
  outlines(appearance: object): object[];
}
export interface Stage3D {
  sparing: boolean;
  keep(points: object[]): void;
  resize(width: number, height: number): void;
  setTheme(theme: string): void;
  draw(seconds: number): boolean;
}

export const h: (tag: string, attributes?: object, ...children: Child[]) => HTMLElement = dom.h;
export const write: (element: Element, text: string) => void = dom.write;
export const slider: (label: string, options: SliderOptions) => Slider = dom.slider;
export const logo: () => HTMLElement = dom.logo;
export const theme: () => string = dom.theme;
export const COLOURS: { without: string; with: string; third: string } = plots.COLOURS;
export const newPlot = (parent: Element, title: string, lines: Line[], options: object): Plot => new plots.Plot(parent, title, lines, options);
export const newTrack = (scene: Stage3D, packed: object, number: number, count: number): Track => new tracks.Track(scene, packed, number, count);
export const newScene = (canvas: Element, options: object): Stage3D => new Scene(canvas, options);
