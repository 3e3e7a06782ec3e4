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

// A table that is wider than its place says so.
const roomy = new ResizeObserver(changes => changes.forEach(({ target }) => target.classList.toggle("more", target.scrollWidth > target.clientWidth + 1)));
for (const part of document.querySelectorAll(".scroll")) roomy.observe(part);

// On paper settings are unfolded, and figures are drawn for its width.
let folded = [];
const turn = part => part.toggleAttribute(part.matches("details") ? "open" : "hidden"), paper = printing => {
  if (printing) folded = [...document.querySelectorAll("details:not([open]):has(pre), [data-with][hidden]")];
  folded.forEach(turn);
  document.documentElement.classList.toggle("printing", printing);
  redrawAll();
};
addEventListener("beforeprint", () => paper(true));
addEventListener("afterprint", () => paper(false));

// The part in view is marked in the list of parts.
const entries = new Map([...document.querySelectorAll("nav a")].map(link => [link.getAttribute("href").slice(1), link])), visible = new Set();
const watcher = new IntersectionObserver(changes => {
  for (const { target, isIntersecting } of changes) isIntersecting ? visible.add(target.id) : visible.delete(target.id);
  const first = [...entries.keys()].find(id => visible.has(id));
  for (const [id, link] of entries) id === first ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current");
}, { rootMargin: "-10% 0px -60% 0px" });
for (const part of document.querySelectorAll("section")) if (entries.has(part.id)) watcher.observe(part);
