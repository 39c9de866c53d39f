// A mass on a spring, unshaped and shaped, with a shaper of the catalogue or the user's own.
import { COLOURS, h, newPlot, write } from "./house.js";
import type { Impulses, Shaper } from "./numbers/impulses.js";
import { SHAPERS, band, peak, residual } from "./numbers/impulses.js";
import type { Swing } from "./numbers/mass.js";
import { STEP, swing } from "./numbers/mass.js";
import type { Refusal } from "./own.js";
import { typed } from "./own.js";
import { drawCarts, stems } from "./picture.js";
import type { Page, SceneOf } from "./scene.js";
import { choice, control, marker } from "./scene.js";
import type { State } from "./state.js";
import { percent, say } from "./words.js";

const LENGTH = 4, EVERY = 5, PERMITTED = 0.05, TESTED = 0.1;
/** Shapers whose curves are shown for comparison. */
const BESIDE = [["zv", "#8A8A8A"], ["zvd", COLOURS.third], ["ei", "#CC79A7"]] as const;
const ERRORS = Array.from({ length: 101 }, (_, k) => k - 50);

export function springScene(page: Page, own: boolean, zetaMax: Record<string, number>): SceneOf {
  const sliders = {
    f: control(page, "f", "frequency", 0.05, " Hz", 2, "hint_frequency"),
    z: control(page, "z", "damping", 0.005, "", 3, "hint_damping"),
    e: control(page, "e", "error", 1, " %", 0, "hint_error"),
  };
  const chosen = choice(page, Object.keys(SHAPERS).filter((name) => name !== "none"));
  const fields = own ? typing(page) : null;
  page.panel.append(...(fields ? fields.rows : []), sliders.e.row, sliders.f.row, sliders.z.row, ...(own ? [] : [chosen.row]));
  const trace = newPlot(page.plots, say("plot_swing"), [{ label: say("unshaped"), colour: COLOURS.without }, { label: say("shaped"), colour: COLOURS.with }], { least: 10, signed: true });
  const curve = newPlot(page.plots, say("plot_left"), [...BESIDE.map(([name, colour]) => ({ label: name.toUpperCase(), colour })), { label: say("shaped"), colour: COLOURS.with }, { label: say("this"), colour: COLOURS.without, points: true }], { least: 100, x: "%" });
  const box = h("div", { class: "stems" });
  const impulses = h("figure", { class: "plot", ariaLabel: say("plot_impulses") }, h("figcaption", { class: "head" }, h("b", {}, say("plot_impulses"))), box);
  page.plots.append(impulses);
  const move = marker(trace);
  let runs: Swing[] = [], time = 0;

  const believed = (state: State): [number, number] => [state.f * (1 + state.e / 100), state.z];
  const shaperOf = (state: State): { shaper: Shaper; name: string } | Refusal => {
    if (own) {
      const made = typed(state.A, state.t, ...believed(state));
      return typeof made === "function" ? { shaper: made, name: "" } : made;
    }
    const name = state.z < zetaMax[state.s] ? state.s : "zv";
    return { shaper: SHAPERS[name], name };
  };

  return {
    show(state) {
      for (const [name, one] of Object.entries(sliders)) one.set(state[name as keyof typeof sliders]);
      chosen.set(state.s);
      fields?.set(state);
      const made = shaperOf(state);
      fields?.refuse("field" in made ? made : null);
      const unshaped = swing(state.f, state.z, { A: [1], tau: [0] }, LENGTH);
      if ("field" in made) { // show only what needs no shaper
        runs = [unshaped];
        return page.result("", "");
      }
      const train = made.shaper(...believed(state)), share = residual(state.f, state.z, train);
      runs = [unshaped, swing(state.f, state.z, train, LENGTH)];
      const thin = (values: number[]): number[] => values.filter((_, i) => i % EVERY === 0);
      trace.top = 10;
      trace.show([thin(runs[0].deflection.map((_, i) => i * STEP)), ...runs.map((run) => thin(run.deflection).map((one) => 100 * one))]);
      const over = (shaper: Shaper): number[] => ERRORS.map((error) => 100 * residual(state.f, state.z, shaper(state.f * (1 + error / 100), state.z)));
      curve.top = 100;
      curve.show([ERRORS, ...BESIDE.map(([name]) => over(SHAPERS[name])), over(made.shaper), ERRORS.map((error) => (error === Math.round(state.e) ? 100 * share : null))]);
      stems(box, train.A, train.tau);
      const range = !own && made.name !== state.s ? ` ${say("shaper_range", { name: state.s.toUpperCase(), most: zetaMax[state.s] })}` : "";
      page.result(say("is_left", { share: percent(share) }), say("explain_mass", {
        f: state.f.toFixed(2), believed: believed(state)[0].toFixed(2), delay: (1000 * train.tau[train.tau.length - 1]).toFixed(0),
      }) + range);
      fields?.judge(made.shaper, state);
    },
    frame(seconds) {
      if (!runs.length) return;
      time = (time + seconds) % LENGTH;
      const i = Math.min(Math.floor(time / STEP), runs[0].reference.length - 1);
      drawCarts(page.canvas, runs.map((run, k) => ({
        name: say(k === 0 ? "unshaped" : "shaped"), colour: k === 0 ? COLOURS.without : COLOURS.with,
        way: run.reference[i], off: run.deflection[i],
      })));
      move(time / LENGTH);
    },
    leave() {
      for (const plot of [trace, curve]) plot.remove();
    },
  };
}

/** The two fields of the user's own shaper, their errors, and the verdict. */
function typing(page: Page): { rows: HTMLElement[]; set(state: State): void; refuse(why: Refusal | null): void; judge(shaper: Shaper, state: State): void } {
  const input = (name: "A" | "t", label: string): HTMLInputElement =>
    h("input", { type: "text", id: `own-${name}`, ariaLabel: label, autocomplete: "off", autocapitalize: "off", spellcheck: false, oninput: () => page.change({ [name]: inputs[name].value }) }) as HTMLInputElement;
  const inputs = { A: input("A", say("amplitudes")), t: input("t", say("delays")) };
  const errors = { A: h("p", { class: "wrong", role: "alert" }), t: h("p", { class: "wrong", role: "alert" }) };
  const examples: [string, string, string][] = [
    ["ZV", "1/(1+K), K/(1+K)", "0, T/2"],
    ["ZVD", "1/(1+K)^2, 2K/(1+K)^2, K^2/(1+K)^2", "0, T/2, T"],
    ["1/3 1/3 1/3", "1/3, 1/3, 1/3", "0, T/3, 2T/3"],
  ];
  const buttons = examples.map(([name, A, t]) => h("button", { type: "button", onclick: () => page.change({ A, t }) }, name));
  const table = h("dl", { class: "judged" });
  const verdict = h("p", { class: "verdict", role: "status" });
  const field = (name: "A" | "t", label: string): HTMLElement =>
    h("div", { class: "field" }, h("label", { htmlFor: `own-${name}` }, label), inputs[name], errors[name]);
  return {
    rows: [field("A", say("amplitudes")), field("t", say("delays")), h("p", { class: "hint" }, say("may_use")),
      h("div", { class: "pair" }, ...buttons), verdict, table],
    set(state) {
      for (const name of ["A", "t"] as const) if (inputs[name].value !== state[name]) inputs[name].value = state[name];
    },
    refuse(why) {
      for (const name of ["A", "t"] as const) {
        const text = why?.field === name ? why.text : "";
        write(errors[name], text);
        inputs[name].setAttribute("aria-invalid", String(text !== ""));
      }
      if (why?.sum !== undefined) {
        const by = +why.sum.toPrecision(15);
        errors.A.append(" ", h("button", {
          type: "button", onclick: () => page.change({ A: inputs.A.value.split(",").map((one) => `(${one.trim()})/${by}`).join(", ") }),
        }, say("normalise")));
      }
      table.hidden = verdict.hidden = why !== null;
    },
    judge(shaper, state) {
      const { f, z } = state, train = shaper(f, z), share = residual(f, z, train);
      const wrong = Math.max(...[-TESTED, TESTED].map((error) => residual(f, z, shaper(f * (1 + error), z))));
      const [low, high] = band(train, f, z, PERMITTED).map((end) => 100 * (end / f - 1));
      const ends = { low: signed(low), high: high === Infinity ? say("beyond") : signed(high) };
      const rows: [string, string][] = [
        [say("judge_right"), `${percent(share)} %`],
        [say("judge_wrong"), `${percent(wrong)} %`],
        [say("judge_band"), Number.isNaN(low) ? say("band_none") : say("from_to", ends)],
        [say("judge_delay"), say("periods", { ms: (1000 * train.tau[train.tau.length - 1]).toFixed(0), periods: (train.tau[train.tau.length - 1] * f).toFixed(2) })],
        [say("judge_peak"), say("times", { times: peak(train).toFixed(2) })],
      ];
      table.replaceChildren(...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
      write(verdict, inWords(train, share, low, high, state));
    },
  };
}

const signed = (value: number): string => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(0)}`;

function inWords(train: Impulses, share: number, low: number, high: number, { f, z }: State): string {
  if (share > PERMITTED) return say("verdict_bad", { share: percent(share) });
  if (peak(train) > 1 + 1e-6) return say("verdict_hard", { times: peak(train).toFixed(2) });
  const lasts = train.tau[train.tau.length - 1];
  let best: { name: string; ends: [number, number]; wide: number } | null = null;
  for (const [name, shaper] of Object.entries(SHAPERS)) {
    let rival: Impulses;
    try {
      rival = shaper(f, z);
    } catch {
      continue; // it is not defined at this damping
    }
    if (rival.tau[rival.tau.length - 1] > lasts * (1 + 1e-6) || peak(rival) > 1 + 1e-6) continue;
    const ends = band(rival, f, z, PERMITTED).map((end) => 100 * (end / f - 1)) as [number, number], wide = Math.min(-ends[0], ends[1]);
    if (wide > (best?.wide ?? -Infinity)) best = { name: name.toUpperCase().replace("_", " "), ends, wide };
  }
  if (!best) return say("verdict_alone");
  if (Math.min(-low, high) >= best.wide - 0.5) return say("verdict_good", { name: best.name });
  return say("verdict_less", { name: best.name, low: signed(best.ends[0]), high: signed(best.ends[1]) });
}
