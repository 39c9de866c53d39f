// The stage: a lit ground with a horizon, a camera that fits the arms, and drawing only after changes.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const THEMES = {
  light: { sky: ["#b9cbdc", "#f3f6f9"], ground: "#e3e8ed", minor: 0xcfd6dd, major: 0xb4bec8 },
  dark: { sky: ["#05070a", "#20272e"], ground: "#1a2026", minor: 0x29313a, major: 0x3a4550 },
};
const FOV = 32; // of the camera, upright [deg]
const FILLED = 0.86, LEAST = 0.5, EASE = 4; // share of the picture that the arms fill; below LEAST the camera moves closer
const VIEWS = { front: [1, 0, 0.12], side: [0, -1, 0.12], top: [0.001, 0, 1] };

export class Scene {
  constructor(canvas, { theme = "light", shadows = true } = {}) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.shadowMap.enabled = shadows;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FOV, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    this.direction = null; // from the target to the camera; null: the arm's default
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.addEventListener("change", () => this.invalidate());
    this.orbit.addEventListener("start", () => (this.free = true)); // after the user has turned the camera, it stays
    this.arms = [];
    this.free = false;
    this._light();
    this.setTheme(theme);
    this._slow = 0;
  }

  _light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xc4ccd2, 2.2));
    this.sun = new THREE.DirectionalLight(0xfffaf2, 1.9);
    this.sun.position.set(1.6, -2.2, 3.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow.camera, { left: -2.2, right: 2.2, top: 2.2, bottom: -2.2, near: 0.5, far: 9 });
    this.sun.shadow.bias = -0.0006;
    this.sun.shadow.radius = 4;
    this.scene.add(this.sun, this.sun.target);
    const rim = new THREE.DirectionalLight(0xdfe9ff, 0.7);
    rim.position.set(-2, 2, 1.5);
    this.scene.add(rim);
  }

  setTheme(theme) {
    const { sky, ground, minor, major } = THEMES[theme];
    this.ground?.removeFromParent();
    this.ground = new THREE.Group();
    const floor = new THREE.Mesh(new THREE.CircleGeometry(30, 48), new THREE.MeshLambertMaterial({ color: ground }));
    floor.receiveShadow = true;
    floor.position.z = -0.002;
    const lines = (size, step, colour) => {
      const grid = new THREE.GridHelper(size, Math.round(size / step), colour, colour);
      grid.rotateX(Math.PI / 2);
      return grid;
    };
    this.ground.add(floor, lines(8, 0.25, minor), lines(8, 1, major));
    this.scene.add(this.ground);
    // A dome whose colour at the horizon is that of the fog that hides the edge of the ground.
    const dome = new THREE.SphereGeometry(40, 16, 24), [high, low] = sky.map((one) => new THREE.Color(one));
    const { position } = dome.attributes;
    const shades = Array.from({ length: position.count }, (_, i) => low.clone().lerp(high, Math.max(0, position.getY(i) / 40) ** 0.7).toArray());
    dome.setAttribute("color", new THREE.Float32BufferAttribute(shades.flat(), 3));
    dome.rotateX(Math.PI / 2);
    this.ground.add(new THREE.Mesh(dome, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.BackSide, fog: false })));
    this.scene.fog = new THREE.Fog(sky[1], 4, 14);
    this.invalidate();
  }

  add(arm) {
    this.arms.push(arm);
    arm.changed = () => this.invalidate();
    this.scene.add(arm.root);
  }

  clear() {
    for (const arm of this.arms) arm.dispose();
    this.arms = [];
    this.free = false;
    this.fitted = null;
  }

  resize(width, height, ratio = Math.min(devicePixelRatio, 2)) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.free) this.fitted = null;
    this.invalidate();
  }

  /** Look from a side, by its name; "reset" restores the initial view. */
  look(view) {
    this.direction = VIEWS[view] ? new THREE.Vector3(...VIEWS[view]).normalize() : null;
    this.free = false;
    this.fitted = null;
    this.invalidate();
  }

  /** Set points that the camera has to see; without any, it fits the present arms. */
  keep(points) {
    this.kept = points;
    this.fitted = null;
  }

  invalidate() {
    this.stale = true;
  }

  /** Camera { target, position } with which the arms fill the picture. */
  _fit(points) {
    const back = this.direction ?? this._ownDirection(points);
    const right = new THREE.Vector3(-back.y, back.x, 0).normalize();
    const up = back.clone().cross(right).normalize();
    const [x, y, z] = [right, up, back].map((axis) => points.map((point) => point.dot(axis)));
    const span = (values) => [Math.min(...values), Math.max(...values)];
    const tall = Math.tan((FOV * Math.PI) / 360) * FILLED, wide = tall * this.camera.aspect;
    let [[x0, x1], [y0, y1]] = [span(x), span(y)];
    const [z0, z1] = span(z);
    let [cx, cy, distance] = [(x0 + x1) / 2, (y0 + y1) / 2, 0];
    for (let round = 0; round < 4; round++) { // near parts look larger, so the middle moves
      distance = Math.max(...points.map((_, i) => Math.max(Math.abs(x[i] - cx) / wide, Math.abs(y[i] - cy) / tall) + z[i]));
      const seen = points.map((_, i) => [(x[i] - cx) / (distance - z[i]), (y[i] - cy) / (distance - z[i])]);
      const [[l, r], [b, t]] = [span(seen.map(([h]) => h)), span(seen.map(([, v]) => v))];
      cx += ((l + r) / 2) * (distance - (z0 + z1) / 2);
      cy += ((b + t) / 2) * (distance - (z0 + z1) / 2);
    }
    const middle = (z0 + z1) / 2;
    const target = right.clone().multiplyScalar(cx).addScaledVector(up, cy).addScaledVector(back, middle);
    return { target, position: target.clone().addScaledVector(back, distance - middle) };
  }

  /** A view along the arm, slightly from its side and above; more so in a narrow window. */
  _ownDirection(points) {
    if (!this.own) {
      const far = points.reduce((best, point) => (Math.hypot(point.x, point.y) > Math.hypot(best.x, best.y) ? point : best));
      const narrow = this.camera.aspect < 1.1;
      const bearing = this.kept ? -0.42 : Math.atan2(far.y, far.x) - (narrow ? 0.5 : 0.85);
      const rise = narrow ? 0.5 : this.kept ? 0.28 : 0.36;
      this.own = new THREE.Vector3(Math.cos(bearing) * Math.cos(rise), Math.sin(bearing) * Math.cos(rise), Math.sin(rise));
    }
    return this.own.clone();
  }

  /** Shares of the picture's width and height that the arms fill. */
  filled() {
    const points = this.arms.filter((arm) => arm.root.visible && !arm.ghost).flatMap((arm) => arm.outline());
    if (!points.length) return null;
    const seen = points.map((point) => point.clone().project(this.camera));
    const span = (key) => [Math.min(...seen.map((one) => one[key])), Math.max(...seen.map((one) => one[key]))];
    return { x: span("x"), y: span("y") };
  }

  _aim(seconds) {
    if (this.free) return;
    const points = this.kept ?? this.arms.filter((arm) => arm.root.visible).flatMap((arm) => arm.outline());
    if (!points.length) return;
    if (!this.fitted) {
      const { target, position } = this._fit(points);
      this.orbit.target.copy(target);
      this.camera.position.copy(position);
      this.fitted = true;
    } else if (!this.kept) {
      const { x, y } = this.filled() ?? { x: [-1, 1], y: [-1, 1] };
      const leaves = Math.max(-x[0], x[1], -y[0], y[1]) > 0.96, small = x[1] - x[0] < 2 * LEAST && y[1] - y[0] < 2 * LEAST;
      if (leaves || small) this.easing = true;
      if (!this.easing) return;
      const { target, position } = this._fit(points), share = 1 - Math.exp(-EASE * seconds);
      if (position.distanceTo(this.camera.position) < 0.02) this.easing = false;
      this.orbit.target.lerp(target, share);
      this.camera.position.lerp(position, share);
      this.invalidate();
    }
    this.camera.lookAt(this.orbit.target);
    this.camera.updateMatrixWorld();
  }

  /** Draw if anything has changed. After a few slow frames, as without a graphics processor, shadows are off. */
  draw(seconds = 1 / 30) {
    if (!this.stale && !this.easing) return false;
    this.stale = false;
    this._aim(seconds);
    const begun = performance.now();
    this.renderer.render(this.scene, this.camera);
    if (this.sparing && this.renderer.shadowMap.enabled) {
      this._slow = performance.now() - begun > 25 ? this._slow + 1 : 0;
      if (this._slow > 5) {
        this.renderer.shadowMap.enabled = false;
        this.sun.castShadow = false;
        this.renderer.setPixelRatio(1);
      }
    }
    return true;
  }
}
