"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Plots: drawn at once, drawn again when the colours change.
const given = (element) => data.plots[Number(element.dataset.plot)];
function lines(trace) {
  const colour = trace.colour === "#000000" ? css("--ink") : trace.colour;
  const line = { x: trace.x, y: trace.y, name: trace.name, mode: "lines", line: { width: 1.6, color: colour, dash: trace.dash } };
  if (!trace.low) return [line];
  const edge = { x: trace.x, mode: "lines", line: { width: 0 }, showlegend: false, hoverinfo: "skip" };
  return [{ ...edge, y: trace.low }, { ...edge, y: trace.high, fill: "tonexty", fillcolor: `${trace.colour}33` }, line];
}
function draw(element) {
  const plot = given(element);
  const axis = (title) => ({ title: { text: title }, gridcolor: css("--line"), zerolinecolor: css("--line"), automargin: true });
  const spike = { showspikes: true, spikemode: "across", spikethickness: 1, spikedash: "solid", spikecolor: css("--faint") };
  const layout = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: css("--ink") },
    margin: { l: 50, r: 10, t: plot.traces.length > 1 ? 60 : 16, b: 40 },
    xaxis: { ...axis(plot.x), ...(plot.cursor ? spike : {}) }, yaxis: { ...axis(plot.y), hoverformat: ".5~g" },
    hovermode: "x unified", hoverlabel: { bgcolor: css("--paper") }, showlegend: plot.traces.length > 1,
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
  };
  return Plotly.react(element, plot.traces.flatMap(lines), layout, { responsive: true, displaylogo: false, displayModeBar: false });
}
const plots = [...document.querySelectorAll(".plot")];
plots.forEach(draw);
dark.addEventListener("change", () => plots.forEach(draw));

// The common cursor: plots over the same time show the same moment and the same part of it.
const timed = plots.filter((element) => given(element).cursor);
const slider = document.getElementById("cursor");
if (slider && timed.length) {
  const near = new Set();
  const ends = timed.flatMap((element) => given(element).traces.flatMap((t) => [t.x[0], t.x[t.x.length - 1]]));
  let moment = null, telling = false;
  const show = (element) => {
    telling = true;
    Plotly.Fx.hover(element, { xval: moment }, "xy");
    telling = false;
  };
  const move = (t, from) => {
    moment = t;
    slider.value = t;
    slider.nextElementSibling.textContent = `${Number(t).toPrecision(4)} s`;
    near.forEach((element) => { if (element !== from) show(element); });
  };
  slider.min = Math.min(...ends);
  slider.max = Math.max(...ends);
  slider.step = (slider.max - slider.min) / 1000;
  slider.value = slider.min;
  slider.parentElement.hidden = false;
  slider.addEventListener("input", () => move(Number(slider.value), null));
  const watch = new IntersectionObserver((seen) => {
    for (const each of seen) {
      if (each.isIntersecting) near.add(each.target); else near.delete(each.target);
      if (each.isIntersecting && moment !== null) show(each.target);
    }
  });
  let following = false;
  for (const element of timed) {
    watch.observe(element);
    element.on("plotly_hover", (event) => { if (!telling) move(event.points[0].x, element); });
    element.on("plotly_relayout", (change) => {
      const range = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
      if (following || (range[0] === undefined && !change["xaxis.autorange"])) return;
      following = true;
      const part = range[0] === undefined ? { "xaxis.autorange": true } : { "xaxis.range": range };
      Promise.all(timed.filter((e) => e !== element).map((e) => Plotly.relayout(e, part))).then(() => { following = false; });
    });
  }
  const asked = /#t=([-+.\deE]+)$/.exec(location.hash);
  if (asked) setTimeout(() => move(Number(asked[1]), null), 100);
}

// Downloads: the data of a plot as CSV, two columns for each curve.
for (const button of document.querySelectorAll("[data-download]")) {
  button.addEventListener("click", () => {
    const plot = data.plots[Number(button.dataset.download)];
    const heads = plot.traces.flatMap((t) => [plot.x, `${t.name} [${plot.y}]`]);
    const rows = [heads.map((s) => JSON.stringify(s)).join(",")];
    const longest = Math.max(...plot.traces.map((t) => t.x.length));
    for (let i = 0; i < longest; i++) rows.push(plot.traces.flatMap((t) => [t.x[i] ?? "", t.y[i] ?? ""]).join(","));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([rows.join("\n") + "\n"], { type: "text/csv" }));
    link.download = `${plot.name}.csv`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}
