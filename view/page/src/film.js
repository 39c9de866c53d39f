// Frames of a film: runs side by side with labels, a plot of the tools' vibration, and the verdict.
// The server requests a time and receives its frame.
import * as THREE from "three";
import { connected } from "./dom.js";
import { COLOURS, roundUp } from "./plots.js";
import { inWords } from "./stage.js";
import { Scene } from "./scene.js";
import { columns, Track } from "./tracks.js";

const INK = { light: ["#1f2933", "#5b6670", "#d9dee3", "#ffffff"], dark: ["#e6eaed", "#9aa6b1", "#343c44", "#14181c"] };

const LIGHTER = { [COLOURS.with]: "#4aa3dd", [COLOURS.without]: "#f08a3c" }; // on a dark background

export class Film {
  constructor(boot) {
    const { width, height, theme } = boot;
    Object.assign(this, { boot, width, height, theme });
    const canvas = document.querySelector("#scene canvas");
    this.scene = new Scene(canvas, { theme });
    this.tall = Math.round(0.66 * height);
    this.scene.resize(width, this.tall, 1);
    this.appearance = { factor: boot.factor, gravity: false, ghost: false, trace: true };
    this.tracks = boot.tracks.map((packed, number) => new Track(this.scene, packed, number, boot.tracks.length));
    this.scene.keep(this.tracks.flatMap((track) => track.outlines(this.appearance)));
    this.alpha = columns(this.tracks, "alpha");
    this.picture = Object.assign(document.createElement("canvas"), { width, height });
    connected(this);
  }

  async on_draw({ time, slow }, socket) {
    this.draw(time, slow);
    const blob = await new Promise((done) => this.picture.toBlob(done, "image/png"));
    socket.send(await blob.arrayBuffer());
  }

  draw(time, slow) {
    const { width, height, tall, tracks } = this, context = this.picture.getContext("2d");
    for (const track of tracks) track.robot.show(track.row(time), this.appearance);
    this.scene.draw();
    const [ink, muted, line, paper] = INK[this.theme];
    const shade = (colour) => (this.theme === "dark" ? (LIGHTER[colour] ?? colour) : colour);
    context.fillStyle = paper;
    context.fillRect(0, 0, width, height);
    context.drawImage(this.scene.canvas, 0, 0, width, tall);
    const text = (words, x, y, { size = 0.022, weight = 400, colour = ink, align = "left" } = {}) => {
      context.font = `${weight} ${size * width}px system-ui, "DejaVu Sans", sans-serif`;
      [context.fillStyle, context.textAlign] = [shade(colour), align];
      context.fillText(words, x, y);
    };
    for (const { label, colour, at } of tracks) {
      const place = new THREE.Vector3(at[0], at[1], -0.02).project(this.scene.camera);
      if (tracks.length > 1) text(label, ((place.x + 1) / 2) * width, Math.min(((1 - place.y) / 2) * tall + 0.045 * width, tall - 0.012 * width), { size: 0.032, weight: 700, colour, align: "center" });
    }
    const words = [this.appearance.factor > 1 ? `bending × ${this.appearance.factor}` : "", slow > 1 ? `slow motion, 1/${slow}` : ""];
    text(words.filter(Boolean).join(" · "), width - 0.015 * width, 0.03 * width, { size: 0.017, colour: muted, align: "right" });
    const { result } = this.boot;
    if (result && time >= this.boot.tells) {
      const { large, second } = inWords(result);
      text(large, 0.02 * width, 0.05 * width, { size: 0.042, weight: 700, colour: COLOURS.with });
      text(second, 0.02 * width, 0.082 * width, { size: 0.024, weight: 600 });
    }
    this._plot(context, text, time, { muted, line, shade });
  }

  _plot(context, text, time, { muted, line, shade }) {
    const { width, height, tall, alpha, tracks, boot } = this;
    const [left, right, top, bottom] = [0.05 * width, 0.985 * width, tall + 0.05 * width, height - 0.03 * width];
    const [times] = alpha, end = times.at(-1), { begin } = boot;
    const most = roundUp(boot.most), x = (t) => left + ((right - left) * Math.max(t - begin, 0)) / (end - begin), y = (a) => bottom - (bottom - top) * Math.min(a / most, 1);
    text("acceleration of the tool |α| [m/s²] over time [s]; shaded: it should stand still", left, tall + 0.032 * width, { size: 0.017, colour: muted });
    context.fillStyle = `${line}88`;
    for (const [from, to] of boot.rests) context.fillRect(x(from), top, x(Math.min(to, end)) - x(from), bottom - top);
    context.strokeStyle = line;
    for (const share of [0, 0.5, 1]) {
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(left, y(share * most));
      context.lineTo(right, y(share * most));
      context.stroke();
      text(`${+(share * most).toFixed(2)}`, left - 6, y(share * most) + 5, { size: 0.014, colour: muted, align: "right" });
    }
    const step = end - begin > 3 ? 1 : 0.2;
    for (let tick = Math.ceil(begin / step) * step; tick <= end; tick += step) text(`${+tick.toFixed(1)}`, x(tick), height - 0.01 * width, { size: 0.014, colour: muted, align: "center" });
    tracks.forEach(({ colour }, number) => {
      context.strokeStyle = shade(colour);
      context.lineWidth = 0.0022 * width;
      context.beginPath();
      times.forEach((t, i) => {
        if (t >= begin && t <= time && alpha[1 + number][i] !== null) context.lineTo(x(t), y(alpha[1 + number][i]));
      });
      context.stroke();
    });
  }
}
