// The arm as a chain of frames: the base, then for each joint the near and the far end of its link.
// Both are the link's own frame; only the far one moves with the link's bending.
import { Matrix4, Vector3 } from "three";

export const placed = (matrix) => new Vector3().setFromMatrixPosition(matrix);

/** A URDF's origin: rotation about x, y, z in turn (roll, pitch, yaw), and translation. */
export function origin([x, y, z, roll, pitch, yaw]) {
  return new Matrix4().makeTranslation(x, y, z)
    .multiply(new Matrix4().makeRotationZ(yaw)).multiply(new Matrix4().makeRotationY(pitch))
    .multiply(new Matrix4().makeRotationX(roll));
}

export class Chain {
  /** @param geometry From `info`: Denavit-Hartenberg lists a, d, alpha, or one placement for each joint. */
  constructor({ a, d, alpha, placement = [], bending }) {
    // Frame of each link in that of its joint.
    this.links = placement.length
      ? placement.map(origin)
      : a.map((length, i) => new Matrix4().makeTranslation(length, 0, d[i]).multiply(new Matrix4().makeRotationX(alpha[i])));
    this.joints = this.links.length;
    this.bending = bending;
    this.middles = this.links.map((link, i) =>
      placement.length ? new Matrix4().makeTranslation(placed(link).multiplyScalar(0.5)) : new Matrix4().makeTranslation(a[i] / 2, 0, d[i]));
  }

  /** Frames at joint angles and with link deflections, two for each bending link, about y and z [rad]. */
  frames(q, bends) {
    const out = [new Matrix4()];
    let at = new Matrix4();
    for (let joint = 0; joint < this.joints; joint++) {
      at = at.clone().multiply(new Matrix4().makeRotationZ(q[joint]));
      out.push(at.clone().multiply(this.links[joint]));
      const place = this.bending.indexOf(joint);
      if (place >= 0 && bends.length) {
        at.multiply(this.middles[joint])
          .multiply(new Matrix4().makeRotationY(bends[2 * place]))
          .multiply(new Matrix4().makeRotationZ(bends[2 * place + 1]))
          .multiply(this.middles[joint].clone().invert());
      }
      at.multiply(this.links[joint]);
      out.push(at.clone());
    }
    return out;
  }

  /** A line in a link's frame, split in the middle if the link bends: [{ frame, from, to }]. */
  cut(link, start, end) {
    const near = 1 + 2 * link, far = 2 + 2 * link;
    if (!this.bending.includes(link)) return [{ frame: far, from: start, to: end }];
    const down = this.links[link].clone().invert(), middle = placed(this.middles[link]).applyMatrix4(down);
    const way = placed(down).sub(middle).normalize();
    const side = (point) => point.clone().sub(middle).dot(way); // positive on the joint's side
    const [first, last] = side(start) >= side(end) ? [start, end] : [end, start];
    if (!(side(first) > 0 && side(last) < 0)) return [{ frame: side(last) >= 0 ? near : far, from: first, to: last }];
    const cut = first.clone().lerp(last, side(first) / (side(first) - side(last)));
    return [{ frame: near, from: first, to: cut }, { frame: far, from: cut, to: last }];
  }

  /** Sum of the links' lengths [m]. */
  reach() {
    return this.links.reduce((sum, link) => sum + placed(link).length(), 0);
  }
}
