// The ride: every part of the scene is placed from the samples at the time of the slider.
const ride = data.own;
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
