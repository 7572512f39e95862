// Runs of a batch: bounds on columns choose some, and every plot and table shows which.
const { numbers, columns: given_columns, over, kept } = data.own.runs;
const byName = Object.fromEntries(given_columns.map((column) => [column.name, column]));
const count = numbers.length, LISTED = 100;
let bounds = {}, chosen = new Uint8Array(count).fill(1), across = over, order = { name: null, down: false };
const all = Array.from({ length: count }, (_, i) => i);
const text = (column, value, digits = 5) => (value == null ? "–" : column.words ? column.words[value] : short(value, digits));
const elements = [...document.querySelectorAll("[data-linked]")];

// Which runs are chosen: those within all bounds.
function choose() {
  const limits = Object.entries(bounds).map(([name, [low, high]]) => [byName[name].values, low ?? -Infinity, high ?? Infinity]);
  chosen = Uint8Array.from(all, (i) => limits.every(([v, low, high]) => v[i] != null && v[i] >= low && v[i] <= high));
  show();
}
function bound(name, low, high) {
  bounds = { ...bounds, [name]: [low, high] };
  if (low == null && high == null) delete bounds[name];
}

// Plots. Runs: a point each, or a cell of a grid; shares: the part of the runs up to a value; time: what was kept.
const faint = () => css("--faint"), strong = () => css("--accent");
function dots(u, x, y) {
  const { ctx, bbox } = u, size = (count > 2000 ? 2 : 4) * devicePixelRatio;
  const some = chosen.includes(0);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  for (const [kind, colour, alpha, grown] of [[0, faint(), 0.25, 1], [1, strong(), some ? 1 : 0.6, some ? 1.4 : 1]]) {
    ctx.fillStyle = colour;
    ctx.globalAlpha = alpha;
    for (let i = 0; i < count; i++) {
      if (chosen[i] !== kind || x[i] == null || y[i] == null) continue;
      ctx.fillRect(u.valToPos(x[i], "x", true) - (size * grown) / 2, u.valToPos(y[i], "y", true) - (size * grown) / 2, size * grown, size * grown);
    }
  }
  ctx.restore();
}
function box(u, names) {
  const { ctx, bbox } = u, sides = names.map((name) => bounds[name]);
  if (!sides.some(Boolean)) return;
  const place = (k, v, other) => (v == null ? other : u.valToPos(v, k ? "y" : "x", true));
  const left = place(0, sides[0]?.[0], bbox.left), right = place(0, sides[0]?.[1], bbox.left + bbox.width);
  const low = place(1, sides[1]?.[0], bbox.top + bbox.height), high = place(1, sides[1]?.[1], bbox.top);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  Object.assign(ctx, { fillStyle: strong(), globalAlpha: 0.1 });
  ctx.fillRect(left, high, right - left, low - high);
  ctx.restore();
}
// The runs in the order of a column, with what does not change by choosing.
function ordered(column) {
  if (!column.ordered) {
    const runs = all.filter((i) => column.values[i] != null).sort((a, b) => column.values[a] - column.values[b]);
    column.ordered = { runs, x: strictly(runs.map((i) => column.values[i])), share: runs.map((_, k) => (k + 1) / runs.length) };
  }
  return column.ordered;
}
function shares(column) {
  const { runs, x, share } = ordered(column), total = runs.reduce((n, i) => n + chosen[i], 0);
  let seen = 0;
  return [x, share, runs.map((i) => (total ? (seen += chosen[i]) / total : null))];
}
function gridOf(column) {
  const [a, b] = across.map((name) => byName[name].values), x = [...new Set(a)].sort((p, q) => p - q), y = [...new Set(b)].sort((p, q) => p - q);
  const sums = y.map(() => x.map(() => [0, 0, 0])), at = (places) => new Map(places.map((v, i) => [v, i])), ix = at(x), iy = at(y);
  for (const i of all) {
    if (column.values[i] == null) continue;
    const cell = sums[iy.get(b[i])][ix.get(a[i])];
    cell[0] += column.values[i];
    cell[1] += 1;
    cell[2] += chosen[i];
  }
  const z = sums.map((row) => row.map(([sum, n]) => (n ? sum / n : null))), known = z.flat().filter((v) => v != null);
  const log = across.map((name) => Boolean(byName[name].log));
  return { x, y, z, low: Math.min(...known), high: Math.max(...known), label: column.name, unit: column.unit, log, shown: (j, i) => sums[j][i][2] > 0 };
}
function paths(u, { rows }) {
  const { ctx, bbox } = u, x = kept.time.map((t) => u.valToPos(t, "x", true)), some = chosen.includes(0);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.lineWidth = devicePixelRatio;
  for (const [kind, colour, alpha] of [[0, faint(), 0.12], [1, strong(), some ? 0.8 : 0.25]]) {
    Object.assign(ctx, { strokeStyle: colour, globalAlpha: alpha });
    rows.forEach((row, k) => {
      if (chosen[kept.places[k]] !== kind) return;
      ctx.beginPath();
      row.forEach((v, i) => { if (v != null) ctx.lineTo(x[i], u.valToPos(v, "y", true)); });
      ctx.stroke();
    });
  }
  ctx.restore();
}
const ends = (values) => {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v != null) { low = Math.min(low, v); high = Math.max(high, v); }
  return [low, high];
};
const padded = (column) => () => {
  const [low, high] = ends(column.values), pad = 0.04 * (high - low || Math.abs(high) || 1);
  return column.log ? [low / 1.05, high * 1.05] : [low - pad, high + pad];
};
function build(element) {
  const kind = element.dataset.linked, column = byName[kind === "time" ? across[0] : element.dataset.column];
  const x = kind === "runs" ? byName[across[0]] : column, map = kind === "runs" && across.length === 2 ? gridOf(column) : null;
  const y = map ? byName[across[1]] : column, hooks = { draw: [], drawAxes: [], setSelect: [], setCursor: [] };
  const scale = (c) => ({ ...scaleOf(c.log), range: padded(c) }), whole = (places, log) => () => { const e = edges(places, log); return [e[0], e[e.length - 1]]; };
  let scales = { x: scale(x), y: scale(y) }, table = [[], []], series = [{}, { paths: () => null, points: { show: false } }], names = [x.name, y.name];
  let axes = [axisOf(x.label, x.words, x.log), { ...axisOf(y.label, y.words, y.log), size: room }];
  if (kind === "time") {
    const quantity = kept.quantities.find(({ name }) => name === element.dataset.column);
    const [low, high] = ends(quantity.rows.flat()), pad = 0.05 * (high - low || 1);
    names = [];
    scales = { x: { time: false, range: () => [kept.time[0], kept.time[kept.time.length - 1]] }, y: { range: () => [low - pad, high + pad] } };
    axes = [axisOf("t, s"), { ...axisOf(quantity.label), size: room }];
    hooks.draw.push((u) => paths(u, quantity));
    table = [kept.time, kept.time.map(() => low)];
  } else if (kind === "shares") {
    names = [x.name];
    scales.y = { range: () => [0, 1] };
    axes[1] = { ...axisOf("share of the runs"), size: room };
    table = shares(column);
    const line = (label, stroke, width) => ({ label, stroke, width, pxAlign: 0, points: { show: false }, paths: uPlot.paths.stepped({ align: 1 }) });
    series = [{}, line("all", faint(), 1.4), line("chosen", strong(), 2)];
    hooks.draw.push((u) => box(u, names));
  } else if (map) {
    scales = { x: { ...scaleOf(x.log), range: whole(map.x, x.log) }, y: { ...scaleOf(y.log), range: whole(map.y, y.log) } };
    hooks.drawAxes.push((u) => cells(u, gridOf(column)));
    hooks.draw.push((u) => box(u, names));
    table = [map.x, map.x.map((_, i) => map.y[i % map.y.length])];
  } else {
    hooks.draw.push((u) => dots(u, x.values, y.values), (u) => box(u, names));
    table = [[...x.values].filter((v) => v != null).sort((a, b) => a - b).slice(0, 2), [null, null]];
  }
  hooks.setSelect.push((u) => {
    const { left, top, width, height } = u.select, at = (place, name) => u.posToVal(place, name);
    if (width < 3) return;
    bound(names[0], at(left, "x"), at(left + width, "x"));
    if (names[1] && height > 3) bound(names[1], at(top + height, "y"), at(top, "y"));
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    choose();
  });
  let read = element.nextElementSibling;
  hooks.setCursor.push((u) => { read.textContent = near(u, kind, x, y, map) || "\u00a0"; });
  element.plot?.destroy();
  element.replaceChildren();
  const drag = { x: names.length > 0, y: names.length > 1, setScale: false };
  element.plot = new uPlot({ width: element.clientWidth, height: 260, series, scales, axes, hooks, padding: [12, 14, 0, 0],
    legend: { show: false }, cursor: { y: kind !== "shares" && kind !== "time", drag, points: { show: false } } }, table, element);
  if (map) read = key(element, { map });
  element.plot.over.addEventListener("dblclick", () => { names.forEach((name) => delete bounds[name]); choose(); });
}
// What stands at the cursor, with units.
function near(u, kind, x, y, map) {
  const { left, top } = u.cursor;
  if (!(left >= 0)) return "";
  if (map) return cellAt(u, map, { x: x.label, y: y.label });
  if (kind === "time") return told(u.posToVal(left, "x"), "s", 4);
  if (kind === "shares") {
    const value = u.posToVal(left, "x"), up = (is) => all.filter((i) => is(i) && x.values[i] != null), part = (runs) => runs.filter((i) => x.values[i] <= value).length / runs.length;
    const some = up((i) => chosen[i]), percent = (v) => (Number.isNaN(v) ? "–" : `${short(100 * v, 3)} %`);
    return `up to ${told(value, x.unit, 4)}: ${percent(part(up(() => true)))} of all, ${percent(part(some))} of those chosen`;
  }
  let best = -1, least = 15 ** 2;
  for (const i of all) {
    if (x.values[i] == null || y.values[i] == null) continue;
    const apart = (u.valToPos(x.values[i], "x") - left) ** 2 + (u.valToPos(y.values[i], "y") - top) ** 2;
    if (apart < least) { least = apart; best = i; }
  }
  const said = (column) => `${column.name} ${text(column, column.values[best])}${column.unit ? `\u00a0${column.unit}` : ""}`;
  return best < 0 ? "" : `run ${numbers[best]}: ${[...new Set([...given_columns.filter((c) => c.kind === "axis").slice(0, 3), x, y])].map(said).join(", ")}`;
}

// Tables: bounds of each column, and the runs that are chosen.
function cell(row, content, kind = "") {
  const made = row.insertCell();
  made.className = kind;
  made.append(content);
  return made;
}
function field(column, side, label) {
  const make = column.words ? "select" : "input", made = document.createElement(make);
  made.setAttribute("aria-label", `${column.name} ${label}`);
  if (column.words) made.append(...["", ...column.words].map((word, i) => new Option(word, i ? i - 1 : "")));
  else Object.assign(made, { type: "number", step: "any" });
  made.addEventListener("change", () => {
    const own = [...(bounds[column.name] ?? [null, null])];
    own[side] = made.value === "" ? null : Number(made.value);
    bound(column.name, ...own);
    choose();
  });
  return made;
}
const fields = [];
for (const column of given_columns) {
  const row = document.querySelector("#bounds tbody").insertRow(), pair = [field(column, 0, "at least"), field(column, 1, "at most")];
  const [low, high] = ends(column.values);
  if (!column.words) [low, high].forEach((v, side) => { pair[side].placeholder = short(v, 4); });
  fields.push([column, pair]);
  cell(row, column.name);
  pair.forEach((each) => cell(row, each));
  cell(row, column.unit);
  if (column.kind !== "metric") { cell(row, ""); continue; }
  const tenth = document.createElement("button");
  Object.assign(tenth, { type: "button", textContent: "Best tenth" });
  tenth.setAttribute("aria-label", `Best tenth by ${column.name}`);
  tenth.addEventListener("click", () => {
    const sorted = column.values.filter((v) => v != null).sort((a, b) => a - b), more = column.better === "more";
    const k = Math.max(0, Math.ceil(sorted.length / 10) - 1);
    bound(column.name, more ? sorted[sorted.length - 1 - k] : null, more ? null : sorted[k]);
    choose();
  });
  cell(row, tenth);
}
function list() {
  const head = document.querySelector("#rows thead"), body = document.querySelector("#rows tbody");
  const runs = all.filter((i) => chosen[i]), key = order.name && byName[order.name].values;
  if (key) runs.sort((a, b) => ((key[a] ?? Infinity) - (key[b] ?? Infinity)) * (order.down ? -1 : 1));
  head.replaceChildren();
  body.replaceChildren();
  const titles = head.insertRow();
  for (const column of [null, ...given_columns]) {
    const made = document.createElement("th"), button = document.createElement("button");
    Object.assign(made, { scope: "col", className: "number" });
    if (!column) made.append("run");
    else {
      Object.assign(button, { type: "button", className: "sort", textContent: `${column.label}${order.name === column.name ? (order.down ? " ↓" : " ↑") : ""}` });
      if (order.name === column.name) made.setAttribute("aria-sort", order.down ? "descending" : "ascending");
      button.addEventListener("click", () => { order = { name: column.name, down: order.name === column.name && !order.down }; list(); });
      made.append(button);
    }
    titles.append(made);
  }
  for (const i of runs.slice(0, LISTED)) {
    const row = body.insertRow();
    cell(row, String(numbers[i]), "number");
    given_columns.forEach((column) => cell(row, text(column, column.values[i]), "number"));
  }
  if (runs.length > LISTED) cell(body.insertRow(), `and ${runs.length - LISTED} more`).colSpan = given_columns.length + 1;
}
function show() {
  const total = chosen.reduce((n, v) => n + v, 0);
  document.getElementById("chosen").textContent = `${total} of ${count} runs chosen`;
  for (const [column, pair] of fields) pair.forEach((each, side) => { const v = bounds[column.name]?.[side]; each.value = v == null ? "" : column.words ? v : Number(v.toPrecision(6)); });
  for (const element of elements) {
    if (element.dataset.linked === "shares") element.plot.setData(shares(byName[element.dataset.column]), false);
    element.plot.redraw(false);
  }
  list();
}
const select = document.getElementById("over");
select.value = over[0];
select.addEventListener("change", () => { across = [select.value]; elements.forEach(build); show(); });
document.getElementById("all").addEventListener("click", () => { bounds = {}; choose(); });
document.getElementById("save").addEventListener("click", () => {
  const rows = all.filter((i) => chosen[i]).map((i) => [numbers[i], ...given_columns.map((c) => (c.words ? c.words[c.values[i]] : c.values[i] ?? ""))]);
  download("runs", [["run", ...given_columns.map((c) => (c.unit ? `${c.name} [${c.unit}]` : c.name))], ...rows]);
});
elements.forEach(build);
const wider = new ResizeObserver((seen) => seen.forEach(({ target }) => {
  if (target.plot.width !== target.clientWidth && target.clientWidth) target.plot.setSize({ width: target.clientWidth, height: 260 });
}));
elements.forEach((element) => wider.observe(element));
dark.addEventListener("change", () => { elements.forEach(build); show(); });
show();
