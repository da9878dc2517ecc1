"use strict";
(() => {
  const select = document.getElementById("quantity"), runs = document.getElementById("runs").tBodies[0];
  const charts = [...document.querySelectorAll(".chart")];
  const tip = Object.assign(document.createElement("div"), { id: "tip", hidden: true });
  tip.setAttribute("role", "status");
  let pinned = null;
  const drawn = (one) => one.getClientRects().length > 0; // Of a chart's two widths one is shown.

  // Marks a run in chart and table; the tip stands at its point in the chart that is shown.
  const mark = (run) => {
    document.querySelectorAll(".marked").forEach((one) => one.classList.remove("marked"));
    tip.hidden = true;
    if (run === null) return;
    const chart = charts.find((one) => !one.hidden);
    const point = [...chart.querySelectorAll(`.point[data-run="${run}"]`)].find(drawn);
    for (const one of [...chart.querySelectorAll(`[data-run="${run}"]`), ...runs.querySelectorAll(`tr[data-run="${run}"]`)])
      one.classList.add("marked");
    if (!point || point.classList.contains("off")) return;
    chart.append(tip);
    tip.replaceChildren(...point.dataset.lines.split("\n").map((line, number) =>
      Object.assign(document.createElement(number ? "span" : "strong"), { textContent: line })));
    tip.hidden = false;
    const box = chart.getBoundingClientRect(), at = point.getBoundingClientRect();
    const x = at.x + at.width / 2 - box.x + chart.scrollLeft, y = at.y + at.height / 2 - box.y;
    const left = x > chart.scrollLeft + box.width / 2 ? x - tip.offsetWidth - 14 : x + 14;
    tip.style.left = `${Math.max(0, left)}px`;
    tip.style.top = `${Math.max(0, y - tip.offsetHeight / 2)}px`;
  };
  for (const one of [...document.querySelectorAll(".point"), ...runs.rows]) {
    const run = one.dataset.run, title = one.querySelector(":scope > title");
    if (title) one.dataset.lines = title.textContent;
    title?.remove();
    for (const event of ["pointerenter", "focus"]) one.addEventListener(event, () => mark(run));
    for (const event of ["pointerleave", "blur"]) one.addEventListener(event, () => mark(pinned));
    one.addEventListener("click", (event) => {
      event.stopPropagation();
      runs.closest("details").open = true;
      mark(pinned = pinned === run ? null : run);
    });
  }
  document.addEventListener("click", () => mark(pinned = null));

  const show = () => {
    let wanted = "";
    try { wanted = decodeURIComponent(/^#q=(.*)$/.exec(location.hash)?.[1] ?? ""); } catch { /* names nothing */ }
    select.value = charts.some((chart) => chart.dataset.quantity === wanted) ? wanted : "";
    for (const chart of charts) chart.hidden = chart.dataset.quantity !== select.value;
    mark(pinned);
  };
  select.addEventListener("change", () => { location.hash = select.value === "" ? "" : `q=${encodeURIComponent(select.value)}`; });
  window.addEventListener("hashchange", show);

  for (const button of document.querySelectorAll("ul.legend button")) {
    button.disabled = false;
    button.addEventListener("click", () => {
      const off = button.getAttribute("aria-pressed") === "true";
      button.setAttribute("aria-pressed", String(!off));
      for (const one of document.querySelectorAll("[data-scheme]"))
        if (one.dataset.scheme === button.dataset.hides) one.classList.toggle("off", off);
    });
  }

  const sort = (body, head, column) => {
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentNode.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const value = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
    body.append(...[...body.rows].sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === "" || y === "") return (x === "") - (y === "");
      return (isNaN(x) || isNaN(y) ? x.localeCompare(y) : x - y) * (down ? -1 : 1);
    }));
  };
  for (const table of document.querySelectorAll("table.sortable"))
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      // A real button would be missing where a printed page repeats the heading.
      const button = Object.assign(document.createElement("span"), { tabIndex: 0 });
      button.setAttribute("role", "button");
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => sort(table.tBodies[0], head, column));
      button.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        button.click();
      });
    });
  document.documentElement.classList.add("scripted");
  show();
  document.documentElement.dataset.points = [...document.querySelectorAll(".point")].filter(drawn).length;
})();
