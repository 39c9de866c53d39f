// Plots over the whole width, with legends and scales that only grow.
import uPlot from "uplot";

export const COLOURS = { without: "#D55E00", with: "#0072B2", third: "#009E73", before: "#8A8A8A" };
const STEPS = [1, 2, 5];

/** Round up to 1, 2, 5, 10, ... */
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-6)));
  return STEPS.map((step) => step * power).find((one) => one >= value * 0.999) ?? 10 * power;
}

const ink = () => getComputedStyle(document.documentElement).getPropertyValue("--muted").trim();
const line = () => getComputedStyle(document.documentElement).getPropertyValue("--line").trim();

export class Plot {
  /** @param lines [{ label, colour, fill, points }]; least: initial upper end of the scale. */
  constructor(parent, title, lines, { least = 1, x = "s", range = null, signed = false } = {}) {
    this.box = Object.assign(document.createElement("figure"), { className: "plot" });
    this.box.setAttribute("aria-label", title);
    parent.append(this.box);
    this.least = this.top = least;
    this.range = range;
    this.title = title;
    this.lines = lines;
    this.note = "";
    const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { show: false }, font: "11px system-ui", gap: 3 };
    this.plot = new uPlot(
      {
        width: 300, height: 120,
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, points: { size: 5 } },
        scales: { x: { time: false, range: () => this.range ?? this._own() }, y: { range: () => [signed ? -this.top : 0, this.top] } },
        axes: [{ ...axis, size: 22, values: (_, ticks) => ticks.map((tick) => `${+tick.toFixed(3)} ${x}`), space: 70 },
               { ...axis, size: 38, space: 26 }],
        series: [{}, ...lines.map(({ colour, fill, points }) => ({
          stroke: colour, width: 1.6, fill: fill ? `${colour}22` : undefined, points: { show: !!points, size: 8, fill: colour }, spanGaps: false,
        }))],
      },
      [[0, 1], ...lines.map(() => [null, null])],
      this.box,
    );
    this.head = Object.assign(document.createElement("figcaption"), { className: "head" });
    this.box.prepend(this.head);
    this._caption();
    this.box.addEventListener("dblclick", () => this.forgetScale());
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(this.box);
    this.fit();
  }

  _own() {
    const [x] = this.plot?.data ?? [[0, 1]];
    return [x[0] ?? 0, x.at(-1) ?? 1];
  }

  _caption() {
    this.head.replaceChildren(
      Object.assign(document.createElement("b"), { textContent: this.title }),
      ...this.lines.filter(({ label }) => label).map(({ label, colour }) => {
        const key = Object.assign(document.createElement("span"), { className: "key", textContent: label });
        key.style.setProperty("--colour", colour);
        return key;
      }),
      Object.assign(document.createElement("span"), { className: "note", textContent: this.note }),
    );
  }

  say(note) {
    if (note === this.note) return;
    this.note = note;
    this.head.lastChild.textContent = note;
  }

  fit() {
    const { clientWidth, clientHeight } = this.box;
    const height = clientHeight - this.head.offsetHeight;
    if (clientWidth > 20 && height > 20) this.plot.setSize({ width: clientWidth, height });
  }

  /** Draw columns: x, then one for each line. The scale grows with the data. */
  show(columns) {
    for (const column of columns.slice(1)) for (const value of column) if (Math.abs(value) > this.top) this.top = roundUp(Math.abs(value));
    this.plot.setData(columns);
  }

  forgetScale() {
    this.top = this.least;
    this.show(this.plot.data);
  }

  remove() {
    this.observer.disconnect();
    this.plot.destroy();
    this.box.remove();
  }
}
