// Drawings on a canvas: two carts on rails, and arms seen from above.
import { COLOURS } from "./house.js";

const ink = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** The canvas, cleared, in units of the page's pixels. */
export function begin(canvas: HTMLCanvasElement): { pen: CanvasRenderingContext2D; width: number; height: number } {
  const ratio = Math.min(devicePixelRatio, 2), width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  }
  const pen = canvas.getContext("2d")!;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.lineCap = pen.lineJoin = "round";
  return { pen, width, height };
}

function label(pen: CanvasRenderingContext2D, text: string, x: number, y: number, colour: string, align: CanvasTextAlign = "left"): void {
  pen.font = "600 14px system-ui, sans-serif";
  pen.textAlign = align;
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

export interface Cart {
  name: string;
  colour: string;
  /** Position of the cart, 0 to 1, and distance of the mass from its rest position [trips]. */
  way: number;
  off: number;
}

export function drawCarts(canvas: HTMLCanvasElement, carts: Cart[]): void {
  const { pen, width, height } = begin(canvas);
  const lane = height / carts.length, size = Math.min(lane * 0.34, width * 0.075);
  const trip = width - 9.4 * size, spring = 3.2 * size;
  carts.forEach(({ name, colour, way, off }, number) => {
    const rail = lane * (number + 0.78), left = 2.2 * size + way * trip, belongs = left + size / 2 + spring;
    const at = belongs + off * trip;
    pen.strokeStyle = ink("--line");
    pen.lineWidth = 3;
    pen.beginPath();
    pen.moveTo(0.6 * size, rail);
    pen.lineTo(width - 0.6 * size, rail);
    pen.stroke();
    label(pen, name, 0.6 * size, lane * number + 20, colour);
    // The rest position of the mass.
    pen.setLineDash([4, 5]);
    pen.lineWidth = 1.5;
    pen.strokeStyle = ink("--muted");
    pen.beginPath();
    pen.arc(belongs, rail - 0.62 * size, 0.58 * size, 0, 2 * Math.PI);
    pen.stroke();
    pen.setLineDash([]);
    // The spring, whose turns stretch.
    const from = left + 0.5 * size, to = at - 0.58 * size, y = rail - 0.62 * size;
    pen.strokeStyle = ink("--ink");
    pen.lineWidth = 2.2;
    pen.beginPath();
    pen.moveTo(from, y);
    for (let turn = 0; turn <= 14; turn++) pen.lineTo(from + ((to - from) * (turn + 1)) / 16, y + (turn % 2 ? 1 : -1) * 0.26 * size * (turn > 0 && turn < 14 ? 1 : 0));
    pen.lineTo(to, y);
    pen.stroke();
    // The cart that pulls, and the mass.
    pen.fillStyle = ink("--ink");
    pen.beginPath();
    pen.roundRect(left - 0.7 * size, rail - 1.12 * size, 1.2 * size, 1.0 * size, 0.16 * size);
    pen.fill();
    for (const wheel of [-0.4, 0.2]) {
      pen.beginPath();
      pen.arc(left + wheel * size, rail - 0.12 * size, 0.12 * size, 0, 2 * Math.PI);
      pen.fill();
    }
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(at, y, 0.58 * size, 0, 2 * Math.PI);
    pen.fill();
  });
}

export interface ArmShown {
  name: string;
  colour: string;
  /** Motors, and links, of shoulder and elbow [rad]. */
  motor: number[];
  link: number[];
}

/** Arms side by side, with the shoulder's twist magnified. */
export function drawArms(canvas: HTMLCanvasElement, arms: ArmShown[], lengths: number[], factor: number): void {
  const { pen, width, height } = begin(canvas);
  const cell = width / arms.length, scale = Math.min(cell / 0.78, (height - 34) / 0.68);
  arms.forEach(({ name, colour, motor, link }, number) => {
    const x = cell * (number + 0.5) + 0.04 * scale, y = height - 0.11 * scale;
    label(pen, name, cell * (number + 0.5), 20, colour, "center");
    const shown = link.map((angle, j) => motor[j] + (j === 0 ? factor * (angle - motor[j]) : angle - motor[j]));
    const joints = (angles: number[]): [number, number][] => {
      const [a, b] = [angles[0], angles[0] + angles[1]];
      const elbow: [number, number] = [x + scale * lengths[0] * Math.cos(a), y - scale * lengths[0] * Math.sin(a)];
      return [[x, y], elbow, [elbow[0] + scale * lengths[1] * Math.cos(b), elbow[1] - scale * lengths[1] * Math.sin(b)]];
    };
    const path = (points: [number, number][], wide: number, colour_: string): void => {
      pen.strokeStyle = colour_;
      for (let k = 0; k < 2; k++) {
        pen.lineWidth = wide * (k === 0 ? 1 : 0.7);
        pen.beginPath();
        pen.moveTo(...points[k]);
        pen.lineTo(...points[k + 1]);
        pen.stroke();
      }
    };
    const dot = ([px, py]: [number, number], radius: number, fill: string): void => {
      pen.fillStyle = fill;
      pen.beginPath();
      pen.arc(px, py, radius, 0, 2 * Math.PI);
      pen.fill();
    };
    pen.globalAlpha = 0.55;
    path(joints(motor), 0.075 * scale, ink("--line"));
    pen.globalAlpha = 1;
    const points = joints(shown);
    path(points, 0.06 * scale, colour);
    dot(points[0], 0.055 * scale, ink("--ink"));
    dot(points[1], 0.032 * scale, ink("--ink"));
    dot(points[2], 0.045 * scale, ink("--ink"));
    dot(points[2], 0.028 * scale, colour);
  });
}

const NS = "http://www.w3.org/2000/svg";

/** Impulses as stems over time. */
export function stems(box: Element, A: number[], tau: number[]): void {
  const width = 320, height = 116, left = 12, base = 74, last = Math.max(tau[tau.length - 1], 1e-3);
  const most = Math.max(...A.map(Math.abs), 0.01), low = Math.min(...A) < 0;
  const zero = low ? 46 : base, up = (low ? 34 : 58) / most;
  const svg = document.createElementNS(NS, "svg");
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const add = (name: string, attributes: Record<string, string | number>, text = ""): void => {
    const one = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, String(value));
    one.textContent = text;
    svg.append(one);
  };
  add("line", { x1: left, x2: width - 8, y1: zero, y2: zero, stroke: "var(--line)", "stroke-width": 1.5 });
  A.forEach((one, j) => {
    const x = left + 18 + (tau[j] / last) * (width - 70) * (tau.length > 1 ? 1 : 0), y = zero - one * up;
    add("line", { x1: x, x2: x, y1: zero, y2: y, stroke: COLOURS.with, "stroke-width": 5, "stroke-linecap": "round" });
    if (A.length > 6) return;
    add("text", { x, y: one < 0 ? y + 15 : y - 6, "text-anchor": "middle", class: "stem" }, `${(100 * one).toFixed(0)} %`.replace("-", "−"));
    add("text", { x, y: height - 8, "text-anchor": "middle", class: "stem faint" }, `${(1000 * tau[j]).toFixed(0)} ms`);
  });
  box.replaceChildren(svg);
}
