// Common parts of all pages: the scene with badge and views, the plots, and the loop that draws.
import { Scene } from "./scene.js";
import { check, h, slider, theme, write } from "./dom.js";

const FACTORS = 300;

export class Stage {
  constructor({ factor = 100, ghost = true, truth = true, noTruth = "" } = {}) {
    this.main = document.getElementById("scene");
    this.plots = document.getElementById("plots");
    this.bar = document.getElementById("bar");
    this.scene = new Scene(this.main.querySelector("canvas"), { theme: theme() });
    this.scene.sparing = true;
    this.appearance = { factor, gravity: false, ghost, trace: true };
    this.noTruth = noTruth;
    this.badge = h("div", { class: "badge" });
    this.card = h("div", { class: "card", hidden: true, role: "status" });
    this.notice = h("div", { class: "notice", hidden: true, role: "alert" });
    const views = ["front", "side", "top", "reset"].map((view) =>
      h("button", { type: "button", onclick: () => this.scene.look(view), title: `look from the ${view}` }, view));
    this.main.append(this.badge, h("div", { class: "views" }, "view ", ...views), this.card, this.notice);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.scene.setTheme(theme()));
    new ResizeObserver(() => this.resize()).observe(this.main);
    this.resize();
    this.setTruth(truth);
    this.each = [];
    let last = performance.now();
    const picture = (now) => {
      const seconds = Math.min((now - last) / 1000, 0.2);
      last = now;
      for (const one of this.each) one(seconds);
      this.scene.draw(seconds);
      requestAnimationFrame(picture);
    };
    requestAnimationFrame(picture);
  }

  resize() {
    const { clientWidth, clientHeight } = this.main;
    if (clientWidth && clientHeight) this.scene.resize(clientWidth, clientHeight);
  }

  /** Set whether deflections are known; without them the arm is drawn stiff, as the badge shows. */
  setTruth(truth) {
    this.truth = truth;
    this._tell();
  }

  _tell() {
    const { factor, gravity } = this.appearance;
    write(this.badge, this.truth ? `bending × ${factor}${gravity ? ", with gravity" : ""}` : `drawn stiff: ${this.noTruth}`);
    this.changed?.();
    this.scene.invalidate();
  }

  /** Draw the arm without magnification if it has a world, so that contacts look right; report shapes that are not drawn. */
  among(world) {
    if (!world) return;
    this.appearance.factor = 1;
    this._tell();
    if (world.unseen) this.say(`${world.unseen} shapes of the world ${world.name} are meshes, which are not drawn`, true);
  }

  /** Options for how the arm is drawn. */
  choices() {
    const set = (name) => (value) => {
      this.appearance[name] = value;
      this._tell();
    };
    // A logarithmic slider.
    const bending = slider("bending ×", {
      min: 0, max: Math.log(FACTORS), step: 0.01, value: Math.log(this.appearance.factor),
      show: (v) => Math.round(Math.exp(v)), moved: (v) => set("factor")(Math.round(Math.exp(v))),
      hint: "Gears twist and links bend by a few milliradians: magnify this by the factor.",
    });
    return h("fieldset", {}, h("legend", {}, "View"), bending.row,
      check("with gravity", false, "Magnify the static deflection by gravity, too.", set("gravity")),
      check("ghost", this.appearance.ghost, "Show in grey where the arm would be without shaping and bending.", set("ghost")),
      check("trace", true, "Show the path of the tool in the last seconds.", set("trace")));
  }

  say(sentence, lasting = false) {
    clearTimeout(this.timer);
    this.notice.hidden = !sentence;
    write(this.notice, sentence);
    if (sentence && !lasting) this.timer = setTimeout(() => (this.notice.hidden = true), 8000);
  }

  /** Show a result in large figures, { large, second, small }; null removes it. */
  result(shown) {
    this.card.hidden = !shown;
    if (!shown) return;
    this.card.replaceChildren(
      h("button", { type: "button", class: "close", ariaLabel: "close", onclick: () => this.result(null) }, "×"),
      h("strong", {}, shown.large), ...(shown.second ? [h("em", {}, shown.second)] : []), h("span", {}, shown.small));
  }
}

const figure = (value) => value.toFixed(value < 0.1 ? 3 : 2);

/** The result of a comparison in the words of `tvist demo`. */
export function inWords({ less_percent: less, earlier_ms: earlier, before, after, with: name, motion }) {
  const large = less === null ? "not measurable" : `${Math.abs(less).toFixed(0)} % ${less >= 0 ? "less" : "more"} vibration`;
  const second = earlier === null ? "" : `at rest ${Math.abs(earlier).toFixed(0)} ms ${earlier >= 0 ? "earlier" : "later"}`;
  const figures = before === null || after === null ? "" : `: without ${figure(before)}, with ${name} ${figure(after)} m/s² after the stop`;
  return { large, second, small: `${motion}${figures}` };
}
