// A robot on the stage: the arm with magnified bending, the ghost at its reference, the trace of its tool.
import * as THREE from "three";
import { Arm } from "./arm.js";
import { Things } from "./things.js";

const TRACE = 120; // points
const JUMP = 0.15; // distance between two frames above which no trace is drawn [m]
const APART = 0.02; // angle between arm and ghost above which the ghost is drawn [rad]

export class Robot {
  /**
   * A moment, one row of numbers as the server tells it: motor angles, reference, static gear deflection, the rest of
   * the gear deflection, and both again for the links [rad]. Magnified by k, a deflection s + v is drawn as s + k v, or
   * with gravity as k (s + v).
   */
  static drawn(row, joints, links, { factor, gravity }) {
    const part = (from, count) => row.slice(from, from + count);
    const [motor, reference, rest, swing] = [0, 1, 2, 3].map((k) => part(k * joints, joints));
    const [linkRest, linkSwing] = [0, 1].map((k) => part(4 * joints + k * links, links));
    const large = (s, v) => (gravity ? factor * (s + v) : s + factor * v);
    return {
      q: Array.from(motor, (angle, i) => angle + large(rest[i], swing[i])),
      bends: Array.from(linkRest, (s, i) => large(s, linkSwing[i])),
      reference: Array.from(reference),
    };
  }

  constructor(scene, look, { at = [0, 0, 0], colour, trace = 0x4f93cf } = {}) {
    this.scene = scene;
    this.links = 2 * look.geometry.bending.length;
    this.arm = new Arm(look, colour ? { at, colour } : { at });
    this.ghost = new Arm(look, { at, ghost: true });
    this.things = look.geometry.world ? new Things(look.geometry.world, scene.scene, at) : null;
    this.points = [];
    this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour ?? trace }));
    this.line.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * TRACE), 3));
    this.line.frustumCulled = false;
    scene.scene.add(this.line);
    scene.add(this.arm);
    scene.add(this.ghost);
  }

  get joints() {
    return this.arm.chain.joints;
  }

  show(row, appearance) {
    // An arm at rest is not drawn again: without a graphics processor, drawing takes a whole core.
    const asked = JSON.stringify([Array.from(row), appearance]);
    if (asked === this.asked) return;
    this.asked = asked;
    const { q, bends, reference } = Robot.drawn(row, this.joints, this.links, appearance);
    const flange = this.arm.pose(q, bends);
    this.things?.place(row.slice(4 * this.joints + 2 * this.links));
    // If both coincide, their surfaces would flicker.
    const apart = Math.max(...q.map((angle, i) => Math.abs(angle - reference[i])), ...bends.map(Math.abs)) > APART;
    this.ghost.root.visible = appearance.ghost && apart;
    if (this.ghost.root.visible) this.ghost.pose(reference, []);
    this.line.visible = appearance.trace;
    const last = this.points.at(-1);
    if (last && last.distanceTo(flange) > JUMP) this.points = [];
    if (!last || last.distanceToSquared(flange) > 1e-8) {
      this.points.push(flange);
      if (this.points.length > TRACE) this.points.shift();
      const { array } = this.line.geometry.attributes.position;
      this.points.forEach((point, i) => point.toArray(array, 3 * i));
      this.line.geometry.setDrawRange(0, this.points.length);
      this.line.geometry.attributes.position.needsUpdate = true;
    }
    this.scene.invalidate();
  }

  forget() {
    this.asked = null;
    this.points = [];
    this.line.geometry.setDrawRange(0, 0);
  }

  remove() {
    for (const arm of [this.arm, this.ghost]) arm.dispose();
    this.things?.remove();
    this.line.removeFromParent();
    this.line.geometry.dispose();
    this.scene.arms = this.scene.arms.filter((arm) => arm !== this.arm && arm !== this.ghost);
  }
}
