// The page's state in the address after `#`: a link opens the page in the same state.
import { SHAPERS } from "./numbers/impulses.js";

export const SCENES = ["mass", "arm", "own", "ur5e"] as const;
export type SceneName = (typeof SCENES)[number];

export interface State {
  scene: SceneName;
  /** Frequency of the mass [Hz], its damping ratio [-], by how much the model's frequency is wrong [%]. */
  f: number;
  z: number;
  e: number;
  /** Shaper of the catalogue. */
  s: string;
  /** Angle of the elbow at which the arm stops [deg]. */
  q: number;
  /** Amplitudes and delays of the user's own shaper, as typed. */
  A: string;
  t: string;
}

export const FIRST: State = { scene: "mass", f: 1.6, z: 0.02, e: 0, s: "zv", q: 30, A: "1/(1+K), K/(1+K)", t: "0, 1/(2 f_d)" };
/** Least and most of the numbers. */
export const RANGES = { f: [0.6, 2.6], z: [0, 0.3], e: [-50, 50], q: [30, 150] } as const;
const LONGEST = 300; // characters of a text

/** The state of an address, and its invalid parts. */
export function read(hash: string): { state: State; refused: string[] } {
  const state: State = { ...FIRST }, refused: string[] = [];
  for (const [name, text] of new URLSearchParams(hash.replace(/^#/, ""))) {
    const number = Number(text);
    if (Object.hasOwn(RANGES, name)) {
      const [low, high] = RANGES[name as keyof typeof RANGES];
      if (text !== "" && number >= low && number <= high) state[name as keyof typeof RANGES] = number;
      else refused.push(`${name}=${text}`);
    } else if (name === "scene" && (SCENES as readonly string[]).includes(text)) state.scene = text as SceneName;
    else if (name === "s" && Object.hasOwn(SHAPERS, text)) state.s = text;
    else if ((name === "A" || name === "t") && text.length <= LONGEST) state[name] = text;
    else refused.push(`${name}=${text.slice(0, 20)}`);
  }
  return { state, refused };
}

/** The address of a state, without initial values. */
export function written(state: State): string {
  const out = new URLSearchParams({ scene: state.scene });
  for (const name of ["f", "z", "e", "s", "q", "A", "t"] as const) if (state[name] !== FIRST[name]) out.set(name, String(state[name]));
  return `#${out}`;
}
