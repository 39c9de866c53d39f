// Shapers without a closed form in ζ: Newton's method from zero damping upwards, and a polynomial through the solutions.
import type { Shaper } from "./impulses.js";

const V = 0.05, STEP = 1e-7, FARTHEST = 0.2, SOLVED = 1e-12;
const NODES = 32, MOST_NODES = 256, SMALL = 1e-7;

type Equations = (x: number[]) => number[];
type Solution = { x: number[]; A: number[]; periods: number[] };
type Follow = (zeta: number, near: number[]) => Solution;

/** Solve M x = b by elimination with pivoting; null if M is singular. */
function linear(M: number[][], b: number[]): number[] | null {
  const rows = M.map((row, i) => [...row, b[i]]), n = b.length;
  for (let i = 0; i < n; i++) {
    let best = i;
    for (let k = i + 1; k < n; k++) if (Math.abs(rows[k][i]) > Math.abs(rows[best][i])) best = k;
    [rows[i], rows[best]] = [rows[best], rows[i]];
    if (!(Math.abs(rows[i][i]) > 0)) return null;
    for (let k = i + 1; k < n; k++) {
      const share = rows[k][i] / rows[i][i];
      for (let j = i; j <= n; j++) rows[k][j] -= share * rows[i][j];
    }
  }
  const x = new Array<number>(n).fill(0);
  for (let i = n - 1; i >= 0; i--) {
    let value = rows[i][n];
    for (let j = i + 1; j < n; j++) value -= rows[i][j] * x[j];
    x[i] = value / rows[i][i];
  }
  return x;
}

function newton(equations: Equations, start: number[]): number[] {
  let x = [...start];
  for (let round = 0; round < 60; round++) {
    const left = equations(x);
    if (Math.max(...left.map(Math.abs)) < SOLVED) return x;
    const columns = x.map((_, k) => equations(x.map((one, i) => (i === k ? one + STEP : one))));
    const J = left.map((value, i) => columns.map((column) => (column[i] - value) / STEP));
    const change = linear(J, left.map((value) => -value));
    if (!change || !change.every(Number.isFinite)) break;
    const share = Math.min(1, FARTHEST / Math.max(...change.map(Math.abs), 1e-300));
    x = x.map((one, i) => one + share * change[i]);
  }
  throw new Error(`Newton's method found no solution of ${start.length} equations`);
}

/** Polynomials in ζ through the solutions at Chebyshev's nodes; computed when first needed. */
function tabulated(follow: Follow, start: number[], zetaMax: number): Shaper {
  let coefficients: number[][] | null = null;
  const tabulate = (count: number): number[][] => {
    const values: number[][] = [], angles: number[] = [];
    let last = start, zeta = 0, slope = start.map(() => 0);
    for (let k = count - 1; k >= 0; k--) {
      const angle = ((k + 0.5) * Math.PI) / count, next = 0.5 * zetaMax * (1 + Math.cos(angle)), step = next - zeta;
      zeta = next;
      const { x, A, periods } = follow(zeta, last.map((one, i) => one + step * slope[i]));
      slope = x.map((one, i) => (one - last[i]) / step);
      last = x;
      values.push([...A, ...periods]);
      angles.push(angle);
    }
    return angles.map((_, k) =>
      values[0].map((_one, column) => {
        let total = 0;
        for (let i = 0; i < count; i++) total += Math.cos(k * angles[i]) * values[i][column];
        return (total * (k === 0 ? 1 : 2)) / count;
      }));
  };
  return (f_d, zeta) => {
    if (!(zeta >= 0 && zeta < zetaMax)) throw new RangeError(`ζ is ${zeta}, and must be less than ${zetaMax}`);
    if (!coefficients) {
      let count = NODES;
      coefficients = tabulate(count);
      while (Math.max(...coefficients.slice(-3).flat().map(Math.abs)) > SMALL && count < MOST_NODES) coefficients = tabulate((count *= 2));
    }
    const angle = Math.acos(Math.min(Math.max((2 * zeta) / zetaMax - 1, -1), 1)), N = coefficients[0].length / 2;
    const sums = coefficients[0].map((_, column) => coefficients!.reduce((total, row, k) => total + Math.cos(angle * k) * row[column], 0));
    const total = sums.slice(0, N).reduce((a, b) => a + b, 0);
    return { A: sums.slice(0, N).map((one) => one / total), tau: sums.slice(N).map((one, j) => (j === 0 ? 0 : one) / f_d) };
  };
}

const widening = (humps: number): number => Math.cosh(Math.acosh(1 / V) / (humps + 1));

/** Amplitudes of the undamped extra-insensitive shapers: Chebyshev's polynomial, as in Dolph's arrays. */
export function ripple(humps: number): number[] {
  const N = humps + 2, x0 = widening(humps), places = Array.from({ length: N }, (_, n) => n);
  const spectrum = places.map((n) => {
    const x = x0 * Math.cos((Math.PI * n) / N), size = Math.abs(x);
    return V * (size <= 1 ? Math.cos((N - 1) * Math.acos(x)) : Math.sign(x) ** (N - 1) * Math.cosh((N - 1) * Math.acosh(size)));
  });
  const a = places.map((n) => places.reduce((total, k) => total + Math.cos((2 * Math.PI * (n - (N - 1) / 2) * k) / N) * spectrum[k], 0));
  const total = a.reduce((p, q) => p + q, 0);
  return a.map((one) => one / total);
}

/** Sum of A_j exp(r ((c + 2πi) τ_j - c τ_N)) and of the same times its exponent: [re, im, slope re, slope im]. */
function wave(A: number[], tau: number[], c: number, r: number): [number, number, number, number] {
  let re = 0, im = 0, dre = 0, dim = 0;
  for (let j = 0; j < A.length; j++) {
    const real = c * tau[j] - c * tau[tau.length - 1], turn = 2 * Math.PI * tau[j], size = A[j] * Math.exp(r * real);
    const x = size * Math.cos(r * turn), y = size * Math.sin(r * turn);
    re += x;
    im += y;
    dre += x * real - y * turn;
    dim += x * turn + y * real;
  }
  return [re, im, dre, dim];
}

const rate = (zeta: number): number => (2 * Math.PI * zeta) / Math.sqrt(1 - zeta * zeta);

/** Humps of height V with any damping: zeros E = 0, humps |E| = V with d|E|/dr = 0, the middle one of them at r = 1. */
function humped(humps: number, zetaMax: number): Shaper {
  const N = humps + 2, degree = humps + 1;
  const features = Array.from({ length: 2 * degree - 1 }, (_, k) => (2 / Math.PI) * Math.acos(Math.cos(((k + 1) * Math.PI) / (2 * degree)) / widening(humps)));
  const start = [...ripple(humps), ...Array.from({ length: N - 1 }, (_, k) => (k + 1) / 2), ...features.filter((_, k) => k !== humps)];
  const split = (x: number[]): { A: number[]; tau: number[]; found: number[] } => {
    const rest = x.slice(2 * N - 1), half = rest.length / 2;
    return { A: x.slice(0, N), tau: [0, ...x.slice(N, 2 * N - 1)], found: [...rest.slice(0, half), 1, ...rest.slice(half)] };
  };
  const follow: Follow = (zeta, near) => {
    const c = rate(zeta);
    const x = newton((point) => {
      const { A, tau, found } = split(point);
      const zeros = found.filter((_, k) => k % 2 === 0).map((r) => wave(A, tau, c, r));
      const tops = found.filter((_, k) => k % 2 === 1).map((r) => wave(A, tau, c, r));
      return [
        A.reduce((p, q) => p + q, 0) - 1, ...zeros.map(([re]) => re), ...zeros.map(([, im]) => im),
        ...tops.map(([re, im]) => (re * re + im * im) / V - V), ...tops.map(([re, im, dre, dim]) => (re * dre + im * dim) / V),
      ];
    }, near);
    const { A, tau } = split(x);
    return { x, A, periods: tau };
  };
  return tabulated(follow, start, zetaMax);
}

/** Impulses +1, -1, +1, ...: E(1) = 0, with five of them also E'(1) = 0. */
function unity(A: number[], start: number[]): Shaper {
  const follow: Follow = (zeta, near) => {
    const c = rate(zeta);
    const x = newton((point) => {
      const tau = [0, ...point];
      const [re, im] = wave(A, tau, c, 1);
      if (A.length === 3) return [re, im];
      const last = tau[tau.length - 1];
      const terms = A.map((one, j) => one * Math.exp(c * (tau[j] - last)) * tau[j]);
      const turn = tau.map((one) => 2 * Math.PI * (one - last));
      const E = A.map((one, j) => one * Math.exp(c * (tau[j] - last)));
      const total = (values: number[], f: (x: number) => number): number => values.reduce((p, q, j) => p + q * f(turn[j]), 0);
      return [total(E, Math.cos), total(E, Math.sin), total(terms, Math.cos), total(terms, Math.sin)];
    }, near);
    return { x, A, periods: [0, ...x] };
  };
  return tabulated(follow, start, 0.5);
}

export const EI_EXACT = humped(1, 0.52);
export const EI2_EXACT = humped(2, 0.32);
export const EI3_EXACT = humped(3, 0.2);
export const UM_ZV = unity([1, -1, 1], [1 / 6, 1 / 3]);
export const UM_ZVD = unity([1, -1, 1, -1, 1], [0.0895, 0.3662, 0.643, 0.7325]);
