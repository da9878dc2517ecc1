// The raw tree of a record's HDF5 file, as h5grove tells it: groups that unfold, arrays with attributes and numbers.

import { element, short } from "./charts.js";

const ROWS = 12, COLUMNS = 8;

export function tree(place, key, ask, base) {
  const grove = (route, path, more = {}) => ask(`${base}/h5grove/${route}/?${new URLSearchParams({ file: `${key}.h5`, path, ...more })}`);
  const below = element("div", { class: "tree" }), shown = element("div", { id: "tree-shown", "aria-live": "polite" });
  const whole = element("details", { id: "tree" }, element("summary", {}, "raw tree of the HDF5 file"), element("div", { class: "columns" }, below, shown));
  whole.addEventListener("toggle", () => whole.open && !below.children.length && unfold(below, "/"));
  place.append(whole);

  async function unfold(list, path) {
    try {
      const meta = await grove("meta", path);
      list.replaceChildren(element("ul", {}, ...(path === "/" ? [element("li", {}, chosen("attributes of the file", path, meta))] : []), ...meta.children.map((one) => item(one, `${path === "/" ? "" : path}/${one.name}`))));
    } catch (error) {
      const missing = error.message.includes("Not Found");
      list.replaceChildren(element("p", { class: "faint" }, missing ? "This server has no h5grove: pip install 'gudgeon[h5web]'." : error.message));
    }
  }
  function item(one, path) {
    if (one.kind !== "group") return element("li", {}, chosen(decodeURIComponent(one.name), path, one));
    const inner = element("div", {}), folder = element("details", {}, element("summary", {}, decodeURIComponent(one.name)), inner);
    folder.addEventListener("toggle", () => {
      if (!folder.open || inner.children.length) return;
      unfold(inner, path);
      show(path, one);
    });
    return element("li", {}, folder);
  }
  const chosen = (name, path, one) => element("button", { type: "button", class: "link", onclick: () => show(path, one) }, name, one.shape ? element("small", {}, ` ${one.shape.join(" × ")}`) : "");

  async function show(path, one) {
    try {
      const [meta, attributes] = await Promise.all([one.attributes ? one : grove("meta", path), grove("attr", path)]);
      const rows = Object.entries(attributes).map(([name, value]) => [name, String(value).slice(0, 400)]);
      shown.replaceChildren(element("h4", {}, decodeURIComponent(path)), ...(meta.shape ? [element("p", { class: "faint" }, `${meta.shape.join(" × ") || "single number"}, ${typed(meta.type)}`)] : []),
        element("table", {}, ...rows.map((row) => element("tr", {}, ...row.map((text) => element("td", {}, text))))));
      if (meta.shape?.length && !meta.shape.includes(0)) numbers(path, meta.shape);
    } catch (error) {
      shown.replaceChildren(element("p", { class: "bad" }, error.message));
    }
  }
  function numbers(path, shape) {
    const input = (text, most) => element("input", { type: "number", min: 0, max: most, value: 0, "aria-label": text, onchange: () => page() });
    const from = input("first row", shape[0] - 1), column = shape.length > 1 ? input("first column", shape.at(-1) - 1) : null, middle = shape.length > 2 ? shape.slice(1, -1).map((size, n) => input(`index of axis ${n + 2}`, size - 1)) : [];
    const place = element("div", { class: "scroll", tabindex: 0 });
    const start = (one) => Math.min(Math.max(0, Math.round(Number(one.value) || 0)), Number(one.max));
    async function page() {
      const first = start(from), left = column ? start(column) : 0, rows = Math.min(ROWS, shape[0] - first), columns = column ? Math.min(COLUMNS, shape.at(-1) - left) : 1;
      const selection = [`${first}:${first + rows}`, ...middle.map((one) => String(start(one))), ...(column ? [`${left}:${left + columns}`] : [])].join(",");
      try {
        const found = await grove("data", path, { selection, flatten: "true", dtype: "safe" });
        const cells = [found].flat(5), line = (n) => cells.slice(n * columns, (n + 1) * columns);
        place.replaceChildren(element("table", {}, element("tr", {}, element("th", {}, ""), ...Array.from({ length: columns }, (_, n) => element("th", { class: "number" }, column ? String(left + n) : "value"))),
          ...Array.from({ length: rows }, (_, n) => element("tr", {}, element("th", {}, String(first + n)), ...line(n).map((value) => element("td", { class: "number" }, typeof value === "number" ? short(value) : String(value)))))));
      } catch (error) {
        place.replaceChildren(element("p", { class: "bad" }, error.message));
      }
    }
    shown.append(element("div", { class: "controls" }, element("label", {}, "from row ", from), ...middle.map((one, n) => element("label", {}, `axis ${n + 2} `, one)), ...(column ? [element("label", {}, "from column ", column)] : [])), place);
    page();
  }
}

const KINDS = { 0: "whole numbers", 1: "floating-point numbers", 3: "texts", 8: "truth values" };

function typed(type) {
  if (!type || typeof type !== "object") return String(type ?? "");
  return `${KINDS[type.class] ?? "numbers"}${type.size && type.class < 2 ? `, ${8 * type.size} bit` : ""}`;
}
