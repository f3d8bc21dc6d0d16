// The view: panes with bodies and contact zones, what they show, and the node that is picked.

const UNIT_OF = { pressure: "stress", shear: "stress", slip: "length", gap: "length", displacement: "length", "von Mises stress": "stress" };
const PALETTE = { light: [0xcdd8e4, 0xe6d9c8, 0xd3e3d2, 0xe3d3df, 0xdcdcc4, 0xcfe0e3], dark: [0x5d6b7a, 0x7a6a55, 0x5a7459, 0x745f70, 0x6f6f52, 0x56707a] };
const NEAR = 14; // pixels within which a click takes a node
const LONGEST = 0.16; // arrow of the largest force, relative to the bodies

class View {
  constructor(data, array) {
    this.data = data;
    this.view = data.view;
    THREE.ColorManagement.enabled = false;
    this.renderer = new THREE.WebGLRenderer({ canvas: byId("canvas"), antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.shared = new Shared(data.view, array);
    this.flat = data.view.dimension === 2;
    this.index = data.by === "solution" ? 0 : this.shared.states.length - 1;
    this.field = "status";
    this.wanted = { mesh: this.shared.edges.length < 60000, arrows: true, rest: false, obstacle: true, zone: true };
    this.listeners = [];
    this.measure();
    this.scale = this.suggested();
    this.bodyColours = PALETTE.light.map((c) => ({ value: new THREE.Color(c) }));
    this.buildPanes();
    this.theme();
    new ResizeObserver(() => this.draw()).observe(byId("stage"));
  }

  /** Ranges of the fields, the largest displacement and force, over all states. */
  measure() {
    this.ranges = {};
    this.largest = { moved: 0, force: 0 };
    const lengths = (values, found) => { for (let k = 0; k < values.length; k += 3)
      found = Math.max(found, Math.hypot(values[k], values[k + 1], values[k + 2])); return found; };
    for (const s of this.shared.states) {
      this.largest.moved = lengths(s.moved, this.largest.moved);
      this.largest.force = lengths(s.force, this.largest.force);
      for (const [name, values] of Object.entries(s.values)) {
        const range = (this.ranges[name] ||= [0, 0]);
        values.forEach((x, k) => { if (s.status[k] >= 0) { range[0] = Math.min(range[0], x); range[1] = Math.max(range[1], x); } });
      }
    }
    this.ranges.displacement = [0, this.largest.moved];
    this.ranges["von Mises stress"] = [0, this.shared.states.reduce((most, s) => s.stress.reduce((a, b) => Math.max(a, b), most), 0)];
    for (const range of Object.values(this.ranges)) if (range[1] - range[0] <= 0) range[1] = range[0] + 1;
  }

  /** A round factor that makes the largest displacement visible; 1 where it is.  Not below 1, which hides
      how large strains are, unless the bodies go out of sight: as in figures. */
  suggested() {
    const { moved } = this.largest, { size } = this.view;
    if (!(moved > 1e-12 * size)) return 1;
    const wanted = (0.12 * size) / moved;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const round = power * [5, 2, 1].find((k) => k * power <= wanted * (1 + 1e-9));
    return moved > size ? round : Math.max(1, round);
  }

  // ------------------------------------------------------------------------------ panes
  buildPanes() {
    this.panes = [];
    byId("panes").replaceChildren();
    const solutions = this.data.by === "solution";
    const count = solutions ? this.shared.states.length : 1;
    this.bodies ||= Array.from({ length: count }, () => new Bodies(this.shared, this.bodyColours));
    this.eyes ||= { whole: this.wholeEye(), slave: [], master: [] };
    const zones = this.wanted.zone ? this.shared.zones.length : 0, zone = Math.min(this.zone || 0, zones - 1);
    if (solutions) this.bodies.forEach((bodies, k) => this.addPane(bodies, {}, this.eyes.whole, this.shared.states[k].label,
      STATUSES.map((name) => `${this.shared.states[k].counts[name]} ${name}`).join(", ")));
    else {
      this.addPane(this.bodies[0], {}, this.eyes.whole, "", "");
      if (zones && !this.flat) {
        const z = this.shared.zones[zone];
        this.addPane(this.bodies[0], { side: "slave", zone }, this.zoneEye(zone, "slave"), "Contact, slave side", `${z.slave}, from outside`);
        if (z.masterPieces.length) this.addPane(this.bodies[0], { side: "master", zone }, this.zoneEye(zone, "master"), "Contact, master side", `${z.master}, from outside`);
      }
    }
    this.layout();
    this.refresh();
  }

  addPane(bodies, what, eye, title, detail) {
    const name = title || "Bodies";
    const element = make("div", { class: "pane", tabindex: "0", role: "application",
      "aria-label": `${name}: drag or use arrow keys to turn, + and - to zoom, 0 for the first view, n and p to pick contact nodes` });
    if (title) element.append(make("h3", {}, title, ...(detail ? [make("small", {}, detail)] : [])));
    const pane = { element, bodies, what, eye, heading: title ? 40 : 0, ...bodies.scene(what) };
    if (this.data.stamp || bodies.state?.stamp) element.append(make("div", { class: "across" }, make("span", {}, this.data.stamp)));
    pane.axes = new Axes(element, this.view.dimension);
    pane.dot = make("div", { class: "dot", hidden: true });
    element.append(pane.dot);
    byId("panes").append(element);
    pane.controls = eye.attach(element, this.flat, () => this.draw());
    this.listenTo(pane);
    this.panes.push(pane);
  }

  /** Panes beside or below each other, as the room is. */
  layout() {
    const box = byId("stage"), wide = box.clientWidth / box.clientHeight, n = this.panes.length, grid = byId("panes").style;
    for (const pane of this.panes) pane.element.style.gridArea = "";
    if (this.data.by === "solution") {
      let columns = 1;
      while (Math.ceil(n / columns) * wide > columns * 1.25 && columns < n) columns++;
      grid.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
      grid.gridTemplateRows = `repeat(${Math.ceil(n / columns)}, minmax(0, 1fr))`;
      return;
    }
    const aside = n - 1, across = wide > 1;
    grid.gridTemplateColumns = !aside ? "1fr" : across ? "minmax(0, 1.9fr) minmax(0, 1fr)" : `repeat(${aside}, minmax(0, 1fr))`;
    grid.gridTemplateRows = !aside ? "1fr" : across ? `repeat(${aside}, minmax(0, 1fr))` : "minmax(0, 1.6fr) minmax(0, 1fr)";
    if (aside) this.panes[0].element.style.gridArea = across ? `1 / 1 / span ${aside} / 2` : `1 / 1 / 2 / span ${aside}`;
  }

  wholeEye() {
    const box = new THREE.Box3(), at = new THREE.Vector3(), { points } = this.shared;
    for (let k = 0; k < points.length; k += 3) box.expandByPoint(at.fromArray(points, k));
    const up = this.flat ? new THREE.Vector3(0, 1, 0) : new THREE.Vector3(0, 0, 1);
    const from = this.flat ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(0.75, -1.2, 0.62);
    const { force, moved } = this.state || this.shared.states[0], tail = new THREE.Vector3();
    this.shared.arrows.forEach((v, k) => { // room for the deformed, and for arrows
      at.set(...[0, 1, 2].map((c) => points[3 * v + c] + this.scale * moved[3 * v + c]));
      if (this.largest.force > 0) at.addScaledVector(tail.fromArray(force, 3 * k), (-LONGEST * this.view.size) / this.largest.force);
      box.expandByPoint(at);
    });
    box.expandByScalar(0.04 * this.view.size);
    return new Eye(box, from, up, 1.1);
  }

  zoneEye(zone, side) {
    if (this.eyes[side][zone]) return this.eyes[side][zone];
    const { points, zones } = this.shared, box = new THREE.Box3(), at = new THREE.Vector3(), z = zones[zone];
    for (const v of side === "slave" ? z.pieces : z.masterPieces) box.expandByPoint(at.fromArray(points, 3 * v));
    const from = new THREE.Vector3(...z.outward);
    if (from.length() < 1e-6) from.set(0, 0, -1);
    if (side === "master") from.negate();
    from.normalize();
    const up = Math.abs(from.z) > 0.8 ? new THREE.Vector3(0, 1, 0) : new THREE.Vector3(0, 0, 1);
    return (this.eyes[side][zone] = new Eye(box, from, up, 1.2));
  }

  // ------------------------------------------------------------------------- what is shown
  /** Show a state, by its index. */
  step(index) {
    this.index = Math.max(0, Math.min(this.shared.states.length - 1, index));
    this.refresh();
    for (const listener of this.listeners) listener(this.index);
  }

  get state() { return this.shared.states[this.index]; }

  refresh() {
    const { uniforms, states } = this.shared;
    uniforms.scale.value = this.scale;
    const range = this.ranges[this.field] || [0, 1];
    uniforms.range.value.set(...range);
    this.bodies.forEach((bodies, k) => {
      bodies.show(this.data.by === "solution" ? states[k] : this.state, this.field);
      bodies.point(this.scale, LONGEST * this.view.size, this.largest.force);
    });
    for (const { parts } of this.panes) {
      if (parts.edges) parts.edges.visible = this.wanted.mesh;
      if (parts.ghost) parts.ghost.visible = this.wanted.rest;
      if (parts.forces) parts.forces.visible = this.wanted.arrows;
      for (const mesh of parts.rigid) mesh.visible = this.wanted.obstacle;
    }
    this.legend();
    this.tell();
    this.draw();
  }

  theme() {
    const dark = document.documentElement.dataset.theme === "dark";
    PALETTE[dark ? "dark" : "light"].forEach((c, k) => this.bodyColours[k].value.set(c));
    this.shared.edgeColour.value.set(dark ? 0xdfe5ec : 0x22303c);
    this.draw();
  }

  legend() {
    const box = byId("legend"), unit = this.data.units[UNIT_OF[this.field]] || "";
    const arrows = this.wanted.arrows && this.largest.force > 0
      ? [make("span", {}, `arrows: forces on the slave, longest ${text(this.largest.force, 3)} ${this.data.units.force}`)] : [];
    if (this.field === "status") {
      const counts = this.data.by === "solution" ? {} : this.state.counts;
      box.replaceChildren(make("b", {}, "status"), ...STATUSES.map((name) => make("span", { class: "key" },
        make("i", { style: `background:var(--${name})` }), name in counts ? `${name} ${counts[name]}` : name)), ...arrows);
    } else {
      const [low, high] = this.ranges[this.field], stops = MAP.map((c) => `#${c}`).join(",");
      box.replaceChildren(make("b", {}, withUnit(this.field, unit)), make("div", { class: "scale" },
        make("div", { class: "bar", style: `background:linear-gradient(90deg,${stops})` }),
        make("div", { class: "ticks" }, ...[0, 0.25, 0.5, 0.75, 1].map((t) => make("span", {}, text(low + t * (high - low), 3))))), ...arrows);
    }
    box.setAttribute("aria-label", box.textContent);
  }

  // ------------------------------------------------------------------------------ drawing
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  paint() {
    const stage = byId("stage").getBoundingClientRect(), { renderer } = this;
    if (!stage.width || !stage.height) return;
    this.layout();
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(stage.width, stage.height, false);
    renderer.setScissorTest(false);
    renderer.clear();
    renderer.setScissorTest(true);
    for (const pane of this.panes) {
      const box = pane.element.getBoundingClientRect();
      const at = [box.left - stage.left, stage.bottom - box.bottom, box.width, box.height];
      renderer.setViewport(...at);
      renderer.setScissor(...at);
      pane.eye.fit(box.width, box.height, pane.heading);
      renderer.render(pane.scene, pane.eye.camera);
      pane.axes.draw(pane.eye.camera);
      this.mark(pane, box);
    }
  }

  // ------------------------------------------------------------------------------ picking
  listenTo(pane) {
    let down = null;
    pane.element.addEventListener("pointerdown", (event) => { down = [event.clientX, event.clientY]; });
    pane.element.addEventListener("pointerup", (event) => {
      if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 4) this.pickAt(pane, event);
      down = null;
    });
    pane.element.addEventListener("keydown", (event) => {
      const way = { n: 1, p: -1 }[event.key];
      if (!way) return;
      const { contacts } = this.shared, at = this.shared.place.get(this.picked);
      this.pick(contacts[at === undefined ? (way > 0 ? 0 : contacts.length - 1) : (at + way + contacts.length) % contacts.length]);
    });
  }

  /** Where a vertex is in a pane: pixels, and depth. */
  project(pane, box, v, into) {
    const { points } = this.shared, { moved } = pane.bodies.state;
    into.set(...[0, 1, 2].map((c) => points[3 * v + c] + this.scale * moved[3 * v + c])).project(pane.eye.camera);
    return [((into.x + 1) / 2) * box.width, ((1 - into.y) / 2) * box.height, into.z];
  }

  pickAt(pane, event) {
    const box = pane.element.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top;
    const into = new THREE.Vector3(), some = pane.what.side ? new Set(pane.bodies.zones[pane.what.zone][pane.what.side].corners) : null;
    let best = null;
    for (let v = 0; v < this.shared.points.length / 3; v++) {
      if (some && !some.has(v)) continue;
      const [px, py, depth] = this.project(pane, box, v, into), far = Math.hypot(px - x, py - y);
      const cost = far / NEAR + depth * 20; // of those under the pointer the nearest to the eye
      if (far < NEAR && (!best || cost < best.cost)) best = { v, cost };
    }
    this.pane = pane;
    this.pick(best ? best.v : null);
  }

  pick(vertex) {
    this.picked = vertex;
    this.tell();
    this.draw();
  }

  mark(pane, box) {
    const { what, bodies, dot } = pane, v = this.picked;
    const side = what.side ? bodies.zones[what.zone][what.side] : null;
    dot.hidden = v === null || v === undefined || (side && !side.corners.includes(v));
    if (dot.hidden) return;
    const [x, y] = this.project(pane, box, v, new THREE.Vector3());
    dot.style.left = `${x}px`;
    dot.style.top = `${y}px`;
  }

  /** The numbers of the picked node, of every state beside each other where several are shown. */
  tell() {
    const box = byId("numbers"), v = this.picked;
    if (v === null || v === undefined) { box.replaceChildren("Click on a body, or press n and p in the view."); return; }
    const shown = this.data.by === "solution" ? this.shared.states : [this.state];
    const rows = [["body", this.view.bodies[this.shared.body[v]]], ["node", String(this.shared.node[v])],
      ["at", this.vector(this.shared.points, v, "length")]];
    for (const [k, state] of shown.entries()) {
      if (shown.length > 1) rows.push([state.label, ""]);
      rows.push(["displacement", this.vector(state.moved, v, "length")]);
      rows.push(["von Mises stress", `${text(state.stress[v])} ${this.data.units.stress}`]);
      const at = this.shared.place.get(v);
      if (at === undefined || state.status[at] < 0) { if (!k) rows.push(["contact", "none here"]); continue; }
      rows.push(["status", STATUSES[state.status[at]]]);
      for (const [name, values] of Object.entries(state.values)) rows.push([name, `${text(values[at])} ${this.data.units[UNIT_OF[name]]}`]);
      const arrow = this.shared.arrows.indexOf(v);
      if (arrow >= 0) rows.push(["force on the slave", this.vector(state.force, arrow, "force")]);
    }
    const body = make("tbody");
    for (const [name, value] of rows) body.append(make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, value)));
    box.replaceChildren(make("table", { class: "facts" }, body));
  }

  vector(values, at, unit) {
    const parts = Array.from({ length: this.view.dimension }, (_, c) => text(values[3 * at + c]));
    return `(${parts.join(", ")}) ${this.data.units[unit]}`;
  }
}
