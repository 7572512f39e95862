// Claims of one verdict alone, or all of them; printed, all are open.
const claims = [...document.querySelectorAll(".claim")], buttons = [...document.querySelectorAll("[data-verdict]")];
for (const button of buttons) {
  button.addEventListener("click", () => {
    const { verdict } = button.dataset;
    for (const claim of claims) claim.hidden = Boolean(verdict) && claim.dataset.is !== verdict;
    for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
  });
}
window.addEventListener("beforeprint", () => claims.forEach((claim) => { claim.open = true; }));
