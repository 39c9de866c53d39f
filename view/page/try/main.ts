// The interactive shaping page: four scenes, one at a time, whose state is in the address.
import type { ArmParameters } from "./numbers/arm.js";
import * as arm from "./numbers/arm.js";
import { Filter } from "./numbers/filter.js";
import * as impulses from "./numbers/impulses.js";
import { swing } from "./numbers/mass.js";
import { armScene } from "./arm_scene.js";
import { h, logo, write } from "./house.js";
import taken from "./made/taken.json";
import { typed } from "./own.js";
import type { Page, SceneOf } from "./scene.js";
import { springScene } from "./spring_scene.js";
import type { SceneName, State } from "./state.js";
import { SCENES, read, written } from "./state.js";
import { ur5eScene } from "./ur5e_scene.js";
import { say } from "./words.js";

const zetaMax = Object.fromEntries(taken.catalogue.map(({ name, zeta_max }) => [name, zeta_max]));
const missing = taken.catalogue.map(({ name }) => name).filter((name) => !(name in impulses.SHAPERS));
const parameters: ArmParameters = taken.arm;

const make: Record<SceneName, (page: Page) => SceneOf> = {
  mass: (page) => springScene(page, false, zetaMax),
  own: (page) => springScene(page, true, zetaMax),
  arm: (page) => armScene(page, parameters),
  ur5e: (page) => ur5eScene(page, taken.ur5e),
};

const part = <T extends HTMLElement>(name: string): T => document.getElementById(name) as T;
let { state, refused } = read(location.hash);
let scene: SceneOf | null = null, open: SceneName | null = null, paused = false;

const page: Page = {
  canvas: part<HTMLCanvasElement>("flat"),
  solid: part<HTMLCanvasElement>("solid"),
  plots: part("plots"),
  panel: part("controls"),
  result(large, small) {
    write(part("large"), large);
    write(part("small"), small);
  },
  change(changed) {
    state = { ...state, ...changed };
    history.replaceState(null, "", written(state));
    show(state);
  },
};

const tabs = SCENES.map((name) => h("button", { type: "button", role: "tab", id: `tab-${name}`, onclick: () => page.change({ scene: name }) }, say(`tab_${name}`)));
const play = h("button", { type: "button", onclick: () => { paused = !paused; write(play, say(paused ? "play" : "pause")); } }, say("pause"));
const copy = h("button", {
  type: "button",
  onclick: () => navigator.clipboard?.writeText(location.href).then(() => { write(copy, say("copied")); setTimeout(() => write(copy, say("copy")), 1500); }),
}, say("copy"));

function show(next: State): void {
  if (next.scene !== open) {
    scene?.leave();
    for (const box of [page.plots, page.panel]) box.replaceChildren();
    open = next.scene;
    document.body.dataset.scene = open;
    document.title = `${say(`tab_${open}`)}: ${say("title")}`;
    write(part("head"), say(`head_${open}`));
    write(part("lead"), say(`lead_${open}`));
    SCENES.forEach((name, k) => (tabs[k].ariaSelected = String(name === open)));
    scene = make[open](page);
  }
  scene?.show(next);
}

part("tabs").append(logo(), ...tabs);
part("buttons").append(play, copy);
write(part("foot"), [say("footer"), ...(missing.length ? [say("missing", { names: missing.join(", ") })] : [])].join(" "));
const notice = part("notice");
const tell = (): void => {
  notice.hidden = refused.length === 0;
  write(notice, refused.length ? say("wrong_link", { what: refused.join(", ") }) : "");
};
tell();
show(state);
addEventListener("hashchange", () => {
  ({ state, refused } = read(location.hash));
  tell();
  show(state);
});

let last = performance.now(), pictures = 0;
const picture = (now: number): void => {
  const seconds = Math.min(Math.max(now - last, 0) / 1000, 0.1); // the first frame's time may precede the script
  last = now;
  pictures++;
  if (!paused || pictures < 3) scene?.frame(paused ? 0 : seconds);
  requestAnimationFrame(picture);
};
requestAnimationFrame(picture);

// For the tests, which compare the numbers of this page with those of the packages.
Object.assign(window, { tried: { ...impulses, ...arm, Filter, swing, typed, parameters, missing, pictures: () => pictures } });
