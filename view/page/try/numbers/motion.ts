// A motion from rest to rest within limits of velocity, acceleration and jerk, all joints in phase.

export interface Limits {
  velocity: number;
  acceleration: number;
  jerk: number;
}

/** Position over time of the quickest motion over a distance [rad], and its duration [s] (Biagiotti and Melchiorri 2008, ch. 3.4). */
export function doubleS(way: number, { velocity, acceleration, jerk }: Limits): { duration: number; at: (time: number) => number } {
  // Times of a ramp of acceleration, of constant acceleration, and of constant velocity.
  let ramp = acceleration / jerk, flat = velocity / acceleration - ramp, cruise: number;
  if (flat < 0) [ramp, flat] = [Math.sqrt(velocity / jerk), 0];
  cruise = way / (jerk * ramp * (ramp + flat)) - (2 * ramp + flat);
  if (cruise < 0) {
    cruise = 0;
    ramp = acceleration / jerk;
    flat = (-3 * ramp + Math.sqrt(ramp * ramp + (4 * way) / acceleration)) / 2;
    if (flat < 0) [ramp, flat] = [Math.cbrt(way / (2 * jerk)), 0];
  }
  const phases: [number, number][] = [[ramp, jerk], [flat, 0], [ramp, -jerk], [cruise, 0], [ramp, -jerk], [flat, 0], [ramp, jerk]];
  const duration = phases.reduce((total, [time]) => total + time, 0);
  const at = (time: number): number => {
    if (time >= duration) return way;
    let [x, v, a, left] = [0, 0, 0, Math.max(time, 0)];
    for (const [lasts, j] of phases) {
      const t = Math.min(left, lasts);
      [x, v, a] = [x + t * (v + t * (a / 2 + (t * j) / 6)), v + t * (a + (t * j) / 2), a + t * j];
      left -= t;
      if (left <= 0) break;
    }
    return x;
  };
  return { duration, at };
}

/** Samples from the first one in motion to the one at the target [rad]. */
export function pointToPoint(start: number[], target: number[], limits: Limits, period: number): number[][] {
  const ways = target.map((one, k) => one - start[k]), longest = Math.max(...ways.map(Math.abs));
  if (!(longest > 0)) return [[...target]];
  const { duration, at } = doubleS(longest, limits);
  const samples: number[][] = [];
  for (let tick = 1; tick * period < duration; tick++) {
    const share = at(tick * period) / longest;
    samples.push(start.map((one, k) => one + share * ways[k]));
  }
  samples.push([...target]);
  return samples;
}
