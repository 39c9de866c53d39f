// A simulated UR5e's motion from Q1 to Q3, unshaped and shaped.
import type { Stage3D, Track } from "./house.js";
import { COLOURS, h, newPlot, newScene, newTrack, theme } from "./house.js";
import type { Page, SceneOf } from "./scene.js";
import { marker } from "./scene.js";
import { percent, say } from "./words.js";

const FACTOR = 100, SLOW = 0.4, BEFORE = 0.15;
const APPEARANCE = { factor: FACTOR, gravity: false, ghost: false, trace: true };

export interface Ur5e {
  tracks: object[];
  /** Largest acceleration after the stop, unshaped and shaped [m/s²]. */
  left: number[];
  /** Time at which the unshaped reference stops [s]. */
  stop: number;
}

let kept: { scene: Stage3D; tracks: Track[] } | null = null; // browsers limit WebGL contexts, so this one is reused

export function ur5eScene(page: Page, { tracks: packed, left, stop }: Ur5e): SceneOf {
  const trace = newPlot(page.plots, say("plot_alpha"), [{ label: say("unshaped"), colour: COLOURS.without }, { label: say("shaped"), colour: COLOURS.with }], { least: 1 });
  const move = marker(trace);
  let time = 0, failed = false;
  try {
    if (!kept) {
      const scene = newScene(page.solid, { theme: theme() });
      scene.sparing = true;
      scene.resize(page.solid.clientWidth, page.solid.clientHeight); // its look depends on the picture's shape
      const tracks = packed.map((one, number) => newTrack(scene, one, number, packed.length));
      scene.keep(tracks.flatMap((track) => track.outlines(APPEARANCE)));
      kept = { scene, tracks };
    }
  } catch {
    failed = true;
    page.panel.append(h("p", { class: "wrong" }, say("no_webgl")));
  }
  const size = (): void => kept?.scene.resize(page.solid.clientWidth, page.solid.clientHeight);
  const watched = new ResizeObserver(size);
  if (!failed) watched.observe(page.solid);
  const end = kept ? Math.max(...kept.tracks.map((track) => track.times[track.times.length - 1])) : 1;
  return {
    show() {
      if (kept) {
        const longest = kept.tracks.reduce((a, b) => (b.samples.time.length > a.samples.time.length ? b : a)).samples.time;
        const from = longest.findIndex((one) => one >= stop - BEFORE), shown = Array.from(longest).slice(from);
        trace.show([shown, ...kept.tracks.map(({ samples }) => shown.map((_, i) => {
          const value = samples.alpha[from + i];
          return Number.isFinite(value) ? value : null;
        }))]);
      }
      page.result(say("is_left", { share: percent(left[1] / left[0]) }), say("explain_ur5e", { before: left[0].toFixed(2), after: left[1].toFixed(3) }));
    },
    frame(seconds) {
      if (!kept) return;
      time = (time + SLOW * seconds) % end;
      for (const track of kept.tracks) track.robot.show(track.row(time), APPEARANCE);
      kept.scene.draw(seconds);
      move((time - stop + BEFORE) / (end - stop + BEFORE));
    },
    leave() {
      watched.disconnect();
      trace.remove();
    },
  };
}
