// The page of recorded runs: one robot, or several side by side at the same tick, with a time slider.
import * as THREE from "three";
import { h, logo, write } from "./dom.js";
import { COLOURS, Plot } from "./plots.js";
import { inWords, Stage } from "./stage.js";
import { columns, Track } from "./tracks.js";

const PACES = [1, 0.5, 0.25, 0.1, 0.05];
const NO_TRUTH = "the recording contains no truth (record it with tvist serve --truth --record FILE)";

export class Playback {
  constructor(boot) {
    const truth = boot.tracks.every((track) => track.truth);
    this.stage = new Stage({ factor: boot.factor, ghost: boot.tracks.length === 1, truth, noTruth: NO_TRUTH });
    const { scene, plots } = this.stage;
    this.tracks = boot.tracks.map((packed, number) => new Track(scene, packed, number, boot.tracks.length));
    boot.tracks.forEach(({ look }) => this.stage.among(look.geometry.world));
    this.end = Math.max(...this.tracks.map((track) => track.times.at(-1)));
    this.keep();
    this.stage.changed = () => (this.shown = null);
    const several = this.tracks.length > 1;
    this.names = h("div", { class: "names" }, ...(several ? this.tracks.map(({ label, colour }) => {
      const name = h("span", {}, label);
      name.style.color = colour;
      return name;
    }) : []));
    this.stage.main.append(this.names);
    this.playing = true;
    this.time = 0;
    this.pace = 1;
    this._bar(boot.title);
    const lines = (fill) => this.tracks.map(({ label, colour }) => ({ label: several ? label : "", colour, fill }));
    const range = [0, this.end];
    this.alpha = new Plot(plots, "Tool acceleration |α| [m/s²]", lines(!several), { range });
    this.alpha.show(columns(this.tracks, "alpha"));
    const before = several ? [] : [{ label: "before the shaper", colour: COLOURS.before }];
    this.qdd = new Plot(plots, "Joint acceleration |q̈| [rad/s²]", [...before, ...lines(false).map((one) => ({ ...one, label: several ? one.label : "shaped" }))], { range, least: 5 });
    const shaped = columns(this.tracks, "acceleration");
    this.qdd.show(several ? shaped : [shaped[0], columns(this.tracks, "unshaped")[1], shaped[1]]);
    this.qdd.box.classList.add("second");
    this.marks = [this.alpha, this.qdd].map((plot) => {
      plot.plot.over.addEventListener("click", ({ offsetX }) => this.seek(plot.plot.posToVal(offsetX, "x")));
      return plot.plot.over.appendChild(h("div", { class: "mark" }));
    });
    if (boot.result) this.stage.result(inWords(boot.result));
    this.stage.each.push((seconds) => this._step(seconds));
  }

  /** Fit the camera to everything that the arms reach. */
  keep() {
    const plain = { ...this.stage.appearance, ghost: false, trace: false };
    this.stage.scene.keep(this.tracks.flatMap((track) => track.outlines(plain)));
  }

  _bar(title) {
    this.play = h("button", { type: "button", onclick: () => this.toggle() }, "pause");
    this.scrub = h("input", { type: "range", class: "time", min: 0, max: this.end, step: 0.002, value: 0, ariaLabel: "time", oninput: () => this.seek(+this.scrub.value) });
    this.clock = h("output", {});
    const pace = h("select", { ariaLabel: "pace", title: "Slow motion makes the vibration visible.", onchange: () => (this.pace = +pace.value) },
      ...PACES.map((one) => h("option", { value: one }, one === 1 ? "real time" : `1/${1 / one} slow motion`)));
    const more = document.getElementById("more");
    more.append(this.stage.choices());
    const open = h("button", { type: "button", onclick: () => (more.hidden = !more.hidden) }, "more");
    this.stage.bar.append(h("div", { class: "line" }, logo(), h("b", {}, title), this.play, this.scrub, this.clock, pace, open));
  }

  toggle() {
    this.playing = !this.playing;
    write(this.play, this.playing ? "pause" : "play");
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.end);
    for (const { robot } of this.tracks) robot.forget();
  }

  _step(seconds) {
    if (this.playing) {
      this.time += seconds * this.pace;
      if (this.time > this.end) this.seek(0);
    }
    if (this.time === this.shown) return;
    this.shown = this.time;
    this.draw(this.time);
  }

  /** Draw the frame at a time [s]. */
  draw(time) {
    for (const track of this.tracks) track.robot.show(track.row(time), this.stage.appearance);
    this.scrub.value = time;
    write(this.clock, `${time.toFixed(2)} s of ${this.end.toFixed(2)} s`);
    const share = `${(100 * time) / this.end}%`;
    for (const mark of this.marks) mark.style.left = share;
    const { clientWidth, clientHeight } = this.stage.main;
    [...this.names.children].forEach((name, i) => {
      const [x, y, z] = this.tracks[i].at, at = new THREE.Vector3(x, y, z - 0.02).project(this.stage.scene.camera);
      name.style.transform = `translate(${((at.x + 1) / 2) * clientWidth}px, ${((1 - at.y) / 2) * clientHeight}px) translate(-50%, 10%)`;
    });
  }
}
