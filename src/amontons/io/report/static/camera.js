// Where a pane is seen from: a parallel camera, turned by the mouse, by touch and by keys.

class Eye {
  /** box: what is to be seen; from: direction to the eye; up: what is up; room: around it, a factor. */
  constructor(box, from, up, room) {
    const centre = box.getCenter(new THREE.Vector3());
    this.home = { box, centre, radius: 0.5 * box.getSize(new THREE.Vector3()).length() || 1, from, room };
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);
    this.camera.up.copy(up);
    this.target = new THREE.Vector3();
    this.reset();
  }

  /** Back to the beginning, or to another direction. */
  reset(from = this.home.from) {
    const { centre, radius } = this.home;
    this.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(from.clone().normalize(), 6 * radius);
    this.camera.near = 0.01 * radius;
    this.camera.far = 12 * radius;
    this.camera.zoom = 1;
    this.camera.lookAt(centre);
    this.camera.updateMatrixWorld();
    this.half = this.extent();
  }

  /** Half of the width and of the height that the box has from here. */
  extent() {
    const { box, centre, room } = this.home, turn = this.camera.quaternion.clone().invert(), half = [1e-9, 1e-9];
    for (let k = 0; k < 8; k++) {
      const corner = new THREE.Vector3(...["x", "y", "z"].map((c, bit) => (k >> bit & 1 ? box.max : box.min)[c]));
      corner.sub(centre).applyQuaternion(turn);
      half[0] = Math.max(half[0], Math.abs(corner.x) * room);
      half[1] = Math.max(half[1], Math.abs(corner.y) * room);
    }
    return half;
  }

  /** Fit to a pane of so many pixels, some of which a heading takes. */
  fit(width, height, heading) {
    const free = Math.max(0.4, 1 - (2 * heading) / height), wide = width / height;
    const y = Math.max(this.half[1] / free, this.half[0] / wide), x = y * wide;
    Object.assign(this.camera, { left: -x, right: x, top: y, bottom: -y });
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  /** Listen to an element; changed() when the view is another. */
  attach(element, flat, changed) {
    const controls = new THREE.OrbitControls(this.camera, element);
    controls.target = this.target;
    controls.update(); // it has looked at the origin
    controls.enableDamping = false;
    controls.zoomSpeed = 1.4;
    if (flat) {
      controls.enableRotate = false;
      controls.mouseButtons.LEFT = THREE.MOUSE.PAN;
      controls.touches.ONE = THREE.TOUCH.PAN;
    }
    controls.addEventListener("change", changed);
    element.addEventListener("keydown", (event) => { if (this.key(event.key, flat)) { event.preventDefault(); controls.update(); changed(); } });
    return controls;
  }

  /** Arrow keys turn (in 2D move), + and - zoom, 0 goes back; false for other keys. */
  key(name, flat) {
    const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (name in ways) return this.turn(...ways[name], flat);
    if (name === "+" || name === "=") this.camera.zoom *= 1.15;
    else if (name === "-") this.camera.zoom /= 1.15;
    else if (name === "0") this.reset();
    else return false;
    return true;
  }

  turn(x, y, flat) {
    const way = this.camera.position.clone().sub(this.target);
    const side = new THREE.Vector3().crossVectors(this.camera.up, way).normalize();
    if (flat) {
      const step = (0.1 * this.home.radius) / this.camera.zoom, move = side.multiplyScalar(x * step).addScaledVector(this.camera.up, -y * step);
      this.target.add(move);
      this.camera.position.add(move);
      return true;
    }
    way.applyAxisAngle(this.camera.up, 0.12 * x);
    const tilted = way.clone().applyAxisAngle(side, 0.12 * y);
    if (Math.abs(tilted.clone().normalize().dot(this.camera.up)) < 0.999) way.copy(tilted);
    this.camera.position.copy(this.target).add(way);
    this.camera.lookAt(this.target);
    return true;
  }
}

/** The directions of the axes in a corner of a pane, drawn again when it turns. */
class Axes {
  constructor(pane, dimension) {
    this.svg = make("svg", { class: "axes", viewBox: "-32 -32 64 64", "aria-hidden": "true" });
    this.dimension = dimension;
    pane.append(this.svg);
  }

  draw(camera) {
    const turn = camera.quaternion.clone().invert(), found = [];
    ["x", "y", "z"].slice(0, this.dimension).forEach((name, k) => {
      const way = new THREE.Vector3().setComponent(k, 1).applyQuaternion(turn);
      found.push({ name, way, colour: ["#d55e00", "#009e73", "#3a7bd5"][k] });
    });
    found.sort((a, b) => a.way.z - b.way.z);
    this.svg.replaceChildren(...found.flatMap(({ name, way, colour }) => [
      make("line", { x1: 0, y1: 0, x2: 20 * way.x, y2: -20 * way.y, stroke: colour, "stroke-width": 2.4 }),
      make("text", { x: 27 * way.x, y: -27 * way.y }, name)]));
  }
}
