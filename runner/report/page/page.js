"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Plots: drawn when they come near the screen, drawn again when the colours change.
function draw(element) {
  const plot = data.plots[Number(element.dataset.plot)];
  const traces = plot.traces.map((t) => ({ x: t.x, y: t.y, name: t.name, mode: "lines", line: { width: 1.6, color: t.colour } }));
  const axis = (title) => ({ title: { text: title }, gridcolor: css("--line"), zerolinecolor: css("--line"), automargin: true });
  const layout = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: css("--ink") },
    margin: { l: 50, r: 10, t: 60, b: 40 }, xaxis: axis(plot.x), yaxis: axis(plot.y), hovermode: "x unified",
    hoverlabel: { bgcolor: css("--paper") }, legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
  };
  Plotly.react(element, traces, layout, { responsive: true, displaylogo: false, displayModeBar: false });
}
const plots = [...document.querySelectorAll(".plot")];
plots.forEach(draw);
dark.addEventListener("change", () => plots.forEach(draw));

// Downloads: the data of a plot as CSV, one column for each curve.
for (const button of document.querySelectorAll("[data-download]")) {
  button.addEventListener("click", () => {
    const plot = data.plots[Number(button.dataset.download)];
    const rows = [[plot.x, ...plot.traces.map((t) => `${t.name} [${plot.y}]`)].map((s) => JSON.stringify(s)).join(",")];
    plot.traces[0].x.forEach((x, i) => rows.push([x, ...plot.traces.map((t) => t.y[i])].join(",")));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([rows.join("\n") + "\n"], { type: "text/csv" }));
    link.download = `${plot.name}.csv`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}

// The ride: every part of the scene is placed from the samples at the time of the slider.
const ride = data.ride;
if (ride) {
  const byId = (id) => document.getElementById(id);
  const slider = byId("time"), shown = byId("shown"), button = byId("play");
  const SCALE = 90, GROUND = 230, MIDDLE = 400, RADIUS = 0.31, REST = 0.95;
  let playing = false, last = 0, now = 0;
  const sample = (values, t) => {
    const k = Math.min(Math.max(t / ride.step, 0), values.length - 1), i = Math.floor(k), f = k - i;
    return values[i] * (1 - f) + values[Math.min(i + 1, values.length - 1)] * f;
  };
  const height = (x) => {
    const k = (x - ride.road_start) / ride.road_step;
    if (k <= 0) return ride.road[0];
    if (k >= ride.road.length - 1) return ride.road[ride.road.length - 1];
    const i = Math.floor(k);
    return ride.road[i] * (1 - (k - i)) + ride.road[i + 1] * (k - i);
  };
  function place(t) {
    now = t;
    const x0 = ride.start + ride.speed * t, px = (x) => MIDDLE + SCALE * x, py = (z) => GROUND - SCALE * z;
    let path = "";
    for (let i = 0; i <= 160; i++) {
      const x = -4.45 + (8.9 * i) / 160;
      path += `${i ? "L" : "M"}${px(x).toFixed(1)},${py(height(x0 + x)).toFixed(1)}`;
    }
    byId("road").setAttribute("d", `${path}L800,300L0,300Z`);
    const heave = sample(ride.heave, t), pitch = sample(ride.pitch, t);
    byId("hull").setAttribute("transform",
      `translate(${MIDDLE},${py(REST + heave).toFixed(2)}) rotate(${((pitch * 180) / Math.PI).toFixed(3)})`);
    ride.axles.forEach((axle, i) => {
      const z = sample(axle.height, t), x = px(axle.ahead), y = py(RADIUS + z);
      byId(`wheel${i}`).setAttribute("transform", `translate(${x},${y.toFixed(2)}) rotate(${((ride.speed * t) / RADIUS) * 57.3 % 360})`);
      const top = py(REST - 0.12 + heave - axle.ahead * pitch);
      let spring = `M${x},${y.toFixed(1)}`;
      for (let k = 1; k <= 7; k++) spring += `L${x + (k % 2 ? 7 : -7)},${(y + ((top - y) * k) / 8).toFixed(1)}`;
      byId(`spring${i}`).setAttribute("d", `${spring}L${x},${top.toFixed(1)}`);
    });
    byId("flash").setAttribute("opacity", sample(ride.force, t) > 0.05 * ride.peak ? 1 : 0);
    slider.value = t;
    shown.textContent = `${t.toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", shown.textContent);
  }
  function step(stamp) {
    if (!playing) return;
    const t = now + Math.min((stamp - last) / 1000, 0.1);
    last = stamp;
    place(t > ride.end ? 0 : t);
    requestAnimationFrame(step);
  }
  function play(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (on) requestAnimationFrame((stamp) => { last = stamp; step(stamp); });
  }
  button.addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { play(false); place(Number(slider.value)); });
  const asked = /#t=([\d.]+)/.exec(location.hash);
  place(asked ? Math.min(Number(asked[1]), ride.end) : 0);
  if (location.hash === "#play") play(true);
}
document.documentElement.dataset.ready = "yes";
