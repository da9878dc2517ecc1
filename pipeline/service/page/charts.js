// Charts as SVG: spectrum with error bars, curves over time, provenance, MAC matrix.

const SVG = "http://www.w3.org/2000/svg";

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  return filled(made, attributes, children);
}

export function drawn(name, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, name), attributes, children);
}

function filled(made, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "style") made.style.cssText = value; // The page's policy allows no style in markup.
    else if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

export function short(number) {
  if (number === null || number === undefined) return "";
  const size = Math.abs(number);
  const digits = Number(number.toPrecision(5));
  return size !== 0 && (size >= 1e5 || size < 1e-3) ? digits.toExponential() : String(digits);
}

const PREFIXES = [[1e-15, "f"], [1e-12, "p"], [1e-9, "n"], [1e-6, "µ"], [1e-3, "m"], [1, ""], [1e3, "k"], [1e6, "M"], [1e9, "G"]];
const PREFIXED = new Set(["m", "s", "N", "Pa", "J", "W", "V", "A", "Hz", "m/s", "N m", "N s", "N m s", "N/m"]);

// The factor and the name by which values of a unit up to a size are written: 0.004 m in mm, 2e8 Pa in MPa.
export function fitting(size, unit) {
  if (!PREFIXED.has(unit) || !(Math.abs(size) > 0) || !Number.isFinite(size)) return [1, unit];
  const [factor, prefix] = PREFIXES.findLast(([least]) => Math.abs(size) >= 0.9999 * least) ?? PREFIXES[0];
  return [factor, prefix + unit];
}

// A label that ends with a unit in brackets gets the one that fits, of logarithms none.
function scaled(label, [low, high]) {
  const parts = /^(.*) \[([^\]]+)\]$/.exec(label ?? "");
  if (!parts || label.startsWith("log")) return [1, label];
  const [factor, unit] = fitting(Math.max(Math.abs(low), Math.abs(high)), parts[2]);
  return [factor, `${parts[1]} [${unit}]`];
}

function ticks(low, high, count = 5) {
  const raw = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= raw);
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-9; value += step) found.push(value);
  return found;
}

// Units of a chart are pixels, so that its texts can be read in a narrow window.
export const WIDE = () => Math.min(620, Math.max(340, window.innerWidth - 30));

export function framed(width, height, x, y, labels) {
  const left = 64, bottom = height - 34;
  const svg = drawn("svg", { class: "chart", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": labels.title });
  const placeX = (value) => left + ((value - x[0]) / (x[1] - x[0] || 1)) * (width - left - 26);
  const placeY = (value) => bottom - ((value - y[0]) / (y[1] - y[0] || 1)) * (bottom - 18);
  const [unitX, labelX] = labels.marks ? [1, labels.x] : scaled(labels.x, x), [unitY, labelY] = scaled(labels.y, y);
  for (const value of ticks(y[0] / unitY, y[1] / unitY)) {
    svg.append(drawn("line", { class: "grid", x1: left, x2: width - 26, y1: placeY(unitY * value), y2: placeY(unitY * value) }));
    svg.append(drawn("text", { x: left - 6, y: placeY(unitY * value) + 4, "text-anchor": "end" }, short(value)));
  }
  const named = labels.marks ?? ticks(x[0] / unitX, x[1] / unitX).map((value) => [unitX * value, short(value)]);
  let end = -Infinity; // Of the text before: none lies on another one.
  for (const [value, text] of named) {
    if (placeX(value) - 3.2 * text.length < end) continue;
    svg.append(drawn("text", { x: placeX(value), y: bottom + 15, "text-anchor": "middle" }, text));
    end = placeX(value) + 3.2 * text.length + 4;
  }
  svg.append(drawn("path", { class: "axis", d: `M${left} 16V${bottom}H${width - 26}` }));
  svg.append(drawn("text", { x: (left + width) / 2, y: height - 4, "text-anchor": "middle" }, labelX));
  svg.append(drawn("text", { x: 12, y: 9, "text-anchor": "start", dy: 2 }, labelY));
  return { svg, placeX, placeY };
}

export function spectrum(found, pick) {
  const modes = found.frequencies.slice(0, found.normal_count);
  const top = Math.max(...modes) * 1.06 || 1;
  const { svg, placeX, placeY } = framed(WIDE(), 240, [0.2, modes.length + 0.8], [0, top], { x: "mode", y: "frequency [Hz], bar: estimated error of the mesh", title: "spectrum" });
  modes.forEach((frequency, mode) => {
    const error = found.discretisation_errors?.[mode], x = placeX(mode + 1), y = placeY(frequency);
    const group = drawn("g", { class: "bar", "data-mode": mode, onclick: () => pick(mode) });
    if (error) {
      const end = placeY(frequency * (1 - error));
      group.append(drawn("path", { stroke: "var(--bad)", "stroke-width": 1.5, fill: "none", d: `M${x} ${y}V${end}M${x - 4} ${end}h8` }));
    }
    group.append(drawn("circle", { cx: x, cy: y, r: 4, fill: "var(--accent)" }));
    group.append(drawn("title", {}, `mode ${mode + 1}: ${short(frequency)} Hz${error ? `, error ${(100 * error).toPrecision(2)} %` : ""}`));
    svg.append(group);
  });
  return svg;
}

// Error over run time of the runs of a report, both on logarithmic axes.
export function scatter(rows) {
  const seen = rows.filter((row) => row.seconds > 0 && row.error > 0);
  if (!seen.length) return element("p", { class: "faint" }, "no run has an error");
  const range = (values) => [Math.floor(Math.min(...values)), Math.ceil(Math.max(...values) + 1e-9)];
  const x = seen.map((row) => Math.log10(row.seconds)), y = seen.map((row) => Math.log10(row.error));
  const { svg, placeX, placeY } = framed(WIDE(), 260, range(x), range(y), { x: "log₁₀ of CPU time [s]", y: "log₁₀ of the largest relative error", title: "error over run time" });
  seen.forEach((row, at) => svg.append(drawn("circle", { cx: placeX(x[at]), cy: placeY(y[at]), r: 4, fill: "var(--accent)", "fill-opacity": 0.75 }, drawn("title", {}, `${row.name}: ${short(row.seconds)} s, error ${short(row.error)}`))));
  return svg;
}

export const COLOURS = [1, 2, 3, 4, 5, 6].map((n) => `var(--curve-${n})`);

export function curves(times, series, labels) {
  const values = series.flatMap((one) => one.values);
  const low = Math.min(0, ...values), high = Math.max(0, ...values) || 1;
  const { svg, placeX, placeY } = framed(WIDE(), 240, [0, times.at(-1) || 1], [low, high], labels);
  let legend = 110;
  series.forEach((one, index) => {
    const line = one.values.map((value, at) => `${at ? "L" : "M"}${placeX(times[at]).toFixed(1)} ${placeY(value).toFixed(1)}`).join("");
    svg.append(drawn("path", { d: line, fill: "none", stroke: COLOURS[index % COLOURS.length], "stroke-width": 1.3 }));
    svg.append(drawn("text", { x: legend, y: 11, style: `fill:${COLOURS[index % COLOURS.length]}` }, one.name));
    legend += 7 * one.name.length + 14;
  });
  return svg;
}

// A finished study is a report of its own.
export const kindOf = (row) => (row.kind === "report" && row.uses.some((use) => use[1] === "study") ? "study" : row.kind);

// Scenes stand before the records that they begin with: those that are made from no other record.
function withScenes(found) {
  const made = new Set(found.edges.map((edge) => edge[1])), first = found.records.filter((row) => !made.has(row.key) && row.uses.length);
  const names = [...new Set(first.flatMap((row) => row.uses.map((use) => use[0])))].slice(0, 4);
  const scenes = names.map((name) => ({ key: `scene ${name}`, kind: "scene", scene: name, uses: [[name]] }));
  const edges = first.flatMap((row) => scenes.filter((scene) => row.uses.some((use) => use[0] === scene.scene)).map((scene) => [scene.key, row.key]));
  return { records: [...scenes, ...found.records], edges: [...edges, ...found.edges] };
}

export function graph(related, here, open, search) {
  const found = withScenes(related);
  const level = {}, below = new Map(found.records.map((row) => [row.key, []]));
  for (const [target, one] of found.edges) below.get(one)?.push(target);
  const depth = (key) => (level[key] ??= 1 + Math.max(-1, ...below.get(key).map(depth)));
  const columns = [];
  for (const row of found.records) (columns[depth(row.key)] ??= []).push(row);
  const filledColumns = columns.filter(Boolean), height = 16 + 46 * Math.max(...filledColumns.map((one) => one.length));
  const wide = 150, place = new Map();
  const width = Math.max(filledColumns.length * (wide + 40), 420);
  const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": "provenance", style: `max-width:${1.1 * width}px;min-width:${0.85 * width}px` });
  filledColumns.forEach((rows, column) => rows.forEach((row, index) => place.set(row.key, [8 + column * (wide + 40), 8 + 46 * index])));
  for (const [target, one] of found.edges) {
    const [x1, y1] = place.get(target), [x2, y2] = place.get(one);
    svg.append(drawn("path", { class: "axis", d: `M${x1 + wide} ${y1 + 18}C${x1 + wide + 20} ${y1 + 18} ${x2 - 20} ${y2 + 18} ${x2} ${y2 + 18}` }));
  }
  for (const row of found.records) {
    const go = () => (row.scene ? search(row.scene) : open(row.key));
    const [x, y] = place.get(row.key), uses = row.uses.map((use) => use.join(", "))[0] ?? row.key.slice(0, 12);
    const node = drawn("g", { class: row.key === here ? "node here" : "node", tabindex: 0, role: "link", "data-key": row.key, transform: `translate(${x} ${y})`,
      onclick: go, onkeydown: (event) => event.key === "Enter" && go() });
    node.append(drawn("rect", { width: wide, height: 36, rx: 4 }), drawn("text", { x: 8, y: 15, style: "font-weight:600" }, kindOf(row)), drawn("text", { x: 8, y: 29 }, uses.slice(0, 22)), drawn("title", {}, `${row.kind} ${row.key}`));
    svg.append(node);
  }
  return svg;
}

export function matrix(found, pick) {
  const rows = found.mac.length, columns = found.mac[0]?.length ?? 0, cell = Math.max(6, Math.min(18, 420 / Math.max(rows, columns)));
  const svg = drawn("svg", { viewBox: `0 0 ${60 + columns * cell} ${36 + rows * cell}`, role: "img", "aria-label": "MAC matrix", style: `max-width:${1.4 * (60 + columns * cell)}px` });
  found.mac.forEach((line, row) => line.forEach((value, column) => {
    const made = drawn("rect", { x: 44 + column * cell, y: 20 + row * cell, width: cell, height: cell, fill: "var(--accent)", "fill-opacity": value, stroke: "var(--line)", "stroke-width": 0.4, onclick: () => pick(row, column) });
    made.append(drawn("title", {}, `mode ${row + 1} and mode ${column + 1}: MAC ${value.toFixed(3)}`));
    svg.append(made);
  }));
  for (const [count, put] of [[rows, (n) => ({ x: 38, y: 20 + (n + 0.75) * cell, "text-anchor": "end" })], [columns, (n) => ({ x: 44 + (n + 0.5) * cell, y: 14, "text-anchor": "middle" })]]) {
    const step = Math.ceil(14 / cell);
    for (let n = 0; n < count; n += step) svg.append(drawn("text", put(n), String(n + 1)));
  }
  return svg;
}
