// The live page: a served robot and the controls that move it.
import { connected, h, logo, slider, write } from "./dom.js";
import { COLOURS, Plot, roundUp } from "./plots.js";
import { Robot } from "./robot.js";
import { inWords, Stage } from "./stage.js";
import { motionsOf } from "./words.js";

const SPAN = 6; // seconds shown
const BEFORE_S = 0.2, SETTLED_S = 0.05; // of an A/B: time shown before the stop, and time after it that does not affect the scale
const PLOT_EVERY = 3; // frames of the arm
const JOG_MS = 50; // time between two messages while a jog button is down
const WAITS_MS = 1500; // time until the page tries to reconnect

export class Live {
  constructor({ factor }) {
    this.stage = new Stage({ factor, truth: true });
    this.columns = [[], [], [], []];
    this.last = null;
    this._bar();
    this._plots();
    this._connect();
    this.stage.each.push(() => this._draw());
  }

  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  _connect() {
    this.socket = connected(this);
    this.socket.onclose = () => {
      this.on_notice({ text: "The page's server has stopped: start tvist view again.", lasting: true });
      this._state("gone", "page's server has stopped", "");
      setTimeout(() => this._connect(), WAITS_MS);
    };
  }

  _bar() {
    const button = (text, attributes = {}) => h("button", { type: "button", ...attributes }, text);
    this.picker = h("select", { ariaLabel: "robot", onchange: () => this.send({ do: "robot", name: this.picker.value }) });
    this.state = h("span", { class: "state", role: "status" }, h("i"), h("span"));
    this.who = h("span", { class: "who" }, "Nobody has control.");
    this.hold = button("Hold it", { title: "Check the robot and power on here. Switch the robot's own power and brakes at the robot.", onclick: () => this.send({ do: "ready" }) });
    this.way = h("details", { class: "way", hidden: true, open: innerWidth > 820 }, h("summary", {}), h("ol", {}), this.hold);
    this.stage.main.append(this.way);
    this.take = button("Take control", { class: "take", onclick: () => this.send({ do: this.mine ? "give" : "take" }) });
    this.stop = button("STOP", { class: "stop", onclick: () => this.send({ do: "stop" }) });
    this.motions = h("span", { class: "motions", role: "group", ariaLabel: "motions" });
    this.shaper = h("select", { ariaLabel: "shaper", title: "none: no shaping; zv: the paper's shaper; auto: suppresses several modes.",
      onchange: () => this.send({ do: "shape", shaper: this.shaper.value, modes: this.modes?.value() ?? null }) });
    this.ab = button("A/B", { class: "ab", onclick: () => this.send({ do: "compare", ...this.chosen, shaper: this.shaper.value }) });
    this.open = button("more", { ariaExpanded: "false", onclick: () => this._toggle() });
    this.stage.bar.append(
      h("div", { class: "line" }, logo(), this.picker, this.state, this.who, this.take, h("span", { class: "space" }), this.stop),
      h("div", { class: "line scrolls" }, this.ab, this.motions, h("label", { class: "shaper" }, "shaper ", this.shaper), this.open));
    this.more = document.getElementById("more");
  }

  _toggle() {
    this.more.hidden = !this.more.hidden;
    this.open.ariaExpanded = String(!this.more.hidden);
  }

  _plots() {
    const { plots } = this.stage;
    this.alpha = new Plot(plots, "Tool acceleration |α| [m/s²]", [{ label: "", colour: COLOURS.with, fill: true }], { range: [-SPAN, 0] });
    this.qdd = new Plot(plots, "Joint acceleration |q̈| [rad/s²]",
      [{ label: "before the shaper", colour: COLOURS.before }, { label: "shaped", colour: COLOURS.with }], { range: [-SPAN, 0], least: 5 });
    this.qdd.box.classList.add("second");
  }

  /** Show a robot, given its description. */
  on_robot(robot) {
    this.robot?.remove();
    this.stage.scene.clear();
    this.info = robot;
    this.robot = new Robot(this.stage.scene, robot.look);
    this.columns = [[], [], [], []];
    this.stage.noTruth = robot.why_stiff;
    this.stage.say("");
    this.stage.among(robot.look.geometry.world);
    this.stage.result(null);
    this._overlay(null);
    this.picker.replaceChildren(...robot.robots.map((name) => h("option", { value: name, selected: name === robot.name }, name)));
    this.picker.disabled = robot.robots.length < 2;
    this.shaper.replaceChildren(...robot.shapers.map((name) => h("option", { value: name }, name)));
    const motions = motionsOf(this.robot.arm.chain, robot.motions, robot.poses);
    this.chosen = motions[0] ? { first: motions[0].first, last: motions[0].last } : null;
    this.motions.replaceChildren(...motions.map(({ first, last, words }) => {
      const go = h("button", { type: "button", title: `Go to ${first} unless the arm is there, then to ${last}.`,
        onclick: () => {
          this.chosen = { first, last };
          this._overlay(null);
          this.stage.result(null);
          this.send({ do: "move", first, last });
        } }, words);
      go.dataset.motion = `${first} ${last}`;
      return go;
    }));
    this._more(robot);
    this._enable();
  }

  _more(robot) {
    const set = (message) => this.send(message);
    const joint = h("select", { ariaLabel: "joint" }, ...robot.joints.map((name, i) => h("option", { value: i }, name)));
    const jog = (text, direction) => {
      let timer = null;
      const end = () => {
        clearInterval(timer);
        timer = null;
      };
      const begin = (event) => {
        if (timer || event.currentTarget.disabled) return;
        const tell = () => this.send({ do: "jog", joint: +joint.value, direction });
        tell();
        timer = setInterval(tell, JOG_MS);
      };
      return h("button", { type: "button", title: "The arm stops when you release the button.", onpointerdown: begin,
        onpointerup: end, onpointerleave: end, onpointercancel: end, oncontextmenu: (event) => event.preventDefault() }, text);
    };
    this.modes = slider("modes", { min: 1, max: robot.most_modes, step: 1, value: robot.modes,
      hint: "Number of modes that a shaper such as zv suppresses; more than one needs a modal calibration.",
      changed: (modes) => set({ do: "shape", shaper: this.shaper.value, modes }) });
    const speed = slider("speed", { min: 10, max: 100, step: 1, value: 100, unit: " %", hint: "The robot's speed slider.",
      changed: (percent) => set({ do: "speed", fraction: percent / 100 }) });
    const declared = slider("declared", { min: 0, max: robot.rated, step: 0.1, value: robot.mass, unit: " kg", show: (v) => v.toFixed(1),
      hint: "Payload that the controller assumes: it shapes for this mass.", changed: (mass) => set({ do: "declare", mass }) });
    const carried = slider("carried", { min: 0, max: 2 * robot.rated, step: 0.1, value: robot.mass, unit: " kg", show: (v) => v.toFixed(1),
      hint: "Payload that the simulated arm really carries; a change puts the arm at rest." });
    const carry = h("button", { type: "button", onclick: () => set({ do: "carry", mass: carried.value() }) }, "Carry this mass");
    this.controls = h("div", {},
      h("fieldset", {}, h("legend", {}, "Jog"), joint, h("div", { class: "pair" }, jog("− hold to jog", -1), jog("+ hold to jog", 1))),
      h("fieldset", {}, h("legend", {}, "Settings"), this.modes.row, speed.row, declared.row, carried.row, carry),
      Object.keys(robot.faults).length ? this._faults(robot.faults) : null);
    this.figures = h("p", { class: "figures" });
    this.more.replaceChildren(this.stage.choices(), this.figures, this.controls);
  }

  _faults(faults) {
    const meaning = h("p", {}, Object.values(faults)[0]);
    const fault = h("select", { ariaLabel: "fault", onchange: () => write(meaning, faults[fault.value]) },
      ...Object.keys(faults).map((name) => h("option", { value: name }, name)));
    return h("fieldset", {}, h("legend", {}, "Faults"), fault, meaning, h("div", { class: "pair" },
      h("button", { type: "button", onclick: () => this.send({ do: "fault", name: fault.value }) }, "Cause it"),
      h("button", { type: "button", title: "Unlock, restart the safety system, power on.", onclick: () => this.send({ do: "ready" }) }, "Make the robot ready again")));
  }

  on_status(status) {
    this.mine = status.mine;
    this.free = status.free;
    this._state(status.well ? "well" : "stopped", `${status.robot_mode}, ${status.safety_mode}`, status.why);
    write(this.who, status.control);
    write(this.take, this.mine ? "Give back control" : "Take control");
    if (document.activeElement !== this.shaper) this.shaper.value = status.shaper;
    document.title = `${this.info?.name ?? "tvist"} · tvist`;
    this.program = status.program;
    this.stage.setTruth(status.truth);
    this.busy = status.comparing;
    this.only = status.only;
    this._lead(status.steps, status.held);
    write(this.ab, status.comparing ?? `A/B: without, with ${this._shaped()}`);
    this._enable();
  }

  /** Show the checklist for a real arm; the next step includes instructions. */
  _lead(steps, held) {
    const next = steps.findIndex(([done]) => !done);
    this.way.hidden = !steps.length;
    if (!steps.length) return;
    write(this.way.firstChild, next < 0 ? "Real arm: all steps are done" : `Real arm, step ${next + 1} of ${steps.length}`);
    this.hold.hidden = held;
    this.way.children[1].replaceChildren(...steps.map(([done, what, how], i) =>
      h("li", { class: done ? "done" : i === next ? "next" : "" }, what, i === next ? h("em", {}, how) : null)));
  }

  /** The shaper that A/B compares with no shaping. */
  _shaped() {
    const { value } = this.shaper;
    return value && value !== "none" ? value : this.info?.usual ?? "zv";
  }

  _state(kind, words, why) {
    this.state.className = `state ${kind}`;
    write(this.state.lastChild, why ? `${words} — ${why}` : words);
    this.state.title = this.state.textContent;
  }

  _enable() {
    const may = this.mine || this.free;
    for (const one of [...this.motions.children, this.ab]) one.disabled = !may || !!this.busy;
    this.shaper.disabled = !may;
    this.stop.disabled = this.take.disabled = !!this.only;
    this.stop.title = this.only || "Stop the arm now; this needs no control.";
    this.take.title = this.only || "";
    for (const one of this.controls?.querySelectorAll("button, input, select") ?? []) one.disabled = !this.mine;
  }

  on_frame({ t, row, samples, f_d, zeta, delay, note }) {
    this.last = row;
    const [times] = this.columns;
    if (times.length && samples[0].length && samples[0][0] < times.at(-1)) this.columns = [[], [], [], []];
    this.columns.forEach((column, i) => {
      for (const value of samples[i]) column.push(value);
    });
    while (this.columns[0][0] < t - SPAN - 0.5) for (const column of this.columns) column.splice(0, 200);
    this.now = t;
    this.note = note;
    this.drawn = false;
    const figure = (name, value, unit, digits) => (value === null ? "" : `${name} ${value.toFixed(digits)}${unit}  `);
    if (this.figures) write(this.figures, `${figure("f_d", f_d, " Hz", 2)}${figure("ζ", zeta, "", 3)}${figure("delay", 1000 * delay, " ms", 0)}${this.program ?? ""}`);
  }

  on_notice({ text, lasting }) {
    this.stage.say(text, lasting);
  }

  on_gone({ text }) {
    this._state("gone", "no robot", "");
    this.free = this.mine = false;
    this._lead([]);
    this._enable();
    this.stage.say(text, true);
  }

  /** Show both motions of an A/B and the verdict. */
  on_result(result) {
    const motion = [...this.motions.children].find((one) => one.dataset.motion === result.poses.join(" "));
    this.stage.result(inWords({ ...result, motion: motion?.textContent ?? result.poses.join(" → ") }));
    this._overlay(result);
  }

  _overlay(result) {
    this.over?.remove();
    this.over = null;
    this.alpha.box.hidden = !!result;
    if (!result) return;
    // Scale by the vibration after the stop; the deceleration is much larger and would hide it.
    const curves = [result.without, result.shaped];
    const rings = curves.flatMap((curve) => curve.filter((_, i) => result.time[i] > result.stop + SETTLED_S));
    const most = roundUp(1.1 * Math.max(...rings, 0.1));
    this.over = new Plot(this.stage.plots, "Tool acceleration |α| [m/s²]",
      [{ label: "without", colour: COLOURS.without }, { label: `with ${result.with}`, colour: COLOURS.with }],
      { range: [Math.max(result.stop - BEFORE_S, 0), result.time.at(-1)], least: most });
    this.over.say("around the stop");
    this.stage.plots.prepend(this.over.box);
    this.over.show([result.time, ...curves.map((curve) => curve.map((value) => Math.min(value, most)))]);
    this.over.box.append(h("button", { type: "button", class: "close", ariaLabel: "back to the live plot", onclick: () => this._overlay(null) }, "×"));
  }

  _draw() {
    if (this.drawn || !this.last || !this.robot) return;
    this.drawn = true;
    this.send({ do: "seen" });
    this.robot.show(this.last, this.stage.appearance);
    this.pictures = (this.pictures ?? 0) + 1;
    if (this.pictures % PLOT_EVERY) return;
    const seconds = this.columns[0].map((time) => time - this.now);
    this.alpha.show([seconds, this.columns[1]]);
    this.qdd.show([seconds, this.columns[2], this.columns[3]]);
    this.alpha.say(this.note ?? "");
  }
}
