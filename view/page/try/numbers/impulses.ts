// Impulse trains of the catalogue and their residual vibration, ported from `tvist_shaping`.
import { EI2_EXACT, EI3_EXACT, EI_EXACT, UM_ZV, UM_ZVD, ripple } from "./solved.js";

export interface Impulses {
  /** Amplitudes [-], of sum 1. */
  A: number[];
  /** Times [s], ascending from 0. */
  tau: number[];
}

/** Impulses of a mode: damped frequency [Hz], damping ratio [-]. */
export type Shaper = (f_d: number, zeta: number) => Impulses;

const sum = (values: number[]): number => values.reduce((total, one) => total + one, 0);

/** Factor by which a mode decays in half a damped period [-]. */
export const decay = (zeta: number): number => Math.exp((-Math.PI * zeta) / Math.sqrt(1 - zeta * zeta));

/** A shaper from undamped amplitudes, which decay as the mode does, and times in damped periods. */
function train(a: number[], periods: number[]): Shaper {
  return (f_d, zeta) => {
    const rate = (-2 * Math.PI * zeta) / Math.sqrt(1 - zeta * zeta);
    const A = a.map((one, j) => one * Math.exp(rate * periods[j]));
    const total = sum(A);
    return { A: A.map((one) => one / total), tau: periods.map((one) => one / f_d) };
  };
}

const spaced = (a: number[], distance: number): Shaper => train(a, a.map((_, j) => j * distance));
const modified = [1, -2 * Math.cos(0.75 * Math.PI), 1];

/** The shapers of the catalogue on this page, by their names in `tvist_shaping.SHAPERS`. */
export const SHAPERS: Record<string, Shaper> = {
  none: spaced([1], 0),
  um_zv: UM_ZV,
  zv: spaced([1, 1], 0.5),
  mzv: spaced(modified, 0.375),
  um_zvd: UM_ZVD,
  zvd: spaced([1, 2, 1], 0.5),
  ei: spaced(ripple(1), 0.5),
  ei_exact: EI_EXACT,
  // The result of `specified` for 0.75 to 1.25 and 5 %.
  si: train(
    [0.16990040201608808, 0.3300995979839119, 0.3300995979839119, 0.16990040201608808],
    [0, 0.420881413088327, 0.8251686762703891, 1.246050089358716],
  ),
  zvdd: spaced([1, 3, 3, 1], 0.5),
  ei2: spaced(ripple(2), 0.5),
  ei2_exact: EI2_EXACT,
  zvddd: spaced([1, 4, 6, 4, 1], 0.5),
  ei3: spaced(ripple(3), 0.5),
  ei3_exact: EI3_EXACT,
};

/** Vibration of a mode after the impulses, as a share of that after a single one (Singer and Seering, 1990). */
export function residual(f: number, zeta: number, { A, tau }: Impulses): number {
  const omega_d = 2 * Math.PI * f, omega_n = omega_d / Math.sqrt(1 - zeta * zeta), last = tau[tau.length - 1];
  let C = 0, S = 0;
  for (let j = 0; j < A.length; j++) {
    const weight = A[j] * Math.exp(zeta * omega_n * (tau[j] - last));
    C += weight * Math.cos(omega_d * tau[j]);
    S += weight * Math.sin(omega_d * tau[j]);
  }
  return Math.hypot(C, S);
}

/** Frequencies around f_d between which at most V is left [Hz]; the highest is infinite if 10 f_d is still inside, both are NaN if f_d is not. */
export function band(impulses: Impulses, f_d: number, zeta: number, V: number): [number, number] {
  const limit = V + 1e-9;
  const exceeds = (f: number): boolean => residual(f, zeta, impulses) > limit;
  if (exceeds(f_d)) return [NaN, NaN];
  const end = (at: (k: number) => number, count: number): number => {
    for (let k = 1; k <= count; k++) {
      if (!exceeds(at(k))) continue;
      let inner = at(k - 1), outer = at(k);
      for (let round = 0; round < 50; round++) {
        const middle = 0.5 * (inner + outer);
        if (exceeds(middle)) outer = middle;
        else inner = middle;
      }
      return inner;
    }
    return Infinity;
  };
  return [end((k) => f_d * (1 - k / 1000), 1000), end((k) => f_d * (1 + k / 1000), 9000)];
}

/** Σ A_j τ_j [s], the lag of the shaped reference at constant velocity. */
export const meanDelay = ({ A, tau }: Impulses): number => sum(A.map((one, j) => one * tau[j]));
/** Σ |A_j|, the factor by which velocity and acceleration may exceed the reference's [-]. */
export const peak = ({ A }: Impulses): number => sum(A.map(Math.abs));
