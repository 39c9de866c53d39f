// The arm with one flexible joint, as `tvist_plant` simulates it: two links that turn about vertical axes, springs, drives
// with friction and gear errors, and the linearly implicit midpoint rule of its integrator.
import type { Estimator } from "./filter.js";
import { Filter } from "./filter.js";
import type { Shaper } from "./impulses.js";
import type { Limits } from "./motion.js";
import { pointToPoint } from "./motion.js";

/** What `python -m tools.try_page` takes from the robot file; lists have an entry for each joint. */
export interface ArmParameters {
  /** Inertia about the shoulder at 90° of the elbow, what cos q adds to it, and that of the forearm about the elbow [kg m²]. */
  middle: number;
  change: number;
  forearm: number;
  lengths: number[];
  gear_stiffness: number[];
  gear_damping: number[];
  rotor_inertia: number[];
  velocity_gain: number[];
  position_gain: number[];
  integral_gain: number[];
  coulomb_friction: number[];
  friction_width: number;
  friction_feedforward: number;
  friction_feedforward_width: number;
  gear_error_amplitude: number;
  gear_error_waves: number;
  gear_phase: number[];
  period: number;
  substeps: number;
  limits: Limits;
}

/** Ticks at rest before a motion, and ticks simulated after it. */
export const RESTING = 4, AFTER = 350;

type Pair = [number, number];

/** Rotation of the shoulder's mode at an elbow: frequency [Hz] and damping ratio [-], in closed form. */
export function modeOf({ middle, change, gear_stiffness: [K], gear_damping: [D] }: ArmParameters, elbow: number): Pair {
  const inertia = middle + change * Math.cos(elbow), zeta = D / (2 * Math.sqrt(K * inertia));
  return [(Math.sqrt(K / inertia) * Math.sqrt(1 - zeta ** 2)) / (2 * Math.PI), zeta];
}

/** The closed form as an estimator, whose frequency is too high by a share [-]. */
export const following = (arm: ArmParameters, error = 0): Estimator => (q) => {
  const [f_d, zeta] = modeOf(arm, q[1]);
  return [f_d * (1 + error), zeta];
};
export const fixed = (f_d: number, zeta: number): Estimator => () => [f_d, zeta];

/** Mass matrix [M11, M12, M22] and bias of two links about vertical axes. */
function dynamics({ middle, change, forearm }: ArmParameters, q: number[], qd: number[]): { M: [number, number, number]; bias: Pair } {
  const c = (change / 2) * Math.cos(q[1]), s = (change / 2) * Math.sin(q[1]);
  return {
    M: [middle + 2 * c, forearm + c, forearm],
    bias: [-s * (2 * qd[0] * qd[1] + qd[1] * qd[1]), s * qd[0] * qd[0]],
  };
}

/** Commands of the drives [q_r, q̇_r, τ_ff] for a shaped reference: central differences, a tick later, and inverse dynamics. */
function* commands(arm: ArmParameters, start: number[], shaped: Iterable<number[]>): Generator<[Pair, Pair, Pair]> {
  const h = arm.period;
  let before = start, middle = start;
  for (const last of shaped) {
    const qd = middle.map((one, j) => (last[j] - one + (one - before[j])) / (2 * h)) as Pair;
    const qdd = middle.map((one, j) => (last[j] - one - (one - before[j])) / (h * h)) as Pair;
    const { M, bias } = dynamics(arm, middle, qd);
    const torque = [M[0] * qdd[0] + M[1] * qdd[1] + bias[0], M[1] * qdd[0] + M[2] * qdd[1] + bias[1]];
    const feed = torque.map((one, j) => one + arm.rotor_inertia[j] * qdd[j]
      + arm.friction_feedforward * arm.coulomb_friction[j] * Math.tanh(qd[j] / arm.friction_feedforward_width)) as Pair;
    yield [[...middle] as Pair, qd, feed];
    [before, middle] = [middle, last];
  }
}

/** State of the simulated arm, and one control period of it. */
class Plant {
  /** Angles of two links, then of two motors, their velocities, mean accelerations; the drives' integrators. */
  readonly y: number[];
  private readonly v = [0, 0, 0, 0];
  private readonly a = [0, 0, 0, 0];
  private readonly s = [0, 0];
  private readonly stiffness: number[];
  private readonly damping: number[];
  private readonly gains: { velocity: number; position: number; integral: number }[];
  private now: ReturnType<typeof dynamics>;
  private last: ReturnType<typeof dynamics>;
  private held: [Pair, Pair, Pair];

  constructor(private readonly arm: ArmParameters, start: number[]) {
    const { gear_stiffness: K, gear_damping: D, velocity_gain: K_d, position_gain: K_p, integral_gain: K_i } = arm;
    this.gains = [0, 1].map((j) => ({ velocity: K_d[j], position: K_d[j] * (K_p[j] + K_i[j]), integral: K_d[j] * K_p[j] * K_i[j] }));
    this.stiffness = [...K, ...K.map((one, j) => one + this.gains[j].position)];
    this.damping = [...D, ...D.map((one, j) => one + (K_d[j] + arm.coulomb_friction[j] / arm.friction_width))];
    this.y = [...start.map((one, j) => one + this.gearError(one, j)), ...start];
    this.now = this.last = dynamics(arm, this.y, this.v);
    this.held = [[start[0], start[1]], [0, 0], [0, 0]];
  }

  private gearError(motor: number, j: number): number {
    return this.arm.gear_error_amplitude * Math.sin(this.arm.gear_error_waves * motor + this.arm.gear_phase[j]);
  }

  step(command: [Pair, Pair, Pair]): void {
    const { arm, y, v, a, s, stiffness, damping, gains, now, last, held } = this, { substeps } = arm, h = arm.period / substeps;
    const { rotor_inertia: B, gear_stiffness: K, gear_damping: D } = arm;
    const c = [0, 1].map((j) => -0.5 * h * D[j] - 0.25 * h * h * K[j]);
    const own = [0, 1].map((j) => B[j] + (0.5 * h * damping[2 + j] + 0.25 * h * h * stiffness[2 + j]) + 0.125 * h * h * h * gains[j].integral);
    const M = now.M.map((one, k) => 1.5 * one - 0.5 * last.M[k]);
    const [S00, S01, S11] = [M[0], M[1], M[2]].map((one, k) => {
      if (k === 1) return one;
      const j = k === 0 ? 0 : 1;
      return one + 0.5 * h * damping[j] + 0.25 * h * h * stiffness[j] - (c[j] * c[j]) / own[j];
    });
    const f = [0, 0, 0, 0];
    for (let step = 0; step < substeps; step++) {
      const share = (step + 0.5) / substeps;
      const at = (row: number, j: number): number => held[row][j] + share * (command[row][j] - held[row][j]);
      for (let j = 0; j < 2; j++) {
        const m = 2 + j, speed = v[m] + 0.5 * h * a[m], angle = y[m] + 0.5 * h * speed, steep = speed / arm.friction_width;
        const slack = arm.coulomb_friction[j] * (steep - Math.tanh(steep)), wave = K[j] * this.gearError(angle, j);
        f[m] = at(2, j) + gains[j].velocity * at(1, j) + gains[j].position * at(0, j) + slack - wave;
        f[m] += gains[j].integral * (s[j] + 0.5 * h * at(0, j));
        f[j] = -now.bias[j] - share * (now.bias[j] - last.bias[j]) + wave;
      }
      for (let i = 0; i < 4; i++) a[i] = f[i] - damping[i] * v[i] - stiffness[i] * (y[i] + 0.5 * h * v[i]);
      for (let j = 0; j < 2; j++) {
        const m = 2 + j, motor = y[m] + 0.5 * h * v[m], link = y[j] + 0.5 * h * v[j];
        a[j] += D[j] * v[m] + K[j] * motor;
        a[m] += D[j] * v[j] + K[j] * link - 0.5 * h * gains[j].integral * motor;
        a[j] -= (c[j] / own[j]) * a[m];
      }
      const det = S00 * S11 - S01 * S01;
      [a[0], a[1]] = [(S11 * a[0] - S01 * a[1]) / det, (S00 * a[1] - S01 * a[0]) / det];
      for (let j = 0; j < 2; j++) {
        const m = 2 + j;
        a[m] = (a[m] - c[j] * a[j]) / own[j];
        s[j] += h * (at(0, j) - (y[m] + 0.5 * h * (v[m] + 0.5 * h * a[m])));
      }
      for (let i = 0; i < 4; i++) {
        y[i] += h * (v[i] + 0.5 * h * a[i]);
        v[i] += h * a[i];
      }
    }
    this.held = command;
    this.last = now;
    this.now = dynamics(arm, y, v);
  }
}

export interface ArmRun {
  /** Unshaped reference, motors and links at each tick: [shoulder, elbow] [rad]. */
  reference: number[][];
  motor: number[][];
  link: number[][];
  /** Tick at which the motors' reference reaches its end. */
  stopped: number;
}

/** One motion of the arm, as the packages simulate it; `shaper` null: unshaped. */
export function run(arm: ArmParameters, start: number[], target: number[], shaper: Shaper | null, estimator: Estimator, after = AFTER): ArmRun {
  const way = pointToPoint(start, target, arm.limits, arm.period);
  const filter = shaper && new Filter(shaper, estimator, start, arm.period);
  const shaped: number[][] = [];
  const reference: number[][] = [];
  let still = 0;
  for (let tick = 0; still < after; tick++) {
    const sample = tick < RESTING ? start : way[Math.min(tick - RESTING, way.length - 1)];
    const out = filter && tick >= RESTING ? filter.filter(sample) : [...sample];
    const ended = tick >= RESTING + way.length - 1 && out.every((one, j) => Math.abs(one - target[j]) < 1e-12);
    still = ended ? still + 1 : 0;
    shaped.push(out);
    reference.push(sample);
    if (tick > 5000) throw new RangeError("the shaped motion does not end");
  }
  const plant = new Plant(arm, start), motor: number[][] = [], link: number[][] = [];
  for (const command of commands(arm, start, shaped)) {
    plant.step(command);
    link.push(plant.y.slice(0, 2));
    motor.push(plant.y.slice(2, 4));
  }
  return { reference, motor, link, stopped: shaped.length - after + 1 };
}

/** Largest twist of the shoulder's spring after the stop [rad]. */
export function left({ motor, link, stopped }: ArmRun): number {
  let most = 0;
  for (let i = stopped; i < link.length; i++) most = Math.max(most, Math.abs(link[i][0] - motor[i][0]));
  return most;
}
