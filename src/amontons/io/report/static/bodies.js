// The bodies of one state as meshes of three.js: deformed and coloured on the graphics card.

const EVERYWHERE = ["displacement", "von Mises stress"]; // fields of all nodes, not of contacts alone
const VERTEX = `
  attribute vec3 move; attribute vec3 aside; attribute float value; attribute vec4 kind;
  uniform float scale; uniform float lift;
  varying vec3 seen; varying float number; varying vec4 which;
  void main() {
    vec4 at = modelViewMatrix * vec4(position + scale * move + aside, 1.0);
    seen = at.xyz; number = value; which = kind;
    gl_Position = projectionMatrix * at;
    gl_Position.z -= lift * gl_Position.w;
  }`;
// how: 0 one colour, 1 the status, 2 a number; flat shading by the slope of the surface itself
const FRAGMENT = `
  uniform vec3 colour, statusColour[3]; uniform sampler2D map; uniform vec2 range;
  uniform int how; uniform float light, alpha;
  varying vec3 seen; varying float number; varying vec4 which;
  void main() {
    vec3 base = colour;
    if (how > 0 && which.w < 0.5) {
      if (how == 1) base = which.x >= which.y && which.x >= which.z ? statusColour[0]
                         : which.y >= which.z ? statusColour[1] : statusColour[2];
      else base = texture2D(map, vec2(clamp((number - range.x) / (range.y - range.x), 0.003, 0.997), 0.5)).rgb;
    }
    vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
    float shade = how > 0 ? 0.86 + 0.14 * abs(n.z) : 0.55 + 0.45 * abs(dot(n, normalize(vec3(0.35, 0.45, 0.82))));
    gl_FragColor = vec4(base * mix(1.0, shade, light), alpha);
  }`;

/** The colour map as a texture. */
function mapTexture() {
  const bytes = new Uint8Array(256 * 4);
  for (let k = 0; k < 256; k++) {
    const at = (k / 255) * (MAP.length - 1), low = Math.min(Math.floor(at), MAP.length - 2), t = at - low;
    for (let c = 0; c < 3; c++) {
      const [a, b] = [low, low + 1].map((i) => parseInt(MAP[i].slice(2 * c, 2 * c + 2), 16));
      bytes[4 * k + c] = Math.round(a + t * (b - a));
    }
    bytes[4 * k + 3] = 255;
  }
  const texture = new THREE.DataTexture(bytes, 256, 1);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/** What all states share: arrays of the skin, uniforms, materials. */
class Shared {
  constructor(view, array) {
    this.view = view;
    this.points = array(view.points);
    this.triangles = array(view.triangles);
    this.edges = array(view.edges);
    this.sharp = array(view.sharp);
    this.contacts = array(view.contacts);
    this.arrows = array(view.arrows);
    this.node = array(view.node);
    this.body = array(view.body);
    this.zones = view.zones.map((z) => ({ ...z, pieces: array(z.pieces), masterPieces: array(z.masterPieces),
      rigidPoints: array(z.rigidPoints), rigidPieces: array(z.rigidPieces) }));
    this.place = new Map(Array.from(this.contacts, (vertex, k) => [vertex, k]));
    this.states = view.states.map((s) => ({ ...s, moved: array(s.moved), status: array(s.status), force: array(s.force), stress: array(s.stress),
      values: Object.fromEntries(Object.entries(s.values).map(([name, place]) => [name, array(place)])) }));
    this.uniforms = { scale: { value: 1 }, map: { value: mapTexture() }, range: { value: new THREE.Vector2(0, 1) },
      statusColour: { value: STATUSES.map((name) => new THREE.Color().setStyle(colourOf(name), THREE.LinearSRGBColorSpace)) } };
    this.edgeColour = { value: new THREE.Color() };
  }

  /** A material; colour: a uniform; lift: how far in front of what lies in the same place. */
  material(colour, how, { lift = 0, light = 1, alpha = 1 } = {}) {
    return new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide,
      transparent: alpha < 1, depthWrite: alpha === 1,
      uniforms: { ...this.uniforms, colour, how: { value: how }, lift: { value: lift }, light: { value: light },
        alpha: { value: alpha } } });
  }
}

/** Bodies, contact zones, forces and obstacles of one state. */
class Bodies {
  constructor(shared, bodyColours) {
    this.shared = shared;
    const { view, points } = shared, count = points.length / 3;
    this.move = new THREE.BufferAttribute(new Float32Array(3 * count), 3);
    this.value = new THREE.BufferAttribute(new Float32Array(count), 1);
    const rest = new THREE.BufferAttribute(points, 3);
    const none = new THREE.BufferAttribute(new Float32Array(3 * count), 3);
    const known = new THREE.BufferAttribute(new Uint8Array(4 * count), 4, true);
    const geometry = (index) => {
      const made = new THREE.BufferGeometry();
      for (const [name, attribute] of Object.entries({ position: rest, move: this.move, aside: none, value: this.value, kind: known }))
        made.setAttribute(name, attribute);
      made.setIndex(new THREE.BufferAttribute(index, 1));
      return made;
    };
    let first = 0;
    this.solids = view.ends.map((end, k) => {
      const part = geometry(shared.triangles.slice(3 * first, 3 * end));
      first = end;
      return new THREE.Mesh(part, shared.material(bodyColours[k % bodyColours.length], 0));
    });
    this.edges = new THREE.LineSegments(geometry(shared.edges), shared.material(shared.edgeColour, 0, { lift: 4e-4, light: 0, alpha: 0.28 }));
    this.sharp = new THREE.LineSegments(geometry(shared.sharp), shared.material(shared.edgeColour, 0, { lift: 6e-4, light: 0, alpha: 0.75 }));
    const ghost = shared.material(shared.edgeColour, 0, { light: 0, alpha: 0.35 });
    ghost.uniforms.scale = { value: 0 };
    this.ghost = new THREE.LineSegments(geometry(shared.sharp), ghost);
    this.zones = shared.zones.map((zone) => ({
      slave: new Zone(shared, zone.pieces, bodyColours[shared.body[zone.pieces[0]] % bodyColours.length]),
      master: zone.masterPieces.length ? new Zone(shared, zone.masterPieces, bodyColours[shared.body[zone.masterPieces[0]] % bodyColours.length]) : null,
      rigid: this.obstacle(zone) }));
    this.forces = this.arrowMesh();
  }

  /** All that a pane shows, as its own objects over the same arrays. */
  scene(what) {
    const scene = new THREE.Scene(), copy = (mesh) => (mesh ? new mesh.constructor(mesh.geometry, mesh.material) : null);
    const parts = { solids: [], zones: [], rigid: [], edges: null, sharp: null, ghost: null, forces: null };
    if (what.side) {
      const zone = this.zones[what.zone];
      parts.zones = [copy((zone[what.side] || zone.slave).mesh)];
    } else {
      parts.solids = this.solids.map(copy);
      parts.zones = this.zones.flatMap((z) => [z.slave, z.master]).filter(Boolean).map((z) => copy(z.mesh));
      parts.rigid = this.zones.map((z) => copy(z.rigid)).filter(Boolean);
      for (const name of ["edges", "sharp", "ghost"]) parts[name] = copy(this[name]);
      parts.forces = this.forces;
    }
    for (const part of Object.values(parts).flat()) if (part) { part.frustumCulled = false; scene.add(part); }
    return { scene, parts };
  }

  obstacle(zone) {
    if (!zone.rigidPieces.length) return null;
    const colour = { value: new THREE.Color(0x8c96a1) };
    if (this.shared.view.dimension === 2) return new Zone({ ...this.shared, points: zone.rigidPoints, material: this.shared.material }, zone.rigidPieces, colour, 0).mesh;
    const made = new THREE.BufferGeometry(), count = zone.rigidPoints.length / 3;
    made.setAttribute("position", new THREE.BufferAttribute(zone.rigidPoints, 3));
    for (const [name, size] of [["move", 3], ["aside", 3], ["value", 1], ["kind", 4]])
      made.setAttribute(name, new THREE.BufferAttribute(new Float32Array(size * count), size));
    made.setIndex(new THREE.BufferAttribute(zone.rigidPieces, 1));
    return new THREE.Mesh(made, this.shared.material(colour, 0, { lift: -2e-4, alpha: 0.3 }));
  }

  /** One arrow along x, from 0 to 1, in as many places as there are forces. */
  arrowMesh() {
    const shaft = new THREE.CylinderGeometry(0.35, 0.35, 0.72, 8, 1, false).translate(0, 0.36, 0);
    const head = new THREE.ConeGeometry(1, 0.28, 12).translate(0, 0.86, 0);
    const made = joined(shaft, head);
    const mesh = new THREE.InstancedMesh(made, new THREE.MeshBasicMaterial({ color: 0xd55e00 }), Math.max(1, this.shared.arrows.length));
    mesh.frustumCulled = false;
    return mesh;
  }

  /** Take a state of the page: its displacements and the field that colours. */
  show(state, field) {
    this.state = state;
    this.move.array.set(state.moved);
    this.move.needsUpdate = true;
    const u = state.moved;
    if (field === "displacement")
      for (let k = 0; k < this.value.count; k++) this.value.array[k] = Math.hypot(u[3 * k], u[3 * k + 1], u[3 * k + 2]);
    if (field === "von Mises stress") this.value.array.set(state.stress);
    this.value.needsUpdate = true;
    for (const mesh of this.solids) mesh.material.uniforms.how.value = EVERYWHERE.includes(field) ? 2 : 0;
    for (const zone of this.zones) for (const side of [zone.slave, zone.master]) side?.show(state, field, this.value.array);
  }

  /** Arrows that end at the nodes, the longest of a given length. */
  point(scale, longest, largest) {
    const { arrows, points, view } = this.shared, { force, moved } = this.state;
    const matrix = new THREE.Matrix4(), up = new THREE.Vector3(0, 1, 0), turn = new THREE.Quaternion();
    const tip = new THREE.Vector3(), along = new THREE.Vector3(), size = new THREE.Vector3();
    const thick = 0.0045 * view.size;
    let shown = 0;
    for (let k = 0; k < arrows.length; k++) {
      along.fromArray(force, 3 * k);
      const length = largest > 0 ? (along.length() / largest) * longest : 0;
      if (!(length > 1e-3 * longest)) continue;
      const v = arrows[k];
      tip.set(...[0, 1, 2].map((c) => points[3 * v + c] + scale * moved[3 * v + c]));
      along.normalize();
      turn.setFromUnitVectors(up, along);
      tip.addScaledVector(along, -length);
      size.set(Math.min(thick, 0.25 * length), length, Math.min(thick, 0.25 * length));
      this.forces.setMatrixAt(shown++, matrix.compose(tip, turn, size));
    }
    this.forces.count = shown;
    this.forces.instanceMatrix.needsUpdate = true;
  }
}

/** One side of a contact pair: triangles, or in 2D ribbons along its lines. */
class Zone {
  constructor(shared, pieces, colour, how = 1) {
    this.shared = shared;
    const d = shared.view.dimension, corners = [], aside = [], index = [];
    if (d === 3) {
      const at = new Map();
      for (const v of pieces) { if (!at.has(v)) { at.set(v, corners.length); corners.push(v); } index.push(at.get(v)); }
      aside.length = 3 * corners.length;
      aside.fill(0);
    } else this.ribbon(pieces, corners, aside, index, how);
    this.corners = corners;
    const rest = new Float32Array(3 * corners.length);
    corners.forEach((v, k) => rest.set(shared.points.subarray(3 * v, 3 * v + 3), 3 * k));
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(rest, 3));
    this.geometry.setAttribute("aside", new THREE.BufferAttribute(Float32Array.from(aside), 3));
    for (const [name, size] of [["move", 3], ["value", 1], ["kind", 4]])
      this.geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(size * corners.length), size));
    this.geometry.setIndex(index);
    this.mesh = new THREE.Mesh(this.geometry, shared.material(colour, how, how ? { lift: 2e-4 } : { lift: -2e-4, light: 0 }));
  }

  /** Four corners per line, two of them moved outwards (to the right of its direction). */
  ribbon(pieces, corners, aside, index, how) {
    const { points, view } = this.shared, wide = 0.016 * view.size;
    const [inner, outer] = how ? [-0.35, 0.65] : [0, 1];
    for (let k = 0; k < pieces.length; k += 2) {
      const [a, b] = [pieces[k], pieces[k + 1]], first = corners.length;
      const x = points[3 * b] - points[3 * a], y = points[3 * b + 1] - points[3 * a + 1], l = Math.hypot(x, y) || 1;
      for (const [v, far] of [[a, inner], [b, inner], [b, outer], [a, outer]]) {
        corners.push(v);
        aside.push((far * wide * y) / l, (-far * wide * x) / l, (how ? 1e-3 : -1e-3) * view.size);
      }
      index.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }

  show(state, field, everywhere) {
    const { place } = this.shared, { move, value, kind } = this.geometry.attributes;
    const numbers = state.values[field];
    this.corners.forEach((v, k) => {
      for (let c = 0; c < 3; c++) move.array[3 * k + c] = state.moved[3 * v + c];
      const at = place.get(v), status = at === undefined ? -1 : state.status[at];
      for (let c = 0; c < 3; c++) kind.array[4 * k + c] = status === c ? 1 : 0;
      kind.array[4 * k + 3] = status < 0 && !EVERYWHERE.includes(field) ? 1 : 0;
      value.array[k] = EVERYWHERE.includes(field) ? everywhere[v] : numbers && at !== undefined ? numbers[at] : 0;
    });
    for (const attribute of [move, value, kind]) attribute.needsUpdate = true;
    this.mesh.material.uniforms.how.value = field === "status" ? 1 : 2;
  }
}

/** Two geometries as one. */
function joined(a, b) {
  const made = new THREE.BufferGeometry(), size = a.attributes.position.count;
  const both = (name) => Float32Array.of(...a.attributes[name].array, ...b.attributes[name].array);
  made.setAttribute("position", new THREE.BufferAttribute(both("position"), 3));
  made.setIndex([...a.index.array, ...Array.from(b.index.array, (k) => k + size)]);
  return made;
}
