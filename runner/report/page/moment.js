// The common moment: plots over the same time show the same one and the same part of it; others hear of it, `moment`,
// and ask for one, `asked`.
{
  const timed = plots.filter((element) => given(element).cursor);
  const slider = document.getElementById("cursor");
  if (slider && timed.length) {
    const ends = timed.flatMap((element) => given(element).traces.flatMap((t) => [t.x[0], t.x[t.x.length - 1]]));
    const range = { min: Math.min(...ends), max: Math.max(...ends) };
    let moment = null;
    const place = ({ plot }) => plot.setCursor({ left: moment === null ? -10 : plot.valToPos(moment, "x"), top: 0 }, false);
    const move = (t, from) => {
      moment = t;
      slider.value = t;
      slider.nextElementSibling.textContent = told(t, "s", digitsOf(range) - 1);
      slider.setAttribute("aria-valuetext", slider.nextElementSibling.textContent);
      timed.forEach((element) => { if (element !== from) place(element); });
      document.dispatchEvent(new CustomEvent("moment", { detail: t }));
    };
    Object.assign(slider, { ...range, step: (range.max - range.min) / 1000, value: range.min });
    slider.parentElement.hidden = false;
    slider.addEventListener("input", () => move(Number(slider.value), null));
    document.addEventListener("asked", ({ detail }) => move(detail, null));
    for (const element of timed) {
      element.addEventListener("pointed", ({ detail }) => { if (detail === null) place(element); else move(detail, element); });
      element.addEventListener("zoomed", ({ detail: [min, max] }) => {
        for (const { plot } of timed) if (plot.scales.x.min !== min || plot.scales.x.max !== max) plot.setScale("x", { min, max });
        if (moment !== null) place(element);
      });
    }
    const asked = /#t=([-+.\deE]+)$/.exec(location.hash);
    if (asked) requestAnimationFrame(() => move(Number(asked[1]), null));
  }
}
