// The arm with one flexible joint: unshaped, with a fixed shaper, and with one that follows its frequency.
import { COLOURS, newPlot } from "./house.js";
import type { ArmParameters, ArmRun } from "./numbers/arm.js";
import { fixed, following, left, modeOf, run } from "./numbers/arm.js";
import { SHAPERS } from "./numbers/impulses.js";
import { drawArms } from "./picture.js";
import type { Page, SceneOf } from "./scene.js";
import { choice, control, marker } from "./scene.js";
import type { State } from "./state.js";
import { percent, say } from "./words.js";

const FACTOR = 100, SLOW = 0.4, HOLD = 0.5, DESIGN = Math.PI / 2;
const ERRORS = Array.from({ length: 21 }, (_, k) => 5 * (k - 10));
const LINES = [
  { label: say("unshaped"), colour: COLOURS.without },
  { label: say("fixed"), colour: COLOURS.third },
  { label: say("following"), colour: COLOURS.with },
];

export function armScene(page: Page, arm: ArmParameters): SceneOf {
  const sliders = { q: control(page, "q", "elbow", 1, "°", 0, "hint_elbow"), e: control(page, "e", "error", 5, " %", 0, "hint_error") };
  const chosen = choice(page, Object.keys(SHAPERS).filter((name) => name !== "none"));
  page.panel.append(sliders.q.row, sliders.e.row, chosen.row);
  const trace = newPlot(page.plots, say("plot_twist"), LINES, { least: 1, signed: true });
  const curve = newPlot(page.plots, say("plot_left"), [...LINES.slice(1), { label: say("this"), colour: COLOURS.without, points: true }], { least: 100, x: "%" });
  const move = marker(trace);
  let runs: ArmRun[] = [], time = 0, waiting: (() => void)[] = [], drawn = "";
  let found: (number | null)[][] = [], here: (number | null)[] = [];
  const showCurve = (): void => curve.show([ERRORS, ...found, here]);

  /** From the other end of the elbow's range, both joints turning the same way. */
  const moved = (state: State, ways: ("none" | "fixed" | "following")[], error: number): ArmRun[] => {
    const elbow = (state.q * Math.PI) / 180, from = state.q <= 90 ? Math.PI * (150 / 180) : Math.PI / 6, bend = elbow - from;
    const start = [1.15 - Math.sign(bend) * 0.6, from], target = [1.15 + Math.sign(bend) * 0.6, elbow];
    const [f_d, zeta] = modeOf(arm, DESIGN);
    return ways.map((way) => run(arm, start, target, way === "none" ? null : SHAPERS[state.s], way === "fixed" ? fixed(f_d * (1 + error), zeta) : following(arm, error)));
  };

  return {
    show(state) {
      sliders.q.set(state.q);
      sliders.e.set(state.e);
      chosen.set(state.s);
      runs = moved(state, ["none", "fixed", "following"], state.e / 100);
      const [none, ...shares] = runs.map(left), [f_d, zeta] = modeOf(arm, (state.q * Math.PI) / 180);
      const length = Math.max(...runs.map((one) => one.link.length));
      const ticks = Array.from({ length: Math.ceil(length / 2) }, (_, k) => 2 * k);
      trace.top = 1;
      trace.show([ticks.map((i) => i * arm.period), ...runs.map(({ link, motor }) => ticks.map((i) => (i < link.length ? 1000 * (link[i][0] - motor[i][0]) : null)))]);
      page.result(say("is_left", { share: percent(shares[1] / none) }), say("explain_arm", {
        fixed: percent(shares[0] / none), elbow: state.q, f: f_d.toFixed(2), z: zeta.toFixed(3),
      }));
      const nearest = ERRORS.reduce((best, one, k) => (Math.abs(one - state.e) < Math.abs(ERRORS[best] - state.e) ? k : best), 0);
      here = ERRORS.map((_, k) => (k === nearest ? (100 * shares[1]) / none : null));
      const key = `${state.q} ${state.s}`;
      if (key === drawn) return showCurve();
      drawn = key;
      // Compute one point of the curve per frame, so that no frame is late.
      found = [ERRORS.map(() => null), ERRORS.map(() => null)];
      curve.top = 100;
      waiting = ERRORS.map((error, k) => () => {
        moved(state, ["fixed", "following"], error / 100).forEach((one, way) => (found[way][k] = (100 * left(one)) / none));
        curve.say(k < ERRORS.length - 1 ? say("counting", { done: k + 1, count: ERRORS.length }) : "");
        showCurve();
      });
    },
    frame(seconds) {
      waiting.shift()?.();
      const length = Math.max(...runs.map((one) => one.link.length)) * arm.period;
      time = (time + SLOW * seconds) % (length + HOLD);
      drawArms(page.canvas, runs.map(({ motor, link }, k) => {
        const i = Math.min(Math.floor(time / arm.period), link.length - 1);
        return { name: LINES[k].label, colour: LINES[k].colour, motor: motor[i], link: link[i] };
      }), arm.lengths, FACTOR);
      move(time / length);
    },
    leave() {
      for (const plot of [trace, curve]) plot.remove();
      waiting = [];
    },
  };
}
