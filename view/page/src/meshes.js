// A URDF's own meshes, from the page's server.
import * as THREE from "three";
import { ColladaLoader } from "three/examples/jsm/loaders/ColladaLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { origin } from "./chain.js";

/** Merge a loaded scene into one geometry. */
function flattened(root) {
  root.updateMatrixWorld(true);
  const shapes = [];
  root.traverse((one) => {
    if (!one.isMesh) return;
    const shape = one.geometry.index ? one.geometry.toNonIndexed() : one.geometry.clone();
    const plain = new THREE.BufferGeometry();
    plain.setAttribute("position", shape.attributes.position);
    plain.applyMatrix4(one.matrixWorld);
    shapes.push(plain);
  });
  return mergeGeometries(shapes);
}

const read = {
  stl: (data) => new STLLoader().parse(data),
  obj: (data) => flattened(new OBJLoader().parse(new TextDecoder().decode(data))),
  // A Collada file names its upward axis, but a URDF takes its coordinates unrotated, in the file's unit.
  dae: (data) => {
    const { scene } = new ColladaLoader().parse(new TextDecoder().decode(data), "");
    scene.rotation.set(0, 0, 0);
    return flattened(scene);
  },
};

/** Load a robot's meshes: `found(link, shape)` for each, `done()` after all. If one is damaged, the solids stay. */
export async function loadMeshes(look, found, done) {
  try {
    const all = await Promise.all(look.geometry.meshes.map(async (mesh, number) => {
      const bytes = await (await fetch(look.meshes[number])).arrayBuffer();
      const shape = read[look.meshes[number].split(".").pop()](bytes);
      shape.scale(...mesh.scale);
      shape.applyMatrix4(origin(mesh.placement));
      shape.computeVertexNormals();
      return [mesh.link, shape];
    }));
    for (const [link, shape] of all) found(link, shape);
    done();
  } catch (error) {
    console.warn(`a mesh of the robot cannot be drawn: ${error}`);
  }
}
