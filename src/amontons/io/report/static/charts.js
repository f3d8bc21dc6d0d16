// Curves as SVG: axes, series, marks, and a point that moves with the state that is shown.

const WIDE = 420, HIGH = 260, LEFT = 68, RIGHT = 14, TOP = 10, LOW = 42;

/** Round numbers on an axis from a to b. */
function ticks(a, b, log, whole = false, most = 6) {
  if (log) {
    const low = Math.ceil(Math.log10(a) - 1e-9), high = Math.floor(Math.log10(b) + 1e-9);
    if (high - low < 1) return [1, 2, 5].flatMap((k) => [10 ** (low - 1) * k, 10 ** low * k])
      .filter((x) => x >= a * 0.999 && x <= b * 1.001).sort((x, y) => x - y);
    const every = Math.ceil((high - low + 1) / most);
    return Array.from({ length: high - low + 1 }, (_, k) => low + k)
      .filter((k) => (k - low) % every === 0).map((k) => 10 ** k);
  }
  const raw = (b - a) / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = Math.max(whole ? 1 : 0, power * [1, 2, 5, 10].find((k) => k * power >= raw * 0.999));
  const found = [];
  for (let x = Math.ceil(a / step - 1e-9) * step; x <= b + 1e-9 * step; x += step)
    found.push(Math.abs(x) < 1e-9 * step ? 0 : x);
  return found;
}

/** The ends of an axis that shows all values. */
function ends(values, log, least) {
  let low = Infinity, high = -Infinity;
  for (const x of values) if (!log || x > 0) { low = Math.min(low, x); high = Math.max(high, x); }
  if (!(low <= high)) [low, high] = log ? [0.1, 1] : [0, 1];
  if (log) return low === high ? [low / 2, high * 2] : [low / 1.3, high * 1.3];
  if (least !== undefined) low = Math.min(low, least);
  const room = (high - low || Math.abs(high) || 1) * 0.05;
  return [low === least ? low : low - room, high + room];
}

/** A chart as a figure; `moved(index)` puts the point on a state, `chosen` hears of clicks. */
function drawChart(data, chosen) {
  const xs = data.series.flatMap((s) => s.x), bars = data.series.some((s) => s.bars || s.step);
  const ys = data.series.flatMap((s) => s.y).concat((data.lines || []).map((l) => l.y));
  const around = data.series.some((s) => s.bars) ? [Math.min(...xs) - 0.8, Math.max(...xs) + 0.8] : xs;
  const [x0, x1] = ends(around, data.logx), [y0, y1] = ends(ys, data.log, bars ? 0 : undefined);
  const part = (x, a, b, log) => (log ? Math.log(x / a) / Math.log(b / a) : (x - a) / (b - a));
  const X = (x) => LEFT + (WIDE - LEFT - RIGHT) * part(x, x0, x1, data.logx);
  const Y = (y) => HIGH - LOW - (HIGH - LOW - TOP) * part(data.log ? Math.max(y, y0) : y, y0, y1, data.log);
  const svg = make("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img",
    "aria-label": `${data.title}: ${data.y} over ${data.x}` });
  axes(svg, data, { X, Y, x0, x1, y0, y1 });
  for (const series of data.series) drawSeries(svg, series, X, Y, y0);
  for (const mark of data.marks || []) {
    const at = { cx: X(mark.x), cy: Y(mark.y), r: 4.5 };
    svg.append(make("circle", { ...at, fill: "var(--card)", stroke: "var(--ink)", "stroke-width": 1.5,
      "data-mark": mark.name }, make("title", {}, `${mark.name} at ${text(mark.x, 8)}`)));
  }
  const states = data.states || [];
  const cursor = make("g", { class: "cursor", visibility: "hidden" });
  cursor.append(make("line", { y1: TOP, y2: HIGH - LOW, stroke: "var(--ink)", "stroke-dasharray": "3 3" }),
    make("circle", { r: 6, fill: "#d0006f", stroke: "#fff", "stroke-width": 2 }));
  svg.append(cursor);
  if (states.length && chosen) svg.addEventListener("click", (event) => {
    const box = svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * WIDE, y = ((event.clientY - box.top) / box.height) * HIGH;
    const far = (s) => Math.hypot(X(s[0]) - x, s[1] === null ? 0 : Y(s[1]) - y);
    chosen(states.reduce((best, s) => (far(s) < far(best) ? s : best))[2]);
  });
  const figure = make("figure", { class: `card${data.curve ? " curve" : ""}` },
    make("figcaption", {}, data.title), svg, names(data));
  figure.moved = (index) => {
    const state = states.find((s) => s[2] === index);
    cursor.setAttribute("visibility", state ? "visible" : "hidden");
    if (!state) return;
    const [upright, dot] = cursor.children;
    upright.setAttribute("x1", X(state[0]));
    upright.setAttribute("x2", X(state[0]));
    dot.setAttribute("cx", X(state[0]));
    dot.setAttribute("cy", state[1] === null ? HIGH - LOW : Y(state[1]));
  };
  return figure;
}

function axes(svg, data, { X, Y, x0, x1, y0, y1 }) {
  for (const x of ticks(x0, x1, data.logx, data.series.every((s) => s.x.every(Number.isInteger)))) svg.append(
    make("line", { class: "grid", x1: X(x), x2: X(x), y1: TOP, y2: HIGH - LOW }),
    make("text", { x: X(x), y: HIGH - LOW + 15, "text-anchor": "middle" }, text(x, 3)));
  for (const y of ticks(y0, y1, data.log, data.series.every((s) => s.y.every(Number.isInteger)))) svg.append(
    make("line", { class: "grid", x1: LEFT, x2: WIDE - RIGHT, y1: Y(y), y2: Y(y) }),
    make("text", { x: LEFT - 6, y: Y(y) + 4, "text-anchor": "end" }, text(y, 3)));
  svg.append(make("rect", { class: "frame", x: LEFT, y: TOP, width: WIDE - LEFT - RIGHT, height: HIGH - LOW - TOP }),
    make("text", { class: "soft", x: (LEFT + WIDE - RIGHT) / 2, y: HIGH - 8, "text-anchor": "middle" }, data.x),
    make("text", { class: "soft", transform: `translate(11 ${(TOP + HIGH - LOW) / 2}) rotate(-90)`,
      "text-anchor": "middle" }, data.y));
  for (const level of data.lines || []) svg.append(
    make("line", { x1: LEFT, x2: WIDE - RIGHT, y1: Y(level.y), y2: Y(level.y), stroke: "var(--alarm)",
      "stroke-dasharray": "5 4" }),
    make("text", { x: LEFT + 4, y: Y(level.y) - 4, style: "fill:var(--alarm)" }, level.name));
}

function drawSeries(svg, series, X, Y, y0) {
  const stroke = seriesColour(series.colour), n = series.x.length;
  if (series.bars) {
    const wide = Math.max(1, Math.min(14, X(series.x[0] + 0.8) - X(series.x[0]) || 1));
    series.x.forEach((x, k) => svg.append(make("rect", { x: X(x) - wide / 2, width: wide,
      y: Math.min(Y(0), Y(series.y[k])), height: Math.max(1.5, Math.abs(Y(series.y[k]) - Y(0))), fill: stroke })));
    return;
  }
  if (series.dots || n === 1) {
    series.x.forEach((x, k) => svg.append(make("circle", { cx: X(x), cy: Y(series.y[k]), r: 2.6, fill: stroke })));
    return;
  }
  let path = "";
  series.x.forEach((x, k) => {
    const [px, py] = [X(x).toFixed(1), Y(series.y[k]).toFixed(1)];
    path += k === 0 ? `M${px} ${py}` : series.step ? `H${px}V${py}` : `L${px} ${py}`;
  });
  if (n) svg.append(make("path", { d: path, fill: "none", stroke, "stroke-width": 2, "stroke-linejoin": "round" }));
  if (n <= 40 && !series.step) series.x.forEach((x, k) => svg.append(
    make("circle", { cx: X(x), cy: Y(series.y[k]), r: 2.6, fill: stroke })));
}

/** The names of the series and of the marks, below the chart. */
function names(data) {
  const legend = make("div", { class: "names" });
  if (data.series.length > 1) for (const s of data.series.filter((one) => one.name).slice(0, 12)) legend.append(
    make("span", {}, make("i", { style: `border-color:${seriesColour(s.colour)}` }), ` ${s.name}`));
  for (const name of new Set((data.marks || []).map((m) => m.name))) legend.append(make("span", {}, `○ ${name}`));
  return legend;
}

/** Vertices along the lines of a zone in 2D, in order, as parts that hang together: [vertex, length so far]. */
function along(pieces, points) {
  const next = new Map(), ends = new Set(), parts = [];
  for (let k = 0; k < pieces.length; k += 2) { next.set(pieces[k], pieces[k + 1]); ends.add(pieces[k + 1]); }
  const at = (v, c) => points[3 * v + c];
  let length = 0;
  for (const start of [...[...next.keys()].filter((v) => !ends.has(v)), ...next.keys()]) {
    if (!next.has(start)) continue;
    const part = [[start, length]];
    for (let v = start; next.has(v);) {
      const to = next.get(v);
      next.delete(v);
      length += Math.hypot(at(to, 0) - at(v, 0), at(to, 1) - at(v, 1));
      part.push([to, length]);
      v = to;
    }
    parts.push(part);
  }
  const all = parts.flat(), backward = all.length && at(all[all.length - 1][0], 0) < at(all[0][0], 0);
  return backward ? parts.map((part) => part.map(([v, s]) => [v, length - s])) : parts;
}

/** Pressure and shear along the slave of a zone in 2D, and the status of its contacts. */
function zoneChart(view, zone) {
  const { shared, state, data } = view, parts = along(zone.pieces, shared.points), series = [], statuses = [[], [], []];
  for (const [k, name] of ["pressure", "shear"].entries()) parts.forEach((part, j) => {
    const known = part.filter(([v]) => state.status[shared.place.get(v)] >= 0);
    series.push({ name: j ? "" : name, colour: 2 + k, x: known.map(([, s]) => s), y: known.map(([v]) => state.values[name][shared.place.get(v)]) });
  });
  for (const [v, s] of parts.flat()) statuses[state.status[shared.place.get(v)]]?.push(s);
  statuses.forEach((x, k) => { if (x.length) series.push({ name: STATUSES[k], colour: STATUSES[k], dots: true, x, y: x.map(() => 0) }); });
  view.curve = series;
  return drawChart({ title: `Contact: ${zone.slave}`, x: withUnit("length along it", data.units.length),
    y: withUnit("stress", data.units.stress), series }, null);
}
