// One arm, drawn from its kinematics: tubes, T-shaped joint housings, caps and a base plate, or a URDF's own meshes.
import * as THREE from "three";
import { Chain, placed } from "./chain.js";
import { loadMeshes } from "./meshes.js";

const BODY = 0xe9edf0, JOINT = 0xd3d9de, RING = 0x4a545d, CAP = 0x5a9bd4, PLATE = 0xaab2b9, LOAD = 0x7d8790;
const AROUND = 28; // facets of a solid of revolution
const SLIM = 0.86; // radius of a tube over that of its capsule, which contains it [-]
const GHOST_OPACITY = 0.22;
const Z = new THREE.Vector3(0, 0, 1);

/** Profile [r, z] of a cylinder between two heights, with rounded edges. */
function rounded(radius, low, high, edge = 0.18 * radius) {
  const e = Math.min(edge, (high - low) / 2);
  const arc = (z, from) =>
    [0, 1, 2, 3].map((k) => {
      const angle = from + (k * Math.PI) / 6;
      return [radius - e + e * Math.cos(angle), z + e * Math.sin(angle)];
    });
  return [[0, low], ...arc(low + e, -Math.PI / 2), ...arc(high - e, 0), [0, high]];
}

/** Solid of revolution about the line from a point along a direction. */
function turned(profile, origin, direction) {
  const shape = new THREE.LatheGeometry(profile.map(([r, z]) => new THREE.Vector2(Math.max(r, 0), z)), AROUND);
  shape.rotateX(Math.PI / 2); // a lathe turns about y
  shape.applyQuaternion(new THREE.Quaternion().setFromUnitVectors(Z, direction));
  shape.translate(origin.x, origin.y, origin.z);
  return shape;
}

/** Extent [low, high] of a link's capsule on a joint's axis, and whether it is parallel to the axis. */
function onAxis(start, end, radius) {
  const way = end.clone().sub(start), length = way.length();
  if (length > 0 && Math.abs(way.z) > 0.9 * length) {
    const [low, high] = start.z < end.z ? [start.z, end.z] : [end.z, start.z];
    return { low, high, along: true, radius };
  }
  const flat = way.x * way.x + way.y * way.y;
  const share = flat > 0 ? Math.min(1, Math.max(0, -(start.x * way.x + start.y * way.y) / flat)) : 0;
  const z = start.z + share * way.z;
  return { low: z, high: z, along: false, radius };
}

/** Solids of an arm: { frame, shape, colour }, each in the frame that carries it. */
export function solids(geometry, chain) {
  const found = [];
  const add = (frame, profile, origin, direction, colour) =>
    found.push({ frame, shape: turned(profile, origin, direction), colour });
  const capsules = capsulesOf(geometry, chain);
  for (const [link, capsule] of capsules) {
    const { start, end, radius } = capsule;
    if (link < 0) {
      add(0, rounded(1.28 * radius, 0, 0.3 * radius, 0.06 * radius), new THREE.Vector3(start.x, start.y, 0), Z, PLATE);
      continue;
    }
    const up = chain.links[link]; // from the link's frame to that of its joint
    if (onAxis(start.clone().applyMatrix4(up), end.clone().applyMatrix4(up), radius).along) continue;
    const cut = chain.cut(link, start, end);
    for (const { frame, from, to } of cut) {
      const way = to.clone().sub(from), length = way.length();
      if (length > 0) add(frame, rounded(SLIM * radius, 0, length, 0), from, way.normalize(), BODY);
    }
  }
  for (let joint = 0; joint < chain.joints; joint++) {
    const before = capsules.get(joint - 1), own = capsules.get(joint);
    if (!own) continue;
    const up = chain.links[joint], down = up.clone().invert();
    const here = onAxis(own.start.clone().applyMatrix4(up), own.end.clone().applyMatrix4(up), own.radius);
    const there = before
      ? onAxis(before.start, before.end, before.radius)
      : { low: 0, high: 0, along: true, radius: own.radius };
    const sign = here.low + here.high >= there.low + there.high ? 1 : -1;
    // Heights along the joint's axis, counted in the direction from the link before to this one.
    const [a, b] = [there, here].map((one) => (sign > 0 ? [one.low, one.high] : [-one.high, -one.low]));
    const top = there.along ? a[1] : a[1] + there.radius, bottom = here.along ? b[0] : b[0] - here.radius;
    const middle = Math.min(Math.max((top + bottom) / 2, a[0] + 0.2 * there.radius), Math.max(b[1], a[0] + 0.4 * there.radius));
    const last = joint === chain.joints - 1;
    const low = joint === 0 ? Math.min(a[0], middle) : a[0] - (there.along ? 0.35 : 1.12) * there.radius;
    const high = last && here.along ? b[1] + 0.25 * here.radius : b[1] + (here.along ? 0.45 : 1.12) * here.radius;
    const axis = new THREE.Vector3(0, 0, sign), origin = new THREE.Vector3();
    const far = 2 * joint; // the frame that carries the link before: that of its far end, or the base
    add(far, rounded(there.radius, low, middle), origin, axis, JOINT);
    if (joint > 0) add(far, capProfile(there.radius, low, -1), origin, axis, CAP);
    const ring = 0.09 * own.radius;
    add(far, rounded(0.93 * Math.min(there.radius, own.radius) + 0.04 * own.radius, middle - ring, middle + ring, 0), origin, axis, RING);
    // The housing of this link turns with it: in its near frame, the joint's axis is at the start of the link.
    const base = new THREE.Vector3().applyMatrix4(down), direction = axis.clone().transformDirection(down);
    add(1 + 2 * joint, rounded(own.radius, middle, high), base, direction, JOINT);
    if (!last) add(1 + 2 * joint, capProfile(own.radius, high, 1), base, direction, CAP);
  }
  return found;
}

function capProfile(radius, at, sign) {
  const thick = 0.16 * radius;
  return sign > 0 ? rounded(0.9 * radius, at - 0.02 * radius, at + thick) : rounded(0.9 * radius, at - thick, at + 0.02 * radius);
}

/** Each link's capsule by its number; -1 is the base. An arm without any gets some that fit its reach. */
function capsulesOf(geometry, chain) {
  const found = new Map();
  for (const one of geometry.capsules) {
    if (!found.has(one.link)) {
      found.set(one.link, { start: new THREE.Vector3(...one.start), end: new THREE.Vector3(...one.end), radius: one.radius });
    }
  }
  if (found.size) return found;
  const reach = chain.reach();
  for (let link = 0; link < chain.joints; link++) {
    const start = placed(chain.links[link].clone().invert());
    const radius = reach * (0.058 - (0.026 * link) / chain.joints);
    if (start.length() > 0.2 * radius) found.set(link, { start, end: new THREE.Vector3(), radius });
  }
  found.set(-1, { start: new THREE.Vector3(), end: new THREE.Vector3(0, 0, 0.06 * reach), radius: 0.062 * reach });
  return found;
}

export class Arm {
  /** @param look { geometry, payload: {mass, com}, meshes: [url] }; @param options { at, colour, ghost } */
  constructor(look, { at = [0, 0, 0], colour = CAP, ghost = false } = {}) {
    this.chain = new Chain(look.geometry);
    this.root = new THREE.Group();
    this.root.position.set(...at);
    this.frames = Array.from({ length: 1 + 2 * this.chain.joints }, () => new THREE.Group());
    for (const frame of this.frames) {
      frame.matrixAutoUpdate = false;
      this.root.add(frame);
    }
    this.ghost = ghost;
    this.materials = new Map();
    this.parts = new THREE.Group();
    const shown = solids(look.geometry, this.chain);
    for (const { frame, shape, colour: own } of shown) this._add(frame, shape, own === CAP ? colour : own);
    const { mass, com } = look.payload;
    if (mass > 0 && Math.hypot(...com) > 0) {
      const way = new THREE.Vector3(...com), height = 2 * way.length();
      const disc = turned(rounded(look.geometry.payload_radius, 0, height, 0.004), new THREE.Vector3(), way.normalize());
      this._add(2 * this.chain.joints, disc, LOAD);
    }
    if (look.meshes?.length) {
      loadMeshes(look, (link, shape) => this._add(link < 0 ? 0 : 2 + 2 * link, shape, BODY, true), () => this._swap());
    }
    this.pose(new Array(this.chain.joints).fill(0), []);
  }

  _add(frame, shape, colour, mesh = false) {
    if (!this.materials.has(colour)) {
      this.materials.set(colour, new THREE.MeshPhongMaterial(
        this.ghost
          ? { color: 0x7a828a, transparent: true, opacity: GHOST_OPACITY, depthWrite: false }
          : { color: colour, shininess: 60, specular: 0x333333, side: mesh ? THREE.DoubleSide : THREE.FrontSide },
      ));
    }
    const part = new THREE.Mesh(shape, this.materials.get(colour));
    part.castShadow = !this.ghost;
    part.receiveShadow = false;
    part.userData.mesh = mesh;
    this.frames[frame].add(part);
  }

  /** Replace the solids, except the payload, by the URDF's meshes when all have been loaded. */
  _swap() {
    for (const frame of this.frames) for (const part of [...frame.children]) {
      if (!part.userData.mesh && part.material !== this.materials.get(LOAD)) frame.remove(part);
    }
    this.changed?.();
  }

  /** Set joint angles and link deflections [rad]; returns the flange's position in the scene. */
  pose(q, bends) {
    const poses = this.chain.frames(q, bends);
    this.frames.forEach((frame, number) => {
      frame.matrix.copy(poses[number]);
      frame.matrixWorldNeedsUpdate = true;
    });
    return placed(poses.at(-1)).add(this.root.position);
  }

  /** Points on its outline, to fit the camera. */
  outline(q = null, bends = []) {
    const poses = q ? this.chain.frames(q, bends) : this.frames.map((frame) => frame.matrix);
    const found = [];
    this.frames.forEach((frame, number) => {
      for (const part of frame.children) {
        if (!part.geometry.boundingBox) part.geometry.computeBoundingBox();
        const { min, max } = part.geometry.boundingBox;
        for (let corner = 0; corner < 8; corner++) {
          found.push(new THREE.Vector3(corner & 1 ? min.x : max.x, corner & 2 ? min.y : max.y, corner & 4 ? min.z : max.z)
            .applyMatrix4(poses[number]).add(this.root.position));
        }
      }
    });
    return found;
  }

  dispose() {
    this.root.removeFromParent();
    this.root.traverse((one) => one.geometry?.dispose());
    for (const material of this.materials.values()) material.dispose();
  }
}
