// The page: its theme, its tools, its curves, and what happens where there is no 3D.

const DATA = JSON.parse(byId("data").textContent);
let view = null;

/** Light or dark: as the system has it, until the button says otherwise. */
function theme() {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const set = (dark) => { document.documentElement.dataset.theme = dark ? "dark" : "light"; view?.theme(); };
  set(system.matches);
  system.addEventListener("change", () => set(system.matches));
  byId("theme").addEventListener("click", () => set(document.documentElement.dataset.theme !== "dark"));
  addEventListener("beforeprint", () => set(false));
}

function tools() {
  const bar = byId("tools"), slider = make("input", { type: "range", id: "scale", min: 0, max: 100, value: 50, "aria-label": "Deformation is shown times" });
  const shown = make("output", { for: "scale" }), most = 2 * view.scale;
  const scaled = () => { view.scale = (slider.value / 100) * most; shown.textContent = `× ${text(view.scale, 3)}`; view.refresh(); };
  slider.addEventListener("input", scaled);
  const field = make("select", { id: "field", onchange: () => { view.field = field.value; view.refresh(); } },
    ...DATA.view.fields.map((name) => make("option", { value: name }, withUnit(name, DATA.units[UNIT_OF[name]] || ""))));
  bar.append(make("label", {}, "Colour", field), make("label", {}, "Deformed", slider, shown),
    make("button", { type: "button", onclick: () => { slider.value = most ? Math.round(100 / most) : 0; view.scale = 1; shown.textContent = "× 1"; view.refresh(); } }, "True scale"));
  const boxes = { mesh: "Mesh", arrows: "Forces", rest: "Undeformed", obstacle: "Obstacle" };
  if (!view.shared.zones.some((z) => z.rigidPieces.length)) delete boxes.obstacle;
  if (!view.flat && DATA.by !== "solution") boxes.zone = "Contact zone";
  for (const [name, label] of Object.entries(boxes)) {
    const box = make("input", { type: "checkbox", id: `show-${name}`, checked: view.wanted[name] });
    box.addEventListener("change", () => { view.wanted[name] = box.checked; if (name === "zone") view.buildPanes(); else view.refresh(); });
    bar.append(make("label", {}, box, label));
  }
  if (DATA.by !== "solution" && view.shared.zones.length > 1) bar.append(make("label", {}, "Pair",
    make("select", { id: "pair", onchange: (event) => { view.zone = event.target.selectedIndex; view.buildPanes(); } },
      ...view.shared.zones.map((z) => make("option", {}, `${z.slave} on ${z.master}`)))));
  if (!view.flat) sides(bar);
  shown.textContent = `× ${text(view.scale, 3)}`;
  byId("help").textContent = `${view.flat ? "Drag to move" : "Drag to turn, right button to move"}, wheel to zoom, click a node for its numbers. Keys in the view: arrows, +, −, 0, n, p.${DATA.note ? ` ${DATA.note}.` : ""}`;
}

/** Buttons to look from the sides. */
function sides(bar) {
  const ways = { Corner: null, Front: [0, -1, 0], Right: [1, 0, 0], Top: [0, -1e-3, 1], Below: [0, -1e-3, -1] };
  const group = make("span", { class: "sides", role: "group", "aria-label": "Look from" });
  bar.append(group);
  for (const [name, way] of Object.entries(ways)) group.append(make("button", { type: "button", onclick: () => {
    view.eyes.whole.reset(way ? new THREE.Vector3(...way) : undefined);
    for (const pane of view.panes) pane.controls.update();
    view.draw();
  } }, name));
}

/** A slider over time or along the curve, with keys and a button that lets it run. */
function steps(charts) {
  const states = view.shared.states;
  if (DATA.by === "solution" || states.length < 2) return;
  const slider = make("input", { type: "range", id: "step", min: 0, max: states.length - 1, value: view.index,
    "aria-label": DATA.by === "time" ? "Time" : `Point of the curve, ${DATA.by}` });
  const label = make("output", { for: "step" });
  let timer = null;
  const play = make("button", { type: "button", id: "play", "aria-pressed": "false", onclick: () => {
    timer = timer ? clearInterval(timer) : setInterval(() => view.step((view.index + 1) % states.length), Math.max(60, Math.min(400, 8000 / states.length)));
    play.setAttribute("aria-pressed", String(Boolean(timer)));
    play.textContent = timer ? "Stop" : "Play";
  } }, "Play");
  slider.addEventListener("input", () => view.step(Number(slider.value)));
  view.listeners.push((index) => {
    slider.value = index;
    label.textContent = states[index].label;
    for (const chart of charts) chart.moved(index);
  });
  byId("steps").append(play, make("label", {}, slider), label);
}

/** A table of the contacts of the state that is shown, the most loaded first. */
function contactTable() {
  const fill = () => {
    if (!byId("contacts").querySelector("details").open) return;
    const { state, shared } = view, order = [...shared.contacts.keys()].filter((k) => state.status[k] >= 0)
      .sort((a, b) => state.values.pressure[b] - state.values.pressure[a]).slice(0, 200);
    const head = ["body", "node", "status", ...Object.keys(state.values).map((name) => withUnit(name, DATA.units[UNIT_OF[name]]))];
    const rows = order.map((k) => {
      const v = shared.contacts[k];
      const cells = [shared.node[v], STATUSES[state.status[k]], ...Object.values(state.values).map((values) => text(values[k]))];
      return make("tr", {}, make("th", { scope: "row" }, DATA.view.bodies[shared.body[v]]), ...cells.map((cell) => make("td", {}, String(cell))));
    });
    byId("rows").replaceChildren(
      make("table", { class: "table" }, make("thead", {}, make("tr", {}, ...head.map((name) => make("th", { scope: "col" }, name)))), make("tbody", {}, ...rows)),
      make("p", { class: "hint" }, `${order.length} nodes of both sides, the most loaded first${state.label ? `; ${state.label}` : ""}. All are in solution.h5 and the VTU files.`));
  };
  byId("contacts").querySelector("details").addEventListener("toggle", fill);
  view.listeners.push(fill);
}

/** In 2D the contact zone is a curve; it follows the state and the pair that are shown. */
function zoneCurve() {
  if (!view.flat || DATA.by === "solution" || !view.shared.zones.length) return;
  const place = make("div", { id: "zone" });
  (DATA.by ? byId("charts") : byId("beside")).prepend(place);
  const draw = () => place.replaceChildren(zoneChart(view, view.shared.zones[view.zone || 0]));
  view.listeners.push(draw);
  byId("pair")?.addEventListener("change", draw);
}

theme();
const array = await unpack(byId("arrays").textContent).catch(() => null);
if (DATA.view) {
  try {
    if (!array) throw new Error("this browser can not unpack the arrays (DecompressionStream)");
    view = new View(DATA, array);
    byId("canvas").addEventListener("webglcontextlost", (event) => { event.preventDefault(); byId("no3d").hidden = false; byId("no3d").textContent = "The graphics card stopped; load the page again."; });
  } catch (reason) {
    view = null;
    byId("no3d").hidden = false;
    byId("no3d").textContent = `No 3D here: ${reason.message.replace(/\.$/, "")}. All numbers below can be read without it.`;
    for (const id of ["stage", "picked", "contacts"]) byId(id).hidden = true;
  }
}
const charts = DATA.charts.map((chart) => drawChart(chart, view ? (index) => view.step(index) : null));
const beside = view && DATA.by && DATA.by !== "solution" ? charts.slice(0, 1) : [];
byId("beside").append(...beside);
byId("charts").append(...charts.slice(beside.length));
if (view) {
  tools();
  steps(charts);
  contactTable();
  zoneCurve();
  view.step(view.index);
}
window.report = { data: DATA, view }; // for those who look closer, and for tests
document.documentElement.dataset.ready = "yes";
