// Recorded runs, decoded: rows of poses and samples of signals over time.
import { Robot } from "./robot.js";
import { COLOURS } from "./plots.js";

const APART = 0.9; // distance between two bases, as a share of the longest reach [-]
export const LINES = [COLOURS.without, COLOURS.with, COLOURS.third];

/** Decode base64 of little-endian 32-bit floats. */
export const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (one) => one.charCodeAt(0)).buffer);

export class Track {
  constructor(scene, packed, number, count) {
    Object.assign(this, { label: packed.label, truth: packed.truth, width: packed.width });
    this.times = floats(packed.times);
    this.rows = floats(packed.rows);
    this.samples = Object.fromEntries(Object.entries(packed.samples).map(([name, text]) => [name, floats(text)]));
    this.colour = count > 1 ? LINES[number % LINES.length] : COLOURS.with;
    const apart = APART * packed.reach;
    this.at = [0, apart * (number - (count - 1) / 2), 0];
    this.robot = new Robot(scene, packed.look, count > 1 ? { at: this.at, colour: this.colour } : {});
  }

  /** The row at a time [s], interpolated linearly. */
  row(time) {
    let low = 0, high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    const next = Math.min(low + 1, this.times.length - 1), step = this.times[next] - this.times[low];
    const share = step > 0 ? Math.min(1, Math.max(0, (time - this.times[low]) / step)) : 0;
    const [from, to] = [low, next].map((place) => this.rows.subarray(place * this.width, (place + 1) * this.width));
    return from.map((value, i) => value + share * (to[i] - value));
  }

  /** Points of the arm's outline during the whole run. */
  outlines(appearance, count = 24) {
    const { times, robot } = this, found = [];
    for (let k = 0; k < count; k++) {
      robot.show(this.row(times[0] + ((times.at(-1) - times[0]) * k) / (count - 1)), appearance);
      found.push(...robot.arm.outline());
    }
    robot.forget();
    return found;
  }
}

/** Columns of one signal for all tracks, on the time axis of the longest. */
export function columns(tracks, name) {
  const longest = tracks.reduce((a, b) => (b.samples.time.length > a.samples.time.length ? b : a));
  const time = Array.from(longest.samples.time);
  return [time, ...tracks.map(({ samples }) => time.map((_, i) => (Number.isFinite(samples[name][i]) ? samples[name][i] : null)))];
}
