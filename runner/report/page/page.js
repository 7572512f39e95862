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
