// The TVIST filter: the impulses of the present tick, applied to past samples by a delay line with fractional delays.
import type { Shaper } from "./impulses.js";

/** Frequency [Hz] and damping ratio [-] at joint angles [rad]. */
export type Estimator = (q: number[]) => [number, number];

export class Filter {
  private readonly ring: number[][];
  private head = 0;
  private last: number[];
  /** Impulses of the last tick. */
  impulses: ReturnType<Shaper> = { A: [1], tau: [0] };

  constructor(private readonly shaper: Shaper, private readonly estimator: Estimator, start: number[], private readonly period: number, longest = 1) {
    this.ring = Array.from({ length: Math.ceil(longest / period) + 5 }, () => [...start]);
    this.last = [...start];
  }

  /** The next shaped sample [rad]. */
  filter(sample: number[]): number[] {
    this.head = (this.head + 1) % this.ring.length;
    this.ring[this.head] = [...sample];
    this.impulses = this.shaper(...this.estimator(this.last));
    const { A, tau } = this.impulses;
    this.last = this.gather(A, tau.map((one) => one / this.period));
    return [...this.last];
  }

  /** x(d_1) + Σ A_j (x(d_j) - x(d_1)): a constant reference stays the same to the last bit. */
  private gather(A: number[], delays: number[]): number[] {
    const { ring, head } = this, capacity = ring.length;
    let first: number[] = [], out: number[] = [];
    for (let j = 0; j < A.length; j++) {
      const delay = delays[j];
      if (!(delay >= 0 && delay <= capacity - 3)) throw new RangeError(`a delay of ${delay} ticks does not fit`);
      const whole = Math.floor(delay), start = Math.max(whole - 1, 0), s = delay - start;
      const weights = [
        (-(s - 1) * (s - 2) * (s - 3)) / 6, (s * (s - 2) * (s - 3)) / 2, (-s * (s - 1) * (s - 3)) / 2, (s * (s - 1) * (s - 2)) / 6,
      ];
      const at = (age: number): number[] => ring[(head - age + 2 * capacity) % capacity];
      const near = at(whole), nodes = [0, 1, 2, 3].map((k) => at(start + k));
      const x = near.map((value, k) =>
        delay === whole ? value
          : value + (weights[0] * (nodes[0][k] - value) + weights[1] * (nodes[1][k] - value) + weights[2] * (nodes[2][k] - value) + weights[3] * (nodes[3][k] - value)));
      if (j === 0) [first, out] = [x, [...x]];
      else for (let k = 0; k < x.length; k++) out[k] += A[j] * (x[k] - first[k]);
    }
    return out;
  }
}
