// The lesson: one mass on a spring and two impulses, then the same on the UR5e. Each tab has sliders of its own.
import { connected, h, logo, slider, write } from "./dom.js";
import { COLOURS, Plot } from "./plots.js";
import { Robot } from "./robot.js";
import { Stage } from "./stage.js";
import { Track } from "./tracks.js";

const SLOW = 0.25; // an eye follows a swing of a few hertz
const APART = 0.34, MAGNIFIED = 20, UR5E_MAGNIFIED = 100;
const TWO = [{ label: "unshaped", colour: COLOURS.without }, { label: "two impulses", colour: COLOURS.with }];

export class Lesson {
  constructor({ look, range, turn, ur5e_zeta: zeta }) {
    this.stage = new Stage({ factor: MAGNIFIED, ghost: false });
    const { scene, plots, bar } = this.stage;
    this.tabs = ["One mass", "UR5e"].map((name, number) => h("button", { type: "button", role: "tab", onclick: () => this.open(number) }, name));
    bar.append(h("div", { class: "line", role: "tablist" }, logo(), h("b", {}, "Why an arm rings, and what two impulses do"), h("span", { class: "space" }), ...this.tabs));
    this.turn = turn;
    this.one = [-1, 1].map((side, i) => new Robot(scene, look, { at: [0, side * APART, 0], colour: TWO[i].colour }));
    this.swings = new Plot(plots, "Deflection of the spring [mrad]", TWO, { least: 5, signed: true });
    this.curve = new Plot(plots, "Vibration that two impulses leave [%]", [{ label: "over the error of the frequency [%]", colour: COLOURS.with }, { label: "this one", colour: COLOURS.without, points: true }], { least: 100, x: "%" });
    const ask = () => this.ask();
    const [low, high] = range;
    this.f_d = slider("frequency", { min: low, max: high, step: 0.01, value: (low + high) / 2, unit: " Hz", show: (v) => v.toFixed(2), moved: ask,
      hint: "The elbow gives it: stretched out the arm is heavy and slow, folded it is light and quick." });
    this.zeta = slider("damping ζ", { min: 0, max: 0.3, step: 0.005, value: 0.03, show: (v) => v.toFixed(3), moved: ask, hint: "How soon it stops by itself." });
    this.error = slider("its error", { min: -50, max: 50, step: 1, value: 0, unit: " %", moved: ask, hint: "How wrong the frequency is that the shaper believes in." });
    this.words = h("p", {});
    this.large = h("p", { class: "big" });
    const first = h("div", {}, h("h2", {}, "One mass on a spring"),
      h("p", {}, "An arm that turns and stops swings on, like a mass on a spring: the orange one. The blue one makes the same motion in two parts, half of it at once, half of it half a swing later. The second half swings against the first, and nothing is left."),
      h("p", {}, "That takes the right frequency. Give the shaper a wrong one, by its error, and see what stays."),
      this.f_d.row, this.zeta.row, this.error.row, this.large, this.words);
    this.armError = slider("its error", { min: -50, max: 50, step: 1, value: 0, unit: " %" });
    this.armZeta = slider("believed ζ", { min: 0, max: 0.6, step: 0.01, value: zeta, show: (v) => v.toFixed(2) });
    this.go = h("button", { type: "button", class: "ab", onclick: () => this.run() }, "Move the UR5e");
    this.armLarge = h("p", { class: "big" });
    this.armWords = h("p", {});
    const second = h("div", { hidden: true }, h("h2", {}, "The UR5e"),
      h("p", {}, "It has six joints and its frequency changes with its pose, but where it stops, its lowest mode is a mass on a spring, too. Press the button: the arm makes one motion unshaped and with the two impulses for the frequency that you choose."),
      this.armError.row, this.armZeta.row, this.go, this.armLarge, this.armWords);
    this.pages = [first, second];
    document.body.append(h("section", { id: "words", ariaLabel: "lesson" }, ...this.pages));
    this.armPlot = new Plot(plots, "Tool acceleration |α| around the stop [m/s²]", TWO, { least: 1 });
    this.tracks = [];
    this.time = 0;
    this.open(0);
    this.stage.each.push((seconds) => this._step(seconds));
    this.socket = connected(this);
    this.socket.onopen = ask;
  }

  open(number) {
    this.tabs.forEach((tab, i) => (tab.ariaSelected = String(i === number)));
    this.pages.forEach((page, i) => (page.hidden = i !== number));
    for (const plot of [this.swings, this.curve]) plot.box.hidden = number !== 0;
    this.armPlot.box.hidden = number !== 1;
    this.page = number;
    this._show();
  }

  _show() {
    const arms = this.page === 1 && this.tracks.length > 0;
    for (const robot of this.one) robot.arm.root.visible = robot.line.visible = !arms;
    for (const { robot } of this.tracks) robot.arm.root.visible = robot.line.visible = arms;
    this.stage.appearance.factor = arms ? UR5E_MAGNIFIED : MAGNIFIED;
    this.stage.setTruth(true);
    this.stage.scene.keep(arms ? this.outlines : null);
    this.stage.scene.free = false;
    this.time = 0;
  }

  ask() {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: "swing", f_d: this.f_d.value(), zeta: this.zeta.value(), error: this.error.value() / 100 }));
  }

  on_swing({ time, reference, elbow, deflections, share, words, errors, left, error }) {
    this.swing = { time, reference, elbow, deflections };
    write(this.large, `${(100 * share).toFixed(0)} % is left`);
    write(this.words, words);
    this.swings.show([time, ...deflections.map((one) => one.map((angle) => 1000 * angle))]);
    const nearest = errors.reduce((best, one, i) => (Math.abs(one - error) < Math.abs(errors[best] - error) ? i : best), 0);
    this.curve.show([errors.map((one) => 100 * one), left.map((one) => 100 * one), errors.map((_, i) => (i === nearest ? 100 * share : null))]);
  }

  run() {
    [this.go.disabled, this.go.textContent] = [true, "The UR5e moves …"];
    this.socket.send(JSON.stringify({ do: "run", error: this.armError.value() / 100, zeta: this.armZeta.value() }));
  }

  on_run({ tracks, begin, stop, share, words }) {
    [this.go.disabled, this.go.textContent] = [false, "Move the UR5e"];
    for (const { robot } of this.tracks) robot.remove();
    this.tracks = tracks.map((packed, number) => new Track(this.stage.scene, packed, number, 2));
    this.outlines = this.tracks.flatMap((track) => track.outlines({ factor: 1, gravity: false, ghost: false, trace: false }));
    this.begin = begin;
    write(this.armLarge, `${(100 * share).toFixed(0)} % is left`);
    write(this.armWords, words);
    const [{ samples: a }, { samples: b }] = this.tracks;
    const kept = Array.from(a.time.keys()).filter((i) => a.time[i] > stop - 0.1 && a.time[i] < stop + 0.6);
    this.armPlot.show([kept.map((i) => a.time[i] - stop), kept.map((i) => a.alpha[i]), kept.map((i) => b.alpha[i])]);
    this._show();
  }

  on_notice({ text }) {
    [this.go.disabled, this.go.textContent] = [false, "Move the UR5e"];
    this.stage.say(text);
  }

  _step(seconds) {
    this.time += SLOW * seconds;
    if (this.page === 1 && this.tracks.length) {
      if (this.begin + this.time > this.tracks[0].times.at(-1)) this.time = 0;
      for (const track of this.tracks) track.robot.show(track.row(this.begin + this.time), this.stage.appearance);
    } else if (this.swing) {
      const { time, reference, elbow, deflections } = this.swing;
      if (this.time > time.at(-1)) this.time = 0;
      const place = Math.min(Math.round(this.time / time[1]), time.length - 1);
      this.one.forEach((robot, i) => {
        const row = new Array(4 * robot.joints + 2 * robot.links).fill(0);
        [row[0], row[1]] = [reference[i][place] - this.turn / 2, elbow];
        row[3 * robot.joints] = deflections[i][place];
        robot.show(row, this.stage.appearance);
      });
    }
  }
}
