// One mass on a spring with a moving end, solved exactly for an acceleration that is constant between samples.
import type { Impulses } from "./impulses.js";

export const STEP = 0.002, TURN = 1, MOTION_S = 0.6, JERK_S = 0.04;

export interface Swing {
  /** Position of the spring's moving end, and the spring's deflection [rad, or any length]. */
  reference: number[];
  deflection: number[];
}

/** Acceleration of the motion: up, then down, each with finite jerk. */
function profile(time: number): number {
  const half = MOTION_S / 2;
  const pulse = (t: number): number => Math.min(Math.max(Math.min(t, half - t) / JERK_S, 0), 1);
  return ((pulse(time) - pulse(time - half)) * TURN) / (half * (half - JERK_S));
}

/** δ'' + 2 ζ ω δ' + ω² δ = -q̈ for a motion that goes through a shaper's impulses. */
export function swing(f_d: number, zeta: number, { A, tau }: Impulses, length = 2): Swing {
  const w_d = 2 * Math.PI * f_d, omega = w_d / Math.sqrt(1 - zeta * zeta), sigma = zeta * omega;
  const fade = Math.exp(-sigma * STEP), c = Math.cos(w_d * STEP), s = Math.sin(w_d * STEP);
  const free = [[fade * (c + (sigma / w_d) * s), (fade * s) / w_d], [(-fade * omega * omega * s) / w_d, fade * (c - (sigma / w_d) * s)]];
  const still = 1 / (omega * omega), forced = [still - free[0][0] * still, -free[1][0] * still];
  const reference: number[] = [], deflection: number[] = [];
  let [x, v, speed, place] = [0, 0, 0, 0];
  const count = Math.round(length / STEP);
  for (let i = 0; i < count; i++) {
    const time = i * STEP;
    let a = 0;
    for (let j = 0; j < A.length; j++) a += A[j] * profile(time - tau[j]);
    deflection.push(x);
    [x, v] = [free[0][0] * x + free[0][1] * v - forced[0] * a, free[1][0] * x + free[1][1] * v - forced[1] * a];
    speed += a;
    place += speed * STEP;
    reference.push(place * STEP);
  }
  return { reference, deflection };
}
