const data = JSON.parse(document.getElementById("data").textContent);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Downloads: the data of a plot as CSV, two columns for each curve, three for a map.
function table(plot) {
  const { map } = plot;
  if (map) return [[plot.x, plot.y, `${map.label} [${map.unit}]`], ...map.z.flatMap((row, j) => row.map((v, i) => [map.x[i], map.y[j], v ?? ""]))];
  const heads = plot.traces.flatMap((t) => [plot.x, `${t.name} [${plot.y}]`]), rows = [heads];
  const longest = Math.max(...plot.traces.map((t) => t.x.length));
  for (let i = 0; i < longest; i++) rows.push(plot.traces.flatMap((t) => [t.x[i] ?? "", t.y[i] ?? ""]));
  return rows;
}
function download(name, rows) {
  const text = rows.map((row) => row.map((v) => (typeof v === "string" && v ? JSON.stringify(v) : v)).join(",")).join("\n");
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([`${text}\n`], { type: "text/csv" }));
  link.download = `${name}.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
for (const button of document.querySelectorAll("[data-download]")) {
  const plot = data.plots[Number(button.dataset.download)];
  button.addEventListener("click", () => download(plot.name, table(plot)));
}
