// Plots: curves, points and maps of colours over a pair of axes; what stands at the cursor is told below.
const given = (element) => data.plots[Number(element.dataset.plot)];
const short = (value, digits = 5) => String(Number(value.toPrecision(digits))).replace("-", "−");
const told = (value, unit, digits) => (value == null ? "–" : `${short(value, digits)}${unit ? `\u00a0${unit}` : ""}`);
const nameOf = (label) => (label.includes(", ") ? label.slice(0, label.lastIndexOf(", ")) : label);
const unitOf = (label) => (label.includes(", ") ? label.slice(label.lastIndexOf(", ") + 2) : "");
// As many digits as it takes to tell points apart, far from zero, too.
const digitsOf = ({ min, max }) => 4 + Math.max(1, Math.ceil(Math.log10(Math.max(Math.abs(min), Math.abs(max)) / (max - min))));
const COLOURS = {
  rising: ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"],
  diverging: ["#2166ac", "#92c5de", "#f7f7f7", "#f4a582", "#b2182b"],
};
const mixed = (colours, part) => {
  const k = Math.min(Math.max(part, 0), 1) * (colours.length - 1), i = Math.min(Math.floor(k), colours.length - 2);
  const at = (colour, place) => parseInt(colour.slice(place, place + 2), 16);
  return `rgb(${[1, 3, 5].map((p) => Math.round(at(colours[i], p) * (1 - k + i) + at(colours[i + 1], p) * (k - i))).join(",")})`;
};
const inked = (colour) => (colour === "#000000" ? css("--ink") : colour);

// A jump has two values at one time: the second stands a hair later.
function strictly(x) {
  const made = x.slice(), hair = 1e-12 * (x[x.length - 1] - x[0]);
  for (let i = 1; i < made.length; i++) {
    if (made[i] <= made[i - 1]) made[i] = made[i - 1] + Math.max(hair, Math.abs(made[i - 1]) * 2 ** -51);
  }
  return made;
}
function columns(plot) {
  const series = [{ label: nameOf(plot.x), value: (u, v) => told(v, unitOf(plot.x), v == null ? 5 : digitsOf(u.scales.x)) }];
  const tables = [], bands = [], unit = plot.unit ?? "";
  for (const trace of plot.traces) {
    const x = strictly(trace.x), colour = inked(trace.colour);
    if (trace.low) {
      bands.push({ series: [series.length + 1, series.length], fill: `${trace.colour}33` });
      for (const edge of [trace.low, trace.high]) { tables.push([x, edge]); series.push({ class: "edge", points: { show: false } }); }
    }
    const points = { show: Boolean(trace.points), size: 7, fill: colour };
    const line = { label: trace.name, stroke: colour, width: 1.6, pxAlign: 0, points, value: (u, v) => told(v, trace.unit ?? unit) };
    if (trace.dash) line.dash = [6, 4];
    if (trace.steps) line.paths = uPlot.paths.stepped({ align: 1 });
    if (trace.points === "alone") line.paths = () => null;
    tables.push([x, trace.y]);
    series.push(line);
  }
  return { data: uPlot.join(tables), series, bands };
}
function tick(value, step) {
  if (value == null) return "";
  const size = Math.abs(value);
  if (size && (size >= 1e6 || step < 1e-5)) return short(value, Math.min(15, Math.max(1, Math.ceil(Math.log10(size / step)) + 1)));
  let decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  if (Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6) decimals += 1; // steps of 2.5
  return value.toFixed(decimals).replace("-", "−");
}
const isPower = (v) => v != null && Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-9;
function power(value) {
  if (value == null) return "";
  if (!isPower(value) || (value >= 1e-3 && value < 1e4)) return short(value);
  return `10${[...String(Math.round(Math.log10(value)))].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c])).join("")}`;
}
function axisOf(label, words, log) {
  const font = '12px system-ui, sans-serif', line = { stroke: css("--line"), width: 1 };
  const values = words ? (u, splits) => splits.map((v) => words[v] ?? "")
    : log ? (u, splits) => splits.map(power) : (u, splits, a, b, step) => splits.map((v) => tick(v, step));
  const lines = log ? { ...line, filter: (u, splits) => splits.map((v) => (isPower(v) ? v : null)) } : line;
  return { label, font, labelFont: font, labelSize: 22, stroke: css("--ink"), grid: lines, ticks: lines, values, ...(words ? { incrs: [1] } : {}) };
}
const room = (u, values) => Math.ceil(20 + 7 * Math.max(1, ...(values ?? []).map((v) => v.length)));
const scaleOf = (log) => ({ time: false, distr: log ? 3 : 1 });

// What is drawn beside the curves: cells of a map below them, lines that mark a value above them.
function edges(places, log) {
  if (log) return edges(places.map(Math.log)).map(Math.exp);
  const middles = places.slice(1).map((v, i) => (v + places[i]) / 2), n = places.length;
  return n < 2 ? [places[0] - 0.5, places[0] + 0.5] : [2 * places[0] - middles[0], ...middles, 2 * places[n - 1] - middles[n - 2]];
}
function cells(u, { x, y, z, low, high, diverging, log = [], shown = () => true }) {
  const colours = diverging ? COLOURS.diverging : COLOURS.rising;
  const across = edges(x, log[0]).map((v) => Math.round(u.valToPos(v, "x", true))), up = edges(y, log[1]).map((v) => Math.round(u.valToPos(v, "y", true)));
  u.ctx.save();
  u.ctx.beginPath();
  u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  u.ctx.clip();
  z.forEach((row, j) => row.forEach((value, i) => {
    if (value == null) return;
    u.ctx.globalAlpha = shown(j, i) ? 1 : 0.15;
    u.ctx.fillStyle = mixed(colours, (value - low) / (high - low || 1));
    u.ctx.fillRect(across[i], up[j + 1], across[i + 1] - across[i], up[j] - up[j + 1]);
  }));
  u.ctx.restore();
}
function marks(u, plot) {
  const { ctx, bbox } = u, pixel = devicePixelRatio;
  ctx.save();
  Object.assign(ctx, { strokeStyle: css("--faint"), fillStyle: css("--faint"), lineWidth: pixel, textAlign: "left", textBaseline: "alphabetic", font: `${11 * pixel}px system-ui, sans-serif` });
  ctx.setLineDash([4 * pixel, 4 * pixel]);
  for (const mark of plot.marks ?? []) {
    const upright = mark.x !== undefined, at = Math.round(u.valToPos(upright ? mark.x : mark.y, upright ? "x" : "y", true));
    const [from, to] = upright ? [bbox.left, bbox.left + bbox.width] : [bbox.top, bbox.top + bbox.height];
    if (!(at >= from && at <= to)) continue;
    ctx.beginPath();
    if (upright) { ctx.moveTo(at, bbox.top); ctx.lineTo(at, bbox.top + bbox.height); } else { ctx.moveTo(bbox.left, at); ctx.lineTo(bbox.left + bbox.width, at); }
    ctx.stroke();
    const width = ctx.measureText(mark.text).width + 4 * pixel;
    if (upright) ctx.fillText(mark.text, at + width > to ? at - width : at + 4 * pixel, bbox.top + 12 * pixel);
    else ctx.fillText(mark.text, bbox.left + bbox.width - width, at - 4 * pixel);
  }
  ctx.restore();
}
// Below a map: its colours, and the value of the cell that is pointed at.
function key(element, plot) {
  const { low, high, diverging, label, unit } = plot.map;
  const bar = document.createElement("span"), line = document.createElement("p"), read = document.createElement("span");
  bar.className = "bar";
  bar.style.background = `linear-gradient(to right, ${(diverging ? COLOURS.diverging : COLOURS.rising).join(",")})`;
  line.className = "key";
  line.append(`${label}: ${short(low, 3)} `, bar, ` ${told(high, unit, 3)}`, document.createElement("br"), read);
  element.append(line);
  return read;
}
function cellAt(u, { x, y, z, unit, label }, plot) {
  if (!(u.cursor.left >= 0)) return "\u00a0";
  const near = (places, v) => places.reduce((best, p, i) => (Math.abs(p - v) < Math.abs(places[best] - v) ? i : best), 0);
  const i = near(x, u.posToVal(u.cursor.left, "x")), j = near(y, u.posToVal(u.cursor.top, "y"));
  return `${nameOf(plot.x)} ${told(x[i], unitOf(plot.x))}, ${nameOf(plot.y)} ${told(y[j], unitOf(plot.y))}: ${label} ${told(z[j][i], unit, 4)}`;
}

function draw(element) {
  const plot = given(element), { map, log = "" } = plot;
  element.plot?.destroy();
  element.replaceChildren();
  const { data: table, series, bands } = map
    ? { data: [map.x, map.x.map((_, i) => map.y[i % map.y.length])], series: [{}, { paths: () => null, points: { show: false } }], bands: [] } : columns(plot);
  const whole = (places) => () => { const all = edges(places); return [all[0], all[all.length - 1]]; };
  let read = null;
  const hooks = {
    drawAxes: map ? [(u) => cells(u, map)] : [],
    draw: [(u) => marks(u, plot)],
    setCursor: [(u) => {
      if (read) read.textContent = cellAt(u, map, plot);
      tell(element, "pointed", u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null);
    }],
    setScale: [(u, name) => { if (name === "x" && element.dataset.settled) tell(element, "zoomed", [u.scales.x.min, u.scales.x.max]); }],
  };
  element.plot = new uPlot({
    width: element.clientWidth, height: innerWidth < 544 ? 260 : 310, series, bands, hooks, padding: [12, 14, 0, 0],
    scales: { x: map ? { time: false, range: whole(map.x) } : scaleOf(log.includes("x")), y: map ? { range: whole(map.y) } : scaleOf(log.includes("y")) },
    axes: [axisOf(plot.x, null, log.includes("x")), { ...axisOf(plot.y, null, log.includes("y")), size: room }],
    cursor: { y: Boolean(map), drag: { x: !map, y: false }, points: { size: 7 } }, legend: { show: !map },
  }, table, element);
  if (map) read = key(element, plot);
  for (const head of element.querySelectorAll(".u-legend th")) {
    head.tabIndex = 0;
    head.addEventListener("keydown", (event) => { if (event.key === "Enter") head.click(); });
  }
  requestAnimationFrame(() => { element.dataset.settled = "yes"; });
}
function tell(element, what, detail) { element.dispatchEvent(new CustomEvent(what, { detail })); }

// With the keyboard: arrows move the cursor, + and - zoom, Escape shows all.
function pressed(event, element) {
  const u = element.plot, { width } = u.over.getBoundingClientRect(), { min, max } = u.scales.x;
  const at = u.cursor.left >= 0 ? u.cursor.left : width / 2, step = event.shiftKey ? 0.1 : 0.01;
  const centre = u.posToVal(at, "x"), zoom = (by) => u.setScale("x", { min: centre - (centre - min) * by, max: centre + (max - centre) * by });
  const go = (by) => u.setCursor({ left: Math.min(Math.max(at + by * width, 0), width), top: 0 });
  const does = { ArrowLeft: () => go(-step), ArrowRight: () => go(step), "+": () => zoom(0.5), "-": () => zoom(2),
    Escape: () => u.setData(u.data) }[event.key];
  if (!does || event.ctrlKey || event.metaKey || event.altKey || event.target.closest(".u-legend")) return;
  event.preventDefault();
  does();
}
const plots = [...document.querySelectorAll("[data-plot]")];
const resized = new ResizeObserver((seen) => {
  for (const { target } of seen) {
    const { plot } = target;
    if (plot && plot.width !== target.clientWidth && target.clientWidth) plot.setSize({ width: target.clientWidth, height: plot.height });
  }
});
for (const element of plots) {
  draw(element);
  resized.observe(element);
  element.addEventListener("keydown", (event) => pressed(event, element));
}
dark.addEventListener("change", () => plots.forEach(draw));
