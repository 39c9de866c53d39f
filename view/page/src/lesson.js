// The lesson that is served: the UR5e moves unshaped, and with two impulses that may be wrong. Each tab has sliders of its own.
import { connected, h, logo, slider, write } from "./dom.js";
import { COLOURS, Plot } from "./plots.js";
import { Stage } from "./stage.js";
import { Track } from "./tracks.js";

const SLOW = 0.25; // an eye follows a swing of a few hertz
const MAGNIFIED = 100;
const GO = "Move the UR5e";
const TWO = [{ label: "unshaped", colour: COLOURS.without }, { label: "two impulses", colour: COLOURS.with }];

export class Lesson {
  constructor({ ur5e_zeta: zeta }) {
    this.stage = new Stage({ factor: MAGNIFIED, ghost: false });
    this.stage.bar.append(h("div", { class: "line" }, logo(), h("b", {}, "Why an arm rings, and what two impulses do")));
    this.error = slider("its error", { min: -50, max: 50, step: 1, value: 0, unit: " %", hint: "How wrong the frequency is that the shaper believes in." });
    this.zeta = slider("believed ζ", { min: 0, max: 0.6, step: 0.01, value: zeta, show: (v) => v.toFixed(2) });
    this.go = h("button", { type: "button", class: "ab", onclick: () => this.run() }, GO);
    this.large = h("p", { class: "big" });
    this.words = h("p", {});
    document.body.append(h("section", { id: "words", ariaLabel: "lesson" }, h("h2", {}, "The UR5e"),
      h("p", {}, "It has six joints and its frequency changes with its pose, but where it stops, its lowest mode is like a mass on a spring. Press the button: the arm makes one motion unshaped, and with the two impulses for the frequency that you choose."),
      this.error.row, this.zeta.row, this.go, this.large, this.words));
    this.plot = new Plot(this.stage.plots, "Tool acceleration |α| around the stop [m/s²]", TWO, { least: 1 });
    this.tracks = [];
    this.time = 0;
    this.stage.each.push((seconds) => this._step(seconds));
    this.socket = connected(this);
    this.socket.onopen = () => this.run();
  }

  run() {
    [this.go.disabled, this.go.textContent] = [true, "The UR5e moves …"];
    this.socket.send(JSON.stringify({ do: "run", error: this.error.value() / 100, zeta: this.zeta.value() }));
  }

  on_run({ tracks, begin, stop, share, words }) {
    [this.go.disabled, this.go.textContent] = [false, GO];
    for (const { robot } of this.tracks) robot.remove();
    this.tracks = tracks.map((packed, number) => new Track(this.stage.scene, packed, number, 2));
    this.stage.scene.keep(this.tracks.flatMap((track) => track.outlines({ factor: 1, gravity: false, ghost: false, trace: false })));
    this.stage.scene.free = false;
    [this.begin, this.time] = [begin, 0];
    write(this.large, `${(100 * share).toFixed(0)} % is left`);
    write(this.words, words);
    const [{ samples: a }, { samples: b }] = this.tracks;
    const kept = Array.from(a.time.keys()).filter((i) => a.time[i] > stop - 0.1 && a.time[i] < stop + 0.6);
    this.plot.show([kept.map((i) => a.time[i] - stop), kept.map((i) => a.alpha[i]), kept.map((i) => b.alpha[i])]);
  }

  on_notice({ text }) {
    [this.go.disabled, this.go.textContent] = [false, GO];
    this.stage.say(text);
  }

  _step(seconds) {
    if (!this.tracks.length) return;
    this.time += SLOW * seconds;
    if (this.begin + this.time > this.tracks[0].times.at(-1)) this.time = 0;
    for (const track of this.tracks) track.robot.show(track.row(this.begin + this.time), this.stage.appearance);
  }
}
