"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const report = read("report-data"), { looks, least } = read("report-looks");
  const chart = document.getElementById("chart"), select = document.getElementById("quantity");
  const hidden = new Set();
  const SVG = "http://www.w3.org/2000/svg";
  let pinned = null;

  const make = (name, attributes, parent, text) => {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    if (parent) parent.append(node);
    return node;
  };
  const percent = (value) => {
    if (value === 0) return "0";
    return value >= 1e-3 ? `${(value * 100).toFixed(2)}%` : value.toExponential(1);
  };
  const seconds = (value) => {
    if (value >= 99.95) return `${Math.round(value).toLocaleString("en")} s`;
    const [size, unit] = value >= 0.0999 ? [1, "s"] : value >= 0.999e-4 ? [1e-3, "ms"] : [1e-6, "µs"];
    return `${Number((value / size).toPrecision(3))} ${unit}`;
  };
  const tick = (value) => (value >= 0.99e-4 ? `${Number((value * 100).toPrecision(3))}%` : value.toExponential(0));

  const errorOf = (run, name) => {
    const value = name === "" ? run.sound_error : run.errors[name];
    return value === null || value === undefined ? null : Math.abs(value);
  };

  const axis = (low, high, start, end) => {
    const at = (value) => {
      const share = Math.log(Math.min(Math.max(value, low), high) / low) / Math.log(high / low);
      return start + share * (end - start);
    };
    const first = Math.floor(Math.log10(low)), last = Math.ceil(Math.log10(high)), ticks = [];
    const stride = Math.max(1, Math.floor((last - first) / (Math.abs(end - start) < 400 ? 4 : 9)));
    for (let power = first; power <= last; power += stride)
      for (const step of last - first > 3 ? [1] : [1, 2, 5]) {
        const value = Number(`${step}e${power}`);
        if (value * 1.0001 >= low && value <= high * 1.0001) ticks.push(value);
      }
    return { at, ticks, low, high };
  };
  const spread = (values, start, end, floor) => {
    const least = Math.min(...values), most = Math.max(...values), decades = Math.log10(most / least);
    const margin = 10 ** Math.max(0.08 * decades, 0.08, 0.5 * (0.5 - decades));
    return axis(floor === undefined ? least / margin : floor, most * margin, start, end);
  };

  const frontOf = (points) => {
    let best = Infinity;
    const order = [...points].sort((a, b) => a.run.cpu_seconds - b.run.cpu_seconds || a.error - b.error);
    return order.filter((point) => point.error < best && ((best = point.error), true));
  };

  const mark = (kind, x, y, s) => {
    if (kind === "circle") return `M${x - s} ${y}a${s} ${s} 0 1 0 ${2 * s} 0a${s} ${s} 0 1 0 ${-2 * s} 0z`;
    const corners = {
      square: [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
      triangle: [[0, -1.2], [1.1, 0.8], [-1.1, 0.8]],
      diamond: [[0, -1.3], [1.3, 0], [0, 1.3], [-1.3, 0]],
    }[kind];
    return `M${corners.map(([a, b]) => `${x + s * a} ${y + s * b}`).join("L")}z`;
  };

  const tip = document.createElement("div");
  tip.id = "tip";
  tip.setAttribute("role", "status");
  tip.hidden = true;

  const rowOf = (number) => document.querySelector(`#runs tr[data-run="${number}"]`);
  const hide = () => {
    tip.hidden = true;
    document.querySelectorAll("tr.marked").forEach((row) => row.classList.remove("marked"));
  };
  const show = (point, name) => {
    hide();
    const run = point.run, largest = `${percent(run.largest_error)} largest error, of ${run.largest_of}`;
    const lines = [name === "" ? largest : `${percent(point.error)} ${name}`];
    if (name === "" && point.error > run.largest_error) lines.push(`${percent(point.error)} by its basis or step alone`);
    const of = name === "" ? run.largest_of : name;
    for (const [part, label] of [["truncation", "of that, basis"], ["time", "of that, step"]])
      if (run[part] && run[part][of] !== undefined && run[part][of] !== null)
        lines.push(`${label}: ${percent(Math.abs(run[part][of]))}`);
    lines.push(`CPU ${seconds(run.cpu_seconds)}, wall ${seconds(run.wall_seconds)}`);
    lines.push(`${run.coordinates.toLocaleString("en")} coordinates${run.steps === null ? "" : `, ${run.steps.toLocaleString("en")} steps`}`);
    lines.push(run.scheme);
    tip.replaceChildren(Object.assign(document.createElement("strong"), { textContent: `${point.number + 1}  ${run.name}` }));
    for (const line of lines) tip.append(Object.assign(document.createElement("span"), { textContent: line }));
    tip.hidden = false;
    const left = point.x > chart.clientWidth / 2 ? point.x - tip.offsetWidth - 14 : point.x + 14;
    tip.style.left = `${Math.min(Math.max(0, left), Math.max(0, chart.clientWidth - tip.offsetWidth))}px`;
    tip.style.top = `${Math.max(0, point.y - tip.offsetHeight / 2)}px`;
    rowOf(point.number)?.classList.add("marked");
  };

  const places = (points) => {
    const taken = points.map(({ x, y }) => [x - 4, y - 4, x + 4, y + 4]), found = new Map();
    const meets = (a) => taken.some((b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]);
    for (const point of [...points].sort((a, b) => b.front - a.front)) {
      const width = 8 * String(point.number + 1).length;
      const boxes = [[6, -15], [-6 - width, -15], [6, 4], [-6 - width, 4]]
        .map(([dx, dy]) => [point.x + dx, point.y + dy, point.x + dx + width, point.y + dy + 11]);
      const box = boxes.find((one) => !meets(one)) ?? (point.front ? boxes[0] : undefined);
      if (box === undefined) continue;
      found.set(point, box);
      taken.push(box);
    }
    return found;
  };

  const grid = (svg, across, up, box) => {
    for (const value of across.ticks) {
      const x = across.at(value);
      make("line", { class: "grid", x1: x, x2: x, y1: box.top, y2: box.bottom }, svg);
      make("text", { x, y: box.bottom + 18, "text-anchor": "middle" }, svg, seconds(value));
    }
    for (const value of up.ticks) {
      const y = up.at(value);
      make("line", { class: "grid", x1: box.left, x2: box.right, y1: y, y2: y }, svg);
      make("text", { x: box.left - 7, y: y + 4, "text-anchor": "end" }, svg, tick(value));
    }
    make("text", { class: "title", x: (box.left + box.right) / 2, y: box.bottom + 40, "text-anchor": "middle" }, svg, "CPU time of a run");
  };

  const draw = () => {
    const name = select.value, width = Math.max(280, chart.clientWidth), small = width < 600;
    const height = Math.min(520, small ? width : width * 0.5);
    const box = { left: 62, right: width - 12, top: 28, bottom: height - 48 };
    const all = report.runs.map((run, number) => ({ run, number, error: errorOf(run, name) })).filter((p) => p.error !== null);
    const shown = all.filter((point) => !hidden.has(point.run.scheme));
    const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": `Error over CPU time of ${shown.length} runs` });
    svg.dataset.quantity = name;
    chart.replaceChildren(svg, tip);
    pinned = null;
    hide();
    if (!all.length) {
      make("text", { class: "title", x: width / 2, y: height / 2, "text-anchor": "middle" }, svg, "No run has an error of it");
      return;
    }
    // Axes stay as they are while schemes are hidden.
    const seen = all.map((point) => point.error).filter((error) => error >= least);
    const floor = seen.length ? Math.min(...seen) / 3 : least;
    const beside = report.runs.map((run, number) => ({ run, number }))
      .filter(({ run }) => run.kind === "nodal" && run.largest_error === null && run.result === "FINISHED" && !hidden.has(run.scheme));
    const across = spread([...all, ...beside].map((p) => Math.max(p.run.cpu_seconds, 1e-9)), box.left, box.right);
    const up = spread(all.map((p) => Math.max(p.error, floor)), box.bottom, box.top, floor);
    grid(svg, across, up, box);
    const label = name === "" ? "largest error of a run, its basis or step" : `error: ${name}`;
    make("text", { class: "title", x: 4, y: 15 }, svg, label);
    const tolerance = report.choice?.tolerance;
    if (tolerance !== undefined && tolerance > up.low && tolerance < up.high) {
      const y = up.at(tolerance);
      make("line", { class: "tolerance", x1: box.left, x2: box.right, y1: y, y2: y }, svg);
      make("text", { class: "tolerance", x: box.right, y: y - 4, "text-anchor": "end" }, svg, `tolerance ${tick(tolerance)}`);
    }
    for (const { run, number } of beside) {
      const x = across.at(Math.max(run.cpu_seconds, 1e-9)), left = x > width / 2;
      const group = make("g", { class: "reference" }, svg);
      make("line", { x1: x, x2: x, y1: box.top, y2: box.bottom }, group);
      make("text", { x: x + (left ? -6 : 6), y: box.top + 10, "text-anchor": left ? "end" : "start" }, group, `${number + 1}: reference, ${seconds(run.cpu_seconds)}`);
    }
    for (const point of shown) {
      point.x = across.at(Math.max(point.run.cpu_seconds, 1e-9));
      point.y = up.at(Math.max(point.error, floor));
      point.front = false;
    }
    const front = frontOf(shown);
    for (const point of front) point.front = true;
    make("polyline", { class: "front", points: front.map((p) => `${p.x},${p.y}`).join(" ") }, svg);
    for (const point of shown) {
      const look = looks[point.run.scheme], hollow = point.error < least;
      const text = `${point.number + 1}: ${point.run.name}, error ${percent(point.error)}, ${seconds(point.run.cpu_seconds)}`;
      const group = make("g", { class: "point", tabindex: 0, role: "img", "aria-label": text }, svg);
      group.dataset.run = point.number;
      if (point.front) group.dataset.front = "true";
      if (report.choice?.run === point.run.name) group.classList.add("chosen");
      make("path", { d: mark(look.mark, point.x, point.y, small ? 4 : 5), fill: hollow ? "#fff" : look.colour, stroke: look.colour }, group);
      group.addEventListener("pointerenter", () => show(point, name));
      group.addEventListener("pointerleave", () => (pinned ? show(pinned, name) : hide()));
      group.addEventListener("focus", () => show(point, name));
      group.addEventListener("blur", () => (pinned ? show(pinned, name) : hide()));
      group.addEventListener("click", (event) => {
        event.stopPropagation();
        pinned = pinned === point ? null : point;
        if (pinned) show(point, name);
        else hide();
      });
    }
    for (const [point, at] of places(shown))
      make("text", { class: point.front ? "number best" : "number", x: at[0], y: at[3] - 1, fill: looks[point.run.scheme].colour }, svg, point.number + 1);
  };

  const take = () => {
    const found = /^#q=(.*)$/.exec(location.hash);
    let wanted = "";
    try { wanted = found ? decodeURIComponent(found[1]) : ""; } catch { wanted = ""; }
    select.value = [...select.options].some((option) => option.value === wanted) ? wanted : "";
    draw();
  };

  const sortable = (table) => {
    const body = table.tBodies[0];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      // A real button would be missing where a printed page repeats the heading.
      const button = document.createElement("span");
      button.tabIndex = 0;
      button.setAttribute("role", "button");
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        button.click();
      });
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const value = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
        const compare = (a, b) => {
          const [x, y] = [value(a), value(b)];
          if (x === "" || y === "") return (x === "") - (y === "");
          const order = isNaN(x) || isNaN(y) ? x.localeCompare(y) : x - y;
          return down ? -order : order;
        };
        body.append(...[...body.rows].sort(compare));
      });
    });
  };

  document.documentElement.classList.add("scripted");
  for (const button of document.querySelectorAll("ul.legend button")) {
    button.disabled = false;
    button.addEventListener("click", () => {
      const scheme = button.dataset.scheme, off = !hidden.delete(scheme);
      if (off) hidden.add(scheme);
      button.setAttribute("aria-pressed", String(!off));
      draw();
    });
  }
  document.querySelectorAll("table.sortable").forEach(sortable);
  select.addEventListener("change", () => { location.hash = select.value === "" ? "" : `q=${encodeURIComponent(select.value)}`; });
  window.addEventListener("hashchange", take);
  document.addEventListener("click", () => { pinned = null; hide(); });
  let width = chart.clientWidth;
  window.addEventListener("resize", () => { if (chart.clientWidth !== width) { width = chart.clientWidth; draw(); } });
  take();
  document.documentElement.dataset.points = chart.querySelectorAll(".point").length;
})();
