// The whole page: figures in their places, colours of methods in tables, theme, paper, the part in view.

for (const host of document.querySelectorAll("[data-figure]")) {
  const figures = page.figures.filter((_, k) => page.hosts[k] === host.dataset.figure);
  if (figures.length) show(host, figures);
}
for (const node of document.querySelectorAll("[data-method]")) node.style.setProperty("--c", `var(${styleOf(node.dataset.method).colour})`);
for (const node of document.querySelectorAll("[data-swatch]")) node.innerHTML = swatch(node.dataset.swatch, node.closest(".key") ? { line: true, dots: true } : { line: true });
// A line of the verdict leads nowhere where the run has no such part.
for (const link of document.querySelectorAll(".evidence")) if (!document.querySelector(link.hash)) link.remove();

const redrawAll = () => mounted.forEach(drawing => drawing.draw());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawAll);

// On paper all is unfolded, and figures are drawn for its width.
let opened = [], away = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  away = [...document.querySelectorAll("[data-with][hidden]")];
  for (const part of opened) part.open = true;
  for (const part of away) part.hidden = false;
  document.documentElement.classList.add("printing");
  redrawAll();
});
addEventListener("afterprint", () => {
  for (const part of opened) part.open = false;
  for (const part of away) part.hidden = true;
  document.documentElement.classList.remove("printing");
  redrawAll();
});

// The part in view is marked in the list of parts.
const entries = new Map([...document.querySelectorAll("nav a")].map(link => [link.getAttribute("href").slice(1), link])), visible = new Set();
const watcher = new IntersectionObserver(changes => {
  for (const { target, isIntersecting } of changes) isIntersecting ? visible.add(target.id) : visible.delete(target.id);
  const first = [...entries.keys()].find(id => visible.has(id));
  for (const [id, link] of entries) id === first ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current");
}, { rootMargin: "-10% 0px -60% 0px" });
for (const part of document.querySelectorAll("section")) if (entries.has(part.id)) watcher.observe(part);
