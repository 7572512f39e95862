// Scenes: each figure reads its clips, numbers of shapes over time, and draws what `strokes.py` draws of a moment.
for (const figure of document.querySelectorAll("figure.scene:not([data-live])")) {
  figure.dataset.live = "yes";
  const scene = JSON.parse(figure.querySelector("script").textContent);
  const { box, unit, between, wheel, arrow, apart } = scene;
  const find = (name) => figure.querySelector(name);
  const button = find("button"), slider = find("input"), shown = find("output");
  const pace = find("select[data-pace]"), chosen = find("select[data-clip]");
  const scale = 800 / (box[2] - box[0]);
  const put = (x, y) => `${((x - box[0]) * scale).toFixed(2)},${((box[3] - y) * scale).toFixed(2)}`;
  const line = (points, end = "") => `M${points.map(([x, y]) => put(x, y)).join("L")}${end}`;
  const circle = (x, y, r) => {
    const s = (r * scale).toFixed(2), d = (2 * r * scale).toFixed(2);
    return `M${put(x - r, y)}a${s},${s} 0 1,0 ${d},0a${s},${s} 0 1,0 -${d},0Z`;
  };
  const turned = ([x, y], angle, [a, b]) =>
    [x + Math.cos(angle) * a - Math.sin(angle) * b, y + Math.sin(angle) * a + Math.cos(angle) * b];
  const pairs = (v) => Array.from({ length: v.length / 2 }, (_, k) => [v[2 * k], v[2 * k + 1]]);

  // Columns of numbers: constant, or 16 bits between two bounds.
  const unpacked = (column) => {
    if (typeof column === "number") return column;
    const bytes = Uint8Array.from(atob(column.data), (c) => c.charCodeAt(0));
    return Float64Array.from(new Uint16Array(bytes.buffer), (k) => column.low + k * column.step);
  };
  const at = (column, k) => {
    if (typeof column === "number") return column;
    const place = Math.min(Math.max(k, 0), column.length - 1), i = Math.floor(place);
    return i + 1 < column.length ? column[i] + (place - i) * (column[i + 1] - column[i]) : column[i];
  };
  const clips = scene.clips.map((clip) => ({ ...clip, columns: clip.columns.map(unpacked), way: unpacked(clip.way),
    road: clip.road && { ...clip.road, heights: unpacked(clip.road.heights) } }));
  let clip = clips[0], now = clip.start, playing = false, last = 0, told = 0;

  // What a shape is drawn of: [class, path, width of a line].
  const draw = {
    ground(v, shape, way) {
      let points;
      const road = clip.road;
      if (road && shape.note) {
        points = Array.from({ length: 201 }, (_, k) => box[0] + ((box[2] - box[0]) * k) / 200)
          .map((x) => [x, at(road.heights, (x + way - road.start) / road.step)]);
      } else {
        const given = pairs(v.slice(0, -1)).sort((a, b) => a[0] - b[0]);
        const inside = given.map(([x, y]) => [Math.min(Math.max(x, box[0]), box[2]), y]);
        points = [[box[0], given[0][1]], ...inside, [box[2], given[given.length - 1][1]]];
      }
      const depth = v[v.length - 1], ticks = [];
      const below = depth ? [...points].reverse().map(([x, y]) => [x, y - depth]) : [[box[2], box[1]], [box[0], box[1]]];
      for (let k = Math.floor((box[0] + way) / apart) + 1; k <= Math.floor((box[2] + way) / apart); k++) {
        const x = k * apart - way, i = points.findIndex((p) => p[0] >= x), [a, b] = [points[Math.max(i - 1, 0)], points[i]];
        const y = (b[0] > a[0] ? a[1] + ((x - a[0]) / (b[0] - a[0])) * (b[1] - a[1]) : b[1]) - (depth ? 0 : 0.5 * unit);
        ticks.push(line([[x, y], depth ? [x, y - depth] : [x - 0.7 * unit, y - unit]]));
      }
      return [["earth", line([...points, ...below], "Z")], ["surface", line(points) + ticks.join("")]];
    },
    between(v, shape) {
      const [x, y] = [v[2] - v[0], v[3] - v[1]], length = Math.hypot(x, y) || 1;
      const width = v[4] || 2 * unit, across = [(-y / length) * width, (x / length) * width];
      const path = between[shape.kind].map((points) => line(points.map(
        ([part, aside]) => [v[0] + part * x + aside * across[0], v[1] + part * y + aside * across[1]]))).join("");
      return shape.kind === "bar" ? draw.thick(path, v[4] || 0.6 * unit) : [["line", path]];
    },
    thick: (path, width) => [["edge", path, width * scale + 2.4], ["thick", path, width * scale]],
    arrow(v) {
      const length = Math.hypot(v[2], v[3]);
      if (length < arrow.short * unit) return [["thick", ""], ["area", ""]];
      const along = [v[2] / length, v[3] / length], head = Math.min(arrow.head * unit, 0.6 * length);
      const end = [v[0] + v[2], v[1] + v[3]], foot = [end[0] - head * along[0], end[1] - head * along[1]];
      const side = (head * arrow.half) / arrow.head;
      const corners = [end, [foot[0] - side * along[1], foot[1] + side * along[0]], [foot[0] + side * along[1], foot[1] - side * along[0]]];
      return [["thick", line([[v[0], v[1]], foot]), 0.22 * unit * scale], ["area", line(corners, "Z")]];
    },
    disc: (v) => [["area", circle(v[0], v[1], v[2] || 0.5 * unit)]],
    wheel(v, shape, way) {
      const angle = shape.note !== "rolls" ? v[3] : v[2] ? -way / v[2] : 0;
      const spokes = Array.from({ length: wheel.spokes }, (_, k) => angle + (2 * Math.PI * k) / wheel.spokes)
        .map((turn) => line([wheel.from, wheel.to].map((part) => turned(v, turn, [part * v[2], 0]))));
      return [...wheel.rings.map(([part, rim]) => [rim ? "rim" : "area", circle(v[0], v[1], part * v[2])]), ["line", spokes.join("")]];
    },
    polygon(v, shape) {
      const [x, y, angle, width] = v.slice(-4), corners = pairs(v.slice(0, -4)).map((p) => turned([x, y], angle, p));
      return shape.note === "line" ? draw.thick(line([...corners, corners[0]]), width || 0.5 * unit) : [["area", line(corners, "Z")]];
    },
  };

  // One group for each shape, one path for each of its strokes.
  const groups = scene.shapes.map((shape) => {
    const group = document.createElementNS("http://www.w3.org/2000/svg", "g");
    group.style.setProperty("--paint", `var(--scene-${shape.colour})`);
    return group;
  });
  find("svg").replaceChildren(...groups);
  function place(t) {
    now = t;
    const span = clip.end - clip.start, k = span ? ((t - clip.start) / span) * (clip.frames - 1) : 0;
    const way = at(clip.way, k);
    let first = 0;
    scene.shapes.forEach((shape, i) => {
      const v = Array.from({ length: shape.size }, (_, j) => at(clip.columns[first + j], k));
      first += shape.size;
      const seen = !shape.when || v.pop() > 0;
      groups[i].style.display = seen ? "" : "none";
      if (!seen) return;
      const strokes = (draw[shape.kind] || draw.between)(v, shape, way);
      while (groups[i].childNodes.length < strokes.length) {
        groups[i].appendChild(document.createElementNS("http://www.w3.org/2000/svg", "path"));
      }
      strokes.forEach(([kind, path, width], j) => {
        const each = groups[i].childNodes[j];
        each.setAttribute("class", kind);
        each.setAttribute("d", path);
        if (width) each.style.strokeWidth = `${width.toFixed(2)}px`;
      });
    });
    slider.value = t;
    shown.textContent = `${t.toPrecision(4)} s`;
    slider.setAttribute("aria-valuetext", shown.textContent);
  }
  let telling = false;
  const tell = () => {
    telling = true;
    if (scene.linked) document.dispatchEvent(new CustomEvent("asked", { detail: now }));
    telling = false;
  };

  function step(stamp) {
    if (!playing || !figure.isConnected) return;
    const t = now + (Math.min((stamp - last) / 1000, 0.1) * Number(pace.value));
    last = stamp;
    if (t < clip.end) place(t);
    else if (clip.loop) place(clip.start + ((t - clip.start) % (clip.end - clip.start)));
    else { place(clip.end); play(false); }
    if (stamp - told > 120 || !playing) { told = stamp; tell(); }
    requestAnimationFrame(step);
  }
  function play(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (now >= clip.end) place(clip.start);
    requestAnimationFrame((stamp) => { last = stamp; step(stamp); });
  }
  function take(k) {
    clip = clips[k];
    [slider.min, slider.max, slider.step] = [clip.start, clip.end, (clip.end - clip.start) / 1000 || 1];
    pace.replaceChildren(...clip.paces.map((each) => new Option(`${each} ×`, each, each === clip.pace, each === clip.pace)));
    place(clip.start);
  }
  take(0);
  const asked = scene.linked && /#t=([\d.]+)$/.exec(location.hash);
  if (asked || scene.begin !== null) place(Math.min(Math.max(asked ? Number(asked[1]) : scene.begin, clip.start), clip.end));
  button.addEventListener("click", () => { play(!playing); tell(); });
  slider.addEventListener("input", () => { play(false); place(Number(slider.value)); tell(); });
  if (chosen) chosen.addEventListener("change", () => take(Number(chosen.value)));
  if (scene.linked) {
    document.addEventListener("moment", (event) => {
      if (telling) return;
      play(false);
      place(Math.min(Math.max(event.detail, clip.start), clip.end));
    });
  }
  if (scene.linked && location.hash === "#play") play(true);
}
