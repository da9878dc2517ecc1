// A study: quantities over parameters with their stated errors, and its table.

import { COLOURS, WIDE, drawn, element, framed, short } from "./charts.js";

const ROWS = 500;
const FINISHED = "FINISHED";
const number = (value) => typeof value === "number";

export function study(place, found, open) {
  const { heads, rows, parameters } = found, at = (name) => heads.indexOf(name), result = at("result");
  const counts = {};
  for (const row of rows) counts[row[result]] = (counts[row[result]] ?? 0) + 1;
  const varied = parameters.filter((name) => new Set(rows.map((row) => JSON.stringify(row[at(name)]))).size > 1);
  const quantities = heads.slice(result + 2, at("energy drift")).filter((head) => !head.includes(" error [") && !head.startsWith("relative error by ") && rows.some((row) => number(row[at(head)])));
  const spread = (head) => new Set(rows.map((row) => row[at(head)]).filter(number)).size > 1;
  const preferred = [/force_peak \[/, /impulse \[/].map((one) => quantities.find((head) => one.test(head) && spread(head))).find(Boolean) ?? quantities.find(spread) ?? quantities[0];
  place.append(element("h3", {}, `study of ${found.scene}`), element("p", {}, `${rows.length} designs: ${Object.entries(counts).map(([name, count]) => `${count} ${name}`).join(", ")}`));
  const chosen = (id, names, value, empty) => {
    const made = element("select", { id, onchange: () => redraw() }, ...(empty ? [element("option", { value: "" }, empty)] : []), ...names.map((name) => element("option", { value: name }, name)));
    made.value = value ?? "";
    return made;
  };
  const over = chosen("study-over", parameters, varied[0] ?? parameters[0]), quantity = chosen("study-quantity", quantities, preferred);
  const lines = chosen("study-lines", varied, varied[1], "nothing"), picture = element("div", {}), all = element("input", { id: "study-all", type: "checkbox", onchange: () => listed() }), below = element("div", { class: "scroll", tabindex: 0 });
  function redraw() {
    picture.replaceChildren(chart(found, { over: over.value, quantity: quantity.value, lines: lines.value === over.value ? "" : lines.value }, open));
    listed();
  }
  function listed() {
    const shown = all.checked ? heads : ["design", ...parameters, "result", ...[quantity.value, errorOf(quantity.value)].filter((head) => heads.includes(head)), "reason"];
    const link = (row) => (row[at("key")] ? element("button", { type: "button", class: "link", "aria-label": `run of design ${row[0]}`, onclick: () => open(row[at("key")]) }, "run") : "");
    const cell = (row, head) => element("td", { class: number(row[at(head)]) ? "number" : ["reason", "notes"].includes(head) && row[at(head)] ? "long" : null }, written(row[at(head)]));
    below.replaceChildren(element("table", { class: "wide" },
      element("thead", {}, element("tr", {}, element("th", {}, ""), ...shown.map((head) => element("th", {}, head)))),
      element("tbody", {}, ...rows.slice(0, ROWS).map((row) => element("tr", {}, element("td", {}, link(row)), ...shown.map((head) => cell(row, head)))))));
    if (rows.length > ROWS) below.append(element("p", { class: "faint" }, `and ${rows.length - ROWS} more, in study.csv`));
  }
  place.append(element("div", { class: "controls" }, element("label", {}, "quantity ", quantity), element("label", {}, "over ", over), element("label", {}, "a line for each ", lines)),
    picture, element("div", { class: "controls" }, element("label", {}, all, " all columns")), below);
  redraw();
}

const errorOf = (head) => head.replace(/ \[([^[]*)\]$/, " error [$1]");
const written = (value) => (number(value) ? short(value) : value === null ? "" : typeof value === "string" ? value : JSON.stringify(value));

function chart({ heads, rows }, { over, quantity, lines }, open) {
  const at = (name) => heads.indexOf(name), x = at(over), y = at(quantity), error = at(errorOf(quantity)), result = at("result");
  const numeric = rows.every((row) => number(row[x])), names = numeric ? null : [...new Set(rows.map((row) => written(row[x])))];
  // A few decades, as 0.01, 0.1, 1: on a logarithmic axis.
  const values = numeric ? [...new Set(rows.map((row) => row[x]))].sort((one, other) => one - other) : [], [low, high] = [values[0], values.at(-1)];
  const log = low > 0 && high / low > 30 && values[values.length >> 1] ** 2 < Math.sqrt(low * high) * (low + high) / 2;
  const placed = (row) => (!numeric ? names.indexOf(written(row[x])) : log ? Math.log10(row[x]) : row[x]);
  const marked = values.length <= 8 ? values : values.filter((_, n) => n % Math.ceil(values.length / 6) === 0);
  const marks = names?.map((name, n) => [n, name.slice(0, 18)]) ?? (log ? marked.map((value) => [Math.log10(value), short(value)]) : undefined);
  const done = rows.filter((row) => row[result] === FINISHED && number(row[y]));
  if (!done.length) return element("p", { class: "faint" }, "no design has this quantity");
  const range = (values, share) => {
    const low = Math.min(...values), high = Math.max(...values), margin = (high - low || Math.abs(high) || 1) * share;
    return [low - margin, high + margin];
  };
  const stated = (row) => (error >= 0 && number(row[error]) ? row[error] : 0);
  const { svg, placeX, placeY } = framed(WIDE(), 280, range(rows.map(placed), 0.05), range(done.flatMap((row) => [row[y] - stated(row), row[y] + stated(row)]), 0.06),
    { x: over, y: quantity, title: "quantity over parameter", marks });
  const groups = new Map();
  for (const row of done) {
    const group = lines ? written(row[at(lines)]) : "";
    groups.set(group, [...(groups.get(group) ?? []), row]);
  }
  // What else varies would join points that do not belong together.
  const joined = groups.size <= COLOURS.length && [...groups.values()].every((group) => new Set(group.map(placed)).size === group.length);
  const legend = element("p", { class: "legend" });
  [...groups].forEach(([name, group], index) => {
    const colour = COLOURS[index % COLOURS.length];
    group.sort((one, other) => placed(one) - placed(other));
    if (joined) svg.append(drawn("path", { fill: "none", stroke: colour, "stroke-width": 1.3, d: group.map((row, n) => `${n ? "L" : "M"}${placeX(placed(row)).toFixed(1)} ${placeY(row[y]).toFixed(1)}`).join("") }));
    for (const row of group) svg.append(point(row, [placeX(placed(row)), placeY(row[y]), placeY(row[y] - stated(row)), placeY(row[y] + stated(row))], colour, { heads, quantity, over, open, error: stated(row) }));
    if (lines && groups.size <= COLOURS.length) legend.append(element("span", { style: `color:${colour}` }, `● ${lines.split(".").at(-1)} ${name}`), " ");
  });
  const failed = rows.filter((row) => row[result] !== FINISHED);
  for (const row of failed) {
    const place = placeX(placed(row));
    svg.append(drawn("path", { stroke: "var(--bad)", "stroke-width": 1.6, d: `M${place - 4} 236l8 8m0-8l-8 8` }, drawn("title", {}, `design ${row[0]}: ${row[result]} ${row[result + 1] ?? ""}`)));
  }
  if (failed.length) legend.append(element("span", { class: "bad" }, `× without result: ${failed.length}`));
  return element("div", {}, svg, legend);
}

function point(row, [x, y, low, high], colour, { heads, quantity, over, open, error }) {
  const key = row[heads.indexOf("key")], text = `design ${row[0]}: ${over} ${written(row[heads.indexOf(over)])}, ${quantity} ${written(row[heads.indexOf(quantity)])}${error ? ` ± ${short(error)}` : ""}`;
  const group = drawn("g", { class: "bar", role: "link", tabindex: 0, "aria-label": text, onclick: () => key && open(key), onkeydown: (event) => event.key === "Enter" && key && open(key) });
  if (error) group.append(drawn("path", { stroke: colour, "stroke-width": 1, fill: "none", d: `M${x} ${low}V${high}M${x - 3} ${low}h6M${x - 3} ${high}h6` }));
  group.append(drawn("circle", { cx: x, cy: y, r: 4, fill: colour }), drawn("title", {}, text));
  return group;
}
