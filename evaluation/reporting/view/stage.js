"use strict";
/* A motion base in its hall, drawn by three.js. Lengths in meters, x forward, y right, z down, as in Python. */

const STAGE = {
  background: "#e6ebf0", floor: "#dde3ea", line: "#8d9aa8", travel: "#c2513f", car: "#1a1a1a", rod: "#e8ecf1",
  arrow: 0.32, // m for 1 m/s^2
  highest: 4, // times the length of an arrow of 1 g is not exceeded
  crease: 0.78, // cosine of the angle from which on an edge is sharp
};

class Stage {
  /**
   * @param {HTMLElement} holder What the picture fills.
   * @param {object} scene Of `scene_of`.
   * @param {string} color Of the simulator's cue.
   */
  constructor(holder, scene, color) {
    this.scene = scene;
    this.holder = holder;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.canvas = this.renderer.domElement;
    holder.prepend(this.canvas);
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.08, 400);
    this.camera.up.set(0, 0, -1);
    this.mode = "outside";
    this.world = new THREE.Scene();
    this.world.background = new THREE.Color(STAGE.background);
    this.hall();
    this.machine();
    this.simulated = this.arrow(color, 1.0);
    this.reference = this.arrow(STAGE.car, 0.62);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    // The wheel scrolls the page; with Ctrl, and between two fingers, it zooms.
    this.controls.enableZoom = false;
    this.controls.maxPolarAngle = 0.497 * Math.PI;
    this.canvas.addEventListener("wheel", (event) => {
      if (!(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      this.zoom(Math.exp(0.004 * event.deltaY));
    }, { passive: false });
    this.lengths = new Float64Array(6);
    this.use = new Float64Array(6);
    this.pose([0, 0, 0, 0, 0, 0, 0, 0, 0]);
    this.resize();
    this.reset();
    new ResizeObserver(() => { this.resize(); this.render(); }).observe(holder);
  }

  /* ---- what is there ---- */

  hall() {
    const { world, scene } = this, { floor, scale } = scene;
    const reach = this.reach = 9 * Math.max(scale, 0.35);
    world.fog = new THREE.Fog(STAGE.background, 2.6 * reach, 7 * reach);
    const plane = new THREE.Mesh(
      new THREE.PlaneGeometry(40 * reach, 40 * reach),
      new THREE.MeshStandardMaterial({ color: STAGE.floor, roughness: 1 }));
    plane.rotation.x = Math.PI; // It is seen from above, where z is negative.
    plane.position.z = floor + 0.002;
    plane.receiveShadow = true;
    world.add(plane);
    const spacing = scale > 0.6 ? 2 : 0.5, half = 60 * spacing / 2;
    const grid = new THREE.GridHelper(2 * half, 60, STAGE.line, STAGE.line);
    grid.rotation.x = Math.PI / 2;
    grid.position.z = floor;
    grid.material.transparent = true;
    grid.material.opacity = 0.45;
    world.add(grid);
    if (scene.carriage) this.travel(scene.carriage, floor);
    world.add(new THREE.HemisphereLight("#ffffff", "#b9c0c9", 1.75));
    const sun = this.sun = new THREE.DirectionalLight("#fff6e8", 2.4);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    sun.shadow.bias = -0.0006;
    sun.shadow.normalBias = 0.02;
    const side = 0.72 * reach;
    Object.assign(sun.shadow.camera, { left: -side, right: side, top: side, bottom: -side, near: 0.1, far: 4 * reach });
    sun.shadow.camera.up.set(0, 0, -1);
    world.add(sun, sun.target);
  }

  travel({ x, y }, floor) {
    const z = floor - 0.005;
    const at = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    const places = at.flatMap((a, i) => [...a, z, ...at[(i + 1) % 4], z]);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    const lines = new THREE.LineSegments(
      geometry, new THREE.LineDashedMaterial({ color: STAGE.travel, dashSize: 0.5, gapSize: 0.3 }));
    lines.computeLineDistances();
    this.world.add(lines);
  }

  machine() {
    const { meshes, legs, scale } = this.scene;
    const group = (parent, ...names) => {
      const one = new THREE.Group();
      for (const name of names) if (meshes[name]) this.mesh(one, name);
      parent.add(one);
      return one;
    };
    this.parts = {};
    group(this.world, "rails");
    this.bridge = group(this.world, "bridge");
    this.carriage = group(this.world, "carriage");
    this.platform = group(this.world, "platform");
    this.platform.rotation.order = "XYZ";
    this.turntable = group(
      this.platform, "turntable", "marks", "inside", "furniture", "driver", "shell", "tires");
    const tube = (radius, material) => {
      const geometry = new THREE.CylinderGeometry(radius, radius, 1, 24, 1, true);
      geometry.rotateX(Math.PI / 2);
      const one = new THREE.Mesh(geometry, material);
      one.castShadow = true;
      this.world.add(one);
      return one;
    };
    const metal = new THREE.MeshStandardMaterial({ color: STAGE.rod, roughness: 0.3 });
    const ball = new THREE.SphereGeometry(0.085 * scale, 20, 14);
    this.legs = legs.lower.map(() => {
      const joint = new THREE.Mesh(ball, new THREE.MeshStandardMaterial({ color: "#7d8896", roughness: 0.45 }));
      joint.castShadow = true;
      this.world.add(joint);
      return {
        barrel: tube(0.095 * scale, new THREE.MeshStandardMaterial({ color: "#40b0a0", roughness: 0.55 })),
        rod: tube(0.055 * scale, metal), joint,
      };
    });
  }

  /** The faces of a part, those of one look in one mesh; edges that are not sharp are shaded smoothly. */
  mesh(parent, name) {
    const { vertices, faces, look, looks } = this.scene.meshes[name];
    const at = (i) => new THREE.Vector3(vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]);
    const normals = [], around = new Map();
    for (let k = 0; k < look.length; k++) {
      const [a, b, c, d] = [0, 1, 2, 3].map((j) => at(faces[4 * k + j]));
      normals.push(c.sub(a).cross(d.sub(b)).normalize());
      for (let j = 0; j < 4; j++) {
        const corner = faces[4 * k + j];
        if (!around.has(corner)) around.set(corner, []);
        around.get(corner).push(k);
      }
    }
    looks.forEach((one, index) => {
      const places = [], directions = [];
      for (let k = 0; k < look.length; k++) {
        if (look[k] !== index) continue;
        for (const j of [0, 1, 2, 0, 2, 3]) {
          const corner = faces[4 * k + j], smooth = new THREE.Vector3();
          for (const other of around.get(corner)) {
            if (normals[other].dot(normals[k]) > STAGE.crease) smooth.add(normals[other]);
          }
          smooth.normalize();
          places.push(vertices[3 * corner], vertices[3 * corner + 1], vertices[3 * corner + 2]);
          directions.push(smooth.x, smooth.y, smooth.z);
        }
      }
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
      geometry.setAttribute("normal", new THREE.Float32BufferAttribute(directions, 3));
      const color = new THREE.Color().setRGB(...one.color.map((c) => c / 255), THREE.SRGBColorSpace);
      const solid = one.opacity > 0.99;
      const part = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({
        color, roughness: 0.95 - 0.6 * one.gloss, transparent: !solid, opacity: one.opacity, depthWrite: solid,
      }));
      part.castShadow = solid;
      part.receiveShadow = solid;
      parent.add(part);
      (this.parts[name] ||= []).push(part);
    });
  }

  /** An arrow from the driver's head, as long as a force. */
  arrow(color, width) {
    const material = new THREE.MeshBasicMaterial({ color, depthTest: false, transparent: true });
    const size = width * Math.max(this.scene.scale, 0.5);
    const shaft = new THREE.CylinderGeometry(0.05 * size, 0.05 * size, 1, 12).translate(0, 0.5, 0).rotateX(Math.PI / 2);
    const head = new THREE.ConeGeometry(0.15 * size, 0.32 * size, 20).translate(0, -0.16 * size, 0).rotateX(Math.PI / 2);
    const one = new THREE.Group();
    one.add(new THREE.Mesh(shaft, material), new THREE.Mesh(head, material));
    one.traverse((part) => { part.renderOrder = 10 + (width < 1 ? 1 : 0); });
    one.position.fromArray(this.scene.head);
    // Beside each other, not in each other.
    one.headLength = 0.32 * size;
    this.turntable.add(one);
    return one;
  }

  /* ---- what moves ---- */

  /** Carriage x, y; hexapod x, y, z, roll, pitch, yaw from neutral; turntable: m and rad. */
  pose(values) {
    const { legs, carriage } = this.scene;
    const [cx, cy, x, y, z, roll, pitch, yaw, turn] = values;
    this.follow(cx, cy);
    this.bridge.position.x = cx;
    this.carriage.position.set(cx, cy, 0);
    this.platform.position.set(cx + legs.neutral[0] + x, cy + legs.neutral[1] + y, legs.neutral[2] + z);
    this.platform.rotation.set(roll, pitch, yaw, "XYZ");
    this.turntable.rotation.z = turn;
    this.platform.updateMatrixWorld(true);
    const upper = new THREE.Vector3(), lower = new THREE.Vector3(), along = new THREE.Vector3();
    legs.lower.forEach((below, i) => {
      lower.set(below[0] + cx, below[1] + cy, below[2]);
      upper.fromArray(legs.upper[i]).applyMatrix4(this.platform.matrixWorld);
      along.subVectors(upper, lower);
      const length = this.lengths[i] = along.length(), extension = length - legs.lengths[i];
      const limit = extension >= 0 ? legs.extension[1] : -legs.extension[0];
      this.use[i] = limit > 0 ? extension / limit : 0;
      const { barrel, rod, joint } = this.legs[i], share = Math.min(legs.barrel / length, 1);
      this.between(barrel, lower, along, 0, share);
      this.between(rod, lower, along, share, 1);
      joint.position.copy(upper);
      barrel.material.color.setRGB(...this.color(this.use[i]).map((c) => c / 255), THREE.SRGBColorSpace);
    });
    if (carriage === null) this.place = [0, 0];
  }

  between(tube, lower, along, begin, end) {
    const length = along.length() * (end - begin);
    tube.scale.z = Math.max(length, 1e-4);
    tube.position.copy(lower).addScaledVector(along, 0.5 * (begin + end));
    tube.up.set(1, 0, 0);
    tube.lookAt(lower.x + 10 * along.x, lower.y + 10 * along.y, lower.z + 10 * along.z);
  }

  /** Color of a leg by the share of its travel in use, three numbers to 255. */
  color(use) {
    const { color } = this.scene.legs;
    return color[Math.round(Math.min(Math.abs(use), 1) * (color.length - 1))];
  }

  /** Specific force beyond that of standing, in the cab's axes, m/s^2. */
  cues(reference, simulated) {
    for (const [one, force] of [[this.reference, reference], [this.simulated, simulated]]) {
      const way = new THREE.Vector3(force[0], force[1], force[2] + 9.81);
      const most = STAGE.highest * 9.81, size = Math.min(way.length(), most);
      one.visible = size > 0.02;
      if (!one.visible) continue;
      const length = STAGE.arrow * size * Math.max(this.scene.scale, 0.5), [shaft, head] = one.children;
      const share = Math.min(1, length / (1.6 * one.headLength));
      head.scale.setScalar(share);
      head.position.z = length;
      shaft.scale.set(share, share, Math.max(length - share * one.headLength, 1e-4));
      one.up.set(0.3, 0.2, 1);
      one.updateWorldMatrix(true, false);
      // Group.lookAt works in the world's axes.
      const target = way.normalize().add(one.position);
      one.parent.localToWorld(target);
      one.lookAt(target);
    }
  }

  /* ---- the camera ---- */

  follow(cx, cy) {
    const [x, y] = this.place || [0, 0];
    this.place = [cx, cy];
    if (this.controls && this.mode !== "driver") {
      const dx = 0.93 * (cx - x), dy = 0.93 * (cy - y);
      for (const one of [this.camera.position, this.controls.target]) { one.x += dx; one.y += dy; }
    }
    const far = 1.6 * this.reach;
    this.sun.position.set(cx + 0.35 * far, cy - 0.5 * far, -0.95 * far);
    this.sun.target.position.set(cx, cy, 0);
  }

  /** The camera where it was at first: behind the machine, on its left. */
  reset() {
    const { floor, scale, legs, head } = this.scene, [cx, cy] = this.place;
    const top = legs.neutral[2] + head[2] - 0.9 * Math.max(scale, 0.5), tall = floor - top;
    const wide = Math.max(1, 1.25 / this.camera.aspect);
    const distance = wide * 1.24 * tall / (2 * Math.tan(Math.PI / 12)), azimuth = -2.34, elevation = 0.27;
    const target = [0.93 * cx, 0.93 * cy, floor - 0.5 * tall];
    this.controls.target.fromArray(target);
    this.camera.position.set(
      target[0] + distance * Math.cos(elevation) * Math.cos(azimuth),
      target[1] + distance * Math.cos(elevation) * Math.sin(azimuth),
      target[2] - distance * Math.sin(elevation));
    this.controls.update();
  }

  zoom(factor) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const length = Math.min(Math.max(offset.length() * factor, 0.25 * this.reach), 5 * this.reach);
    this.camera.position.copy(this.controls.target).addScaledVector(offset.normalize(), length);
    this.controls.update();
    this.onView?.();
  }

  turn(azimuth, elevation) {
    const { target } = this.controls, offset = this.camera.position.clone().sub(target);
    offset.applyAxisAngle(new THREE.Vector3(0, 0, 1), azimuth);
    const level = Math.hypot(offset.x, offset.y), length = offset.length();
    const angle = Math.min(Math.max(Math.atan2(-offset.z, level) + elevation, 0.02), 1.5);
    offset.set(offset.x / level * length * Math.cos(angle), offset.y / level * length * Math.cos(angle),
      -length * Math.sin(angle));
    this.camera.position.copy(target).add(offset);
    this.controls.update();
    this.onView?.();
  }

  /** `outside`, or `driver`: from the head, along the cab. */
  view(mode) {
    if (mode === this.mode) return;
    const before = this.mode;
    this.mode = mode;
    const driver = mode === "driver";
    this.controls.enabled = !driver;
    this.camera.fov = driver ? 68 : 30;
    for (const part of this.parts.driver || []) part.visible = !driver;
    this.resize();
    if (before === "driver") this.reset();
  }

  look() {
    if (this.mode !== "driver") return;
    const { head } = this.scene;
    const eye = this.turntable.localToWorld(new THREE.Vector3(head[0] + 0.1, head[1], head[2]));
    const ahead = this.turntable.localToWorld(new THREE.Vector3(head[0] + 10, head[1], head[2] + 0.9));
    const above = this.turntable.localToWorld(new THREE.Vector3(head[0] + 0.1, head[1], head[2] - 1));
    this.camera.position.copy(eye);
    this.camera.up.copy(above.sub(eye));
    this.camera.lookAt(ahead);
    this.camera.up.set(0, 0, -1);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  render() {
    this.look();
    // From the head the arrows would be in the eye.
    const ahead = this.mode === "driver" ? [1.6, 0, 0.1] : [0, 0, 0];
    for (const one of [this.simulated, this.reference]) {
      one.position.fromArray(this.scene.head.map((x, i) => x + ahead[i]));
      one.scale.setScalar(this.mode === "driver" ? 0.4 : 1);
    }
    this.renderer.render(this.world, this.camera);
  }

  dispose() {
    this.controls.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }
}
