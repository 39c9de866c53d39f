// The world around an arm as primitive shapes: movable bodies, and fixed objects.
import * as THREE from "three";

const Z_UP = Math.PI / 2; // the axis of cylinders and capsules is z in MuJoCo and y in three.js

/** Shape of a kind with MuJoCo's sizes; null if the kind is unknown. */
function shapeOf(kind, [a, b, c]) {
  switch (kind) {
    case "box": return new THREE.BoxGeometry(2 * a, 2 * b, 2 * c);
    case "sphere": return new THREE.SphereGeometry(a, 32, 20);
    case "ellipsoid": return new THREE.SphereGeometry(1, 32, 20).scale(a, b, c);
    case "cylinder": return new THREE.CylinderGeometry(a, a, 2 * b, 40).rotateX(Z_UP);
    case "capsule": return new THREE.CapsuleGeometry(a, 2 * b, 8, 28).rotateX(Z_UP);
    case "plane": return new THREE.PlaneGeometry(2 * a || 8, 2 * b || 8);
    default: return null;
  }
}

/** Place an object at x y z with a rotation vector. */
function put(object, [x, y, z, ...turn]) {
  const axis = new THREE.Vector3(...turn), angle = axis.length();
  object.position.set(x, y, z);
  object.quaternion.setFromAxisAngle(angle > 0 ? axis.divideScalar(angle) : new THREE.Vector3(0, 0, 1), angle);
}

export class Things {
  /** @param world { bodies: [name], shapes: [{ kind, size, pose, body, colour }] } */
  constructor(world, scene, at = [0, 0, 0]) {
    this.root = new THREE.Group();
    this.root.position.set(...at);
    this.bodies = world.bodies.map(() => new THREE.Group());
    for (const body of this.bodies) {
      body.visible = false; // until its pose is known
      this.root.add(body);
    }
    for (const { kind, size, pose, body, colour: [r, g, b, opacity] } of world.shapes) {
      const shape = shapeOf(kind, size);
      if (!shape) continue;
      const material = new THREE.MeshPhongMaterial({
        color: new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace), shininess: 30, specular: 0x222222,
        transparent: opacity < 1, opacity, side: kind === "plane" ? THREE.DoubleSide : THREE.FrontSide,
      });
      const part = new THREE.Mesh(shape, material);
      part.castShadow = opacity === 1 && kind !== "plane";
      part.receiveShadow = true;
      put(part, pose);
      (body === null ? this.root : this.bodies[body]).add(part);
    }
    scene.add(this.root);
  }

  /** Place the bodies, six numbers each; a body whose pose is unknown stays. */
  place(poses) {
    this.bodies.forEach((body, number) => {
      const pose = Array.from(poses.slice(6 * number, 6 * number + 6));
      if (pose.length < 6 || !pose.every(Number.isFinite)) return;
      body.visible = true;
      put(body, pose);
    });
  }

  remove() {
    this.root.removeFromParent();
    this.root.traverse((one) => {
      one.geometry?.dispose();
      one.material?.dispose();
    });
  }
}
