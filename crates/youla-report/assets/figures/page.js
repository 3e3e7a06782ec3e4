// What every page does once its figures are drawn.

for (const node of document.querySelectorAll("[data-method]")) node.style.setProperty("--c", `var(${methodOf(node.dataset.method).style.colour})`);
for (const node of document.querySelectorAll("[data-swatch]")) node.innerHTML = (node.closest(".key") ? keySwatch : swatch)(methodOf(node.dataset.swatch).style);

const redrawAll = () => figures.forEach(figure => figure.draw());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawAll);

// On paper all is unfolded, and figures are drawn for its width.
const folded = [...document.querySelectorAll("details")];
let opened = [];
addEventListener("beforeprint", () => {
  opened = folded.filter(part => !part.open);
  opened.forEach(part => { part.open = true; });
  document.documentElement.classList.add("printing");
  redrawAll();
});
addEventListener("afterprint", () => {
  opened.forEach(part => { part.open = false; });
  document.documentElement.classList.remove("printing");
  redrawAll();
});

// The part in view is marked in the list of parts.
const entries = new Map([...document.querySelectorAll("nav a")].map(link => [link.getAttribute("href").slice(1), link]));
const visible = new Set();
const watcher = new IntersectionObserver(changes => {
  for (const { target, isIntersecting } of changes) isIntersecting ? visible.add(target.id) : visible.delete(target.id);
  const first = [...entries.keys()].find(id => visible.has(id));
  for (const [id, link] of entries) id === first ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current");
}, { rootMargin: "-10% 0px -60% 0px" });
for (const part of document.querySelectorAll("section")) if (entries.has(part.id)) watcher.observe(part);
