// The page of a modal database: search, one record, two bases beside each other.

import { curves, element, fitting, graph, kindOf, matrix, scatter, short, spectrum } from "./charts.js";
import { study } from "./study-view.js";
import { tree } from "./tree.js";
import { View } from "./view.js";

const KINDS = ["mesh", "modes", "morph", "sensitivity", "trajectory", "nodal", "cyclic", "wheel", "measurement", "report"];
const CONDITION = /^\s*[\w-]+(\.[\w-]+)*\s*(<=|>=|!=|=|<|>)\s*\S/; // As LIKE_A_CONDITION of the service.
const byId = (id) => document.getElementById(id);
const state = { database: "", key: "", views: [] };
window.gudgeon = state;

async function ask(path, kind = "json") {
  const token = sessionStorage.getItem("token");
  const answer = await fetch(path, { headers: token ? { Authorization: `Bearer ${token}` } : {} });
  // A refusal of what was asked before the token was given says nothing about the token.
  if (answer.status === 401 && token === sessionStorage.getItem("token")) byId("login").hidden = false;
  if (!answer.ok) throw new Error((await answer.json()).detail);
  return kind === "json" ? answer.json() : answer.arrayBuffer();
}

const base = () => `../${state.database}`;
const record = (key) => `${base()}/records/${key}`;

async function told(work) {
  byId("message").textContent = "";
  if (!byId("login").hidden) return undefined;
  try {
    return await work();
  } catch (error) {
    byId("message").textContent = error.message;
    return undefined;
  }
}

async function search() {
  const asked = new URLSearchParams({ limit: 300 });
  const { where } = byId("search").elements;
  if (where.value && !CONDITION.test(where.value)) throw new Error(`where: '${where.value}' is no condition such as material.E>=2e11`);
  for (const [name, value] of new FormData(byId("search"))) {
    if (value && name === "since") asked.set(name, new Date(value).getTime() / 1000);
    else if (value) asked.append(name, value);
  }
  const rows = await ask(`${base()}/records?${asked}`);
  byId("count").textContent = `${rows.length === 300 ? "the newest 300" : rows.length} records`;
  byId("records").replaceChildren(...rows.map(item));
}

function ofScene(name) {
  byId("search").reset();
  byId("search").elements.scene.value = name;
  told(search);
}

function item(row) {
  const parts = [...new Set(row.uses.map((use) => use[1]))].join(", "), scenes = [...new Set(row.uses.map((use) => use[0]))].join(", ");
  const isStudy = kindOf(row) === "study";
  const button = element("button", { type: "button", "data-key": row.key, onclick: (event) => { event.currentTarget.focus(); open(row.key); } },
    element("span", { class: "what" }, kindOf(row)), element("span", {}, (isStudy ? scenes : parts) || row.key.slice(0, 12)), element("small", {}, bytes(row.size)),
    element("small", { class: "wide" }, `${date(row.made)}  ${isStudy ? "" : scenes}  `, ...row.tags.map((tag) => element("span", { class: "tag" }, tag))));
  return element("li", {}, button);
}

// Of the time zone of the browser, as 2026-12-01 09:30.
const date = (seconds) => new Date(1000 * seconds).toLocaleString("sv-SE").slice(0, 16);

function bytes(size) {
  return size < 1e6 ? `${short(Math.round(size / 1e3))} kB` : `${short(Number((size / 1e6).toPrecision(3)))} MB`;
}

function open(key) {
  location.hash = `${state.database}/${key}`;
}

async function show(key) {
  state.key = key;
  for (const one of document.querySelectorAll("#records button")) one.setAttribute("aria-current", String(one.dataset.key === key));
  const page = byId("record"), place = element("div", {}); // What still arrives for a record left meanwhile goes to its own place.
  const [info, related] = await Promise.all([ask(`${record(key)}/info`), ask(`${record(key)}/graph`)]);
  if (state.key !== key) return;
  state.views = [];
  const own = related.records.find((row) => row.key === key);
  place.replaceChildren(
    element("h2", {}, `${info.inputs.stage === "study" ? "study" : info.kind} `, ...(own?.tags ?? []).map((tag) => element("span", { class: "tag" }, tag))),
    element("p", { class: "faint" }, `${key}, ${bytes(info.size)}`));
  page.replaceChildren(place);
  page.scrollTop = 0;
  if (info.kind === "modes") await told(() => modes(place, key));
  if (info.kind === "mesh" || info.kind === "morph") await told(() => still(place, key));
  if (info.kind === "trajectory") await told(() => run(place, key, info));
  if (info.kind === "report" && info.inputs.stage === "study") await told(() => study(place, JSON.parse(info.attributes.document), open));
  else if (info.kind === "report") await told(() => report(place, key));
  place.append(element("h3", {}, "provenance"), element("div", { class: "scroll" }, graph(related, key, open, ofScene)));
  if (related.left_out) place.append(element("p", { class: "faint" }, `and ${related.left_out} more`));
  place.append(element("h3", {}, "made from"), table(flat(info.inputs)));
  place.lastChild.classList.add("keys");
  if (info.fields.length) place.append(element("h3", {}, "arrays"), table(info.fields.map((row) => [row.path, row.shape.join(" × "), bytes(row.bytes)])));
  tree(place, key, ask, base());
  // Arrow keys go on walking the list from which the record was chosen.
  if (place.isConnected && !byId("records").contains(document.activeElement)) page.focus({ preventScroll: true });
}

function flat(inputs, prefix = "") {
  return Object.entries(inputs).flatMap(([name, value]) =>
    value && typeof value === "object" && !Array.isArray(value) && Object.keys(value).length
      ? flat(value, `${prefix}${name}.`) : [[`${prefix}${name}`, JSON.stringify(value).slice(0, 160)]]);
}

function table(rows, heads) {
  const cells = (row, name) => element("tr", {}, ...row.map((text, n) => element(name, { class: n && typeof text === "number" ? "number" : null }, typeof text === "number" ? short(text) : String(text ?? ""))));
  return element("div", { class: "scroll" }, element("table", {}, ...(heads ? [cells(heads, "th")] : []), ...rows.map((row) => cells(row, "td"))));
}

const numbers = (text, Kind) => new Kind(Uint8Array.from(atob(text), (one) => one.charCodeAt(0)).buffer);

async function stageOf(key, title) {
  const stage = element("div", { class: "stage" }, element("p", {}, title)), skin = await ask(`${record(key)}/skin`);
  const view = new View(stage);
  view.show({ points: numbers(skin.points, Float32Array), triangles: numbers(skin.triangles, Uint32Array) });
  return { stage, view };
}

// Views are those of the record on the page, for tests and for buttons.
function drawn(place, views) {
  if (place.isConnected) state.views = views;
}

async function still(place, key) {
  const { stage, view } = await stageOf(key, "");
  view.coloured = false;
  place.append(stage);
  drawn(place, [view]);
}

async function modes(place, key) {
  const found = await ask(`${record(key)}/spectrum`);
  const choice = element("select", { id: "mode", onchange: () => pick(Number(choice.value)) },
    ...found.frequencies.slice(0, found.normal_count).map((one, mode) => element("option", { value: mode }, `${mode + 1}: ${short(one)} Hz`)));
  const scale = element("input", { id: "scale", type: "range", min: 0, max: 0.4, step: 0.01, value: 0.15, oninput: () => sized() });
  const colour = element("select", { id: "colour", onchange: () => told(coloured) }, ...["displacement", "stress", "nothing"].map((one) => element("option", {}, one)));
  const stop = element("button", { id: "stop", type: "button", onclick: () => state.views.forEach((one) => (one.running = !one.running)) }, "stop, go");
  const others = (await ask(`${base()}/records?kind=modes&limit=200`)).filter((row) => row.key !== key);
  const beside = element("select", { id: "beside", onchange: () => told(() => compare(beside.value)) }, element("option", { value: "" }, "nothing"),
    ...others.map((row) => element("option", { value: row.key }, `${row.uses[0]?.join(", ") ?? ""} ${row.key.slice(0, 12)}`)));
  const stages = element("div", { class: "columns" }), below = element("div", {});
  const sized = () => state.views.forEach((one) => (one.scale = Number(scale.value)));
  let second = null, compared = 0;

  const floats = async (path) => new Float32Array(await ask(path, "bytes"));
  const shaped = async (view, from, mode) => {
    const path = `${record(from)}/skin/${mode}`, shape = await floats(path);
    view.vibrate(shape, colour.value === "stress" ? await floats(`${path}/stress`) : undefined);
    view.coloured = colour.value !== "nothing";
  };
  async function coloured() {
    await shaped(first.view, key, Number(choice.value));
    if (second) await shaped(second.view, second.key, second.mode);
  }
  async function pick(mode, other) {
    choice.value = mode;
    await told(async () => {
      await shaped(first.view, key, mode);
      if (!second) return;
      second.mode = other ?? Math.min(second.best[mode] ?? mode, second.count - 1);
      await shaped(second.view, second.key, second.mode);
    });
  }
  async function compare(other) {
    const turn = ++compared;
    second?.stage.remove();
    below.replaceChildren();
    drawn(place, [first.view]);
    second = null;
    if (!other) return;
    const result = await ask(`${record(key)}/mac/${other}`);
    const made = await stageOf(other, `beside: ${other.slice(0, 12)}`);
    if (turn !== compared) return; // Another one was chosen meanwhile.
    drawn(place, [first.view, made.view]);
    second = { ...made, key: other, count: result.frequencies[1].length, best: result.modes.map((row) => (row.other ?? row.mode) - 1) };
    stages.append(made.stage);
    sized();
    below.append(element("div", { class: "columns" },
      element("div", {}, element("h3", {}, "MAC matrix: this basis downwards, the other one to the right"), matrix(result, pick)),
      element("div", {}, element("h3", {}, "which mode is which"), table(result.modes.map((row) => [row.mode, row.frequency, row.other ?? "–", row.change === null ? "" : `${(100 * row.change).toFixed(2)} %`, row.mac]), ["mode", "[Hz]", "other", "change", "MAC"]))));
    await pick(Number(choice.value));
  }

  const controls = element("div", { class: "controls" }, element("label", {}, "mode ", choice), element("label", {}, "scale ", scale),
    element("label", {}, "colour by ", colour, " ", element("span", { class: "scale" })), stop, element("label", {}, "beside ", beside));
  const first = await stageOf(key, "drag or arrow keys: turn; wheel, + and −: zoom; space: stop");
  stages.append(first.stage);
  place.append(element("h3", {}, "frequencies"), spectrum(found, (mode) => pick(mode)), element("h3", {}, "shape"), controls, stages, below);
  drawn(place, [first.view]);
  sized();
  await pick(0);
}

async function run(place, key, info) {
  const field = async (path) => ask(`${record(key)}/field/${path.split("/").map(encodeURIComponent).join("/")}?format=json`);
  const times = (await field("times")).values, contacts = info.fields.filter((row) => /^contacts\/[^/]+\/force$/.test(row.path));
  const series = [];
  for (const row of contacts.slice(0, 6)) {
    const { values } = await field(row.path);
    series.push({ name: row.path.split("/")[1], values: times.map((_, at) => Math.hypot(values[3 * at], values[3 * at + 1], values[3 * at + 2])) });
  }
  if (series.length) place.append(element("h3", {}, "contact forces"), curves(times, series, { x: "time [s]", y: "force [N]", title: "contact forces" }));
  const bodies = Object.keys(JSON.parse(info.attributes.bodies ?? "{}"));
  if (bodies.length) await film(place, key, bodies);
  const energies = await field("energies"), columns = energies.shape[1];
  const named = ["kinetic", "strain", "contact", "dissipated", "work of loads"].slice(0, columns);
  place.append(element("h3", {}, "energies"), curves(times, named.map((name, n) => ({ name, values: times.map((_, at) => energies.values[columns * at + n]) })), { x: "time [s]", y: "energy [J]", title: "energies" }));
  const quantities = JSON.parse(info.attributes.quantities ?? "{}");
  place.append(element("h3", {}, `result: ${info.attributes.result}`), table(Object.entries(quantities).map(([name, { value, unit }]) => {
    const [size, fitted] = typeof value === "number" ? fitting(value, unit) : [1, unit];
    return [name, typeof value === "number" ? value / size : value, fitted];
  })));
}

async function film(place, key, bodies) {
  const body = element("select", { id: "body", onchange: () => told(shown) }, ...bodies.map((one) => element("option", {}, one)));
  const colour = element("select", { id: "film-colour", onchange: () => told(shown) }, ...["displacement", "stress"].map((one) => element("option", {}, one)));
  const scale = element("input", { id: "film-scale", type: "range", min: 0, max: 0.3, step: 0.01, value: 0.1, oninput: () => sized() });
  const stop = element("button", { id: "film-stop", type: "button", onclick: () => state.views.forEach((one) => (one.running = !one.running)) }, "stop, go");
  const time = element("span", { id: "film-time" }), legend = element("span", {}), stages = element("div", {});
  const sized = () => state.views.forEach((one) => (one.scale = Number(scale.value) / (one.reach || 1)));
  async function shown() {
    const found = await ask(`${record(key)}/film/${encodeURIComponent(body.value)}?colour=${colour.value}`);
    const stage = element("div", { class: "stage" }, element("p", {}, "deformation over time, enlarged; its rigid motion is left out"));
    stages.replaceChildren(stage);
    const view = new View(stage), frames = numbers(found.moved, Float32Array), values = numbers(found.sizes, Float32Array);
    view.show({ points: numbers(found.points, Float32Array), triangles: numbers(found.triangles, Uint32Array) });
    view.reach = frames.reduce((most, one) => Math.max(most, Math.abs(one)), 0);
    view.film(frames, values.map((one) => one / (found.largest || 1)), found.times.length, (number) => (time.textContent = `${short(1e3 * found.times[number])} ms`));
    const [size, unit] = fitting(found.largest, colour.value === "stress" ? "Pa" : "m");
    legend.textContent = ` 0 to ${short(found.largest / size)} ${unit}${colour.value === "stress" ? ", von Mises, of the elastic shapes" : ""}`;
    drawn(place, [view]);
    sized();
  }
  place.append(element("h3", {}, "film"), element("div", { class: "controls" }, element("label", {}, "body ", body), element("label", {}, "scale ", scale),
    element("label", {}, "colour by ", colour, " ", element("span", { class: "scale" }), legend), stop, time), stages);
  await told(shown);
}

async function report(place, key) {
  const found = await ask(`${record(key)}/report`);
  place.append(element("h3", {}, `report of ${found.scene ?? ""}`));
  if (found.rows.length) place.append(scatter(found.rows), table(found.rows.map((row) => [row.name, row.seconds, row.error, row.note]), ["run", "CPU [s]", "largest error", ""]));
  place.append(element("p", {}, found.choice ? `cheapest setting within the tolerance: ${found.choice}` : found.why));
}

// Commands that run on this database; when one ends, its records are listed.
async function running() {
  const rows = await ask(`${base()}/running`), before = byId("running").children.length;
  byId("running").replaceChildren(...rows.map((row) => element("li", {}, `${row.command} ${row.scene}: ${row.stage} ${Math.round(100 * row.share)} %, for ${minutes(Date.now() / 1000 - row.begun)}`,
    element("progress", { max: 1, value: row.share, "aria-label": `${row.command} ${row.scene}` }))));
  if (rows.length < before) await search();
}

const minutes = (seconds) => (seconds < 90 ? `${Math.max(0, Math.round(seconds))} s` : `${Math.round(seconds / 60)} min`);

async function start() {
  const health = await ask("../health");
  const place = byId("database");
  place.replaceChildren(...health.databases.map((name) => element("option", {}, name)));
  for (const kind of KINDS) document.querySelector("#search select[name=kind]").append(element("option", {}, kind));
  byId("login").hidden = !health.token_needed || Boolean(sessionStorage.getItem("token"));
  state.database = health.databases[0];
  await follow(true);
  setInterval(() => byId("login").hidden && !document.hidden && running().catch(() => {}), 2000);
}

async function follow(fresh) {
  const [database, key] = location.hash.slice(1).split("/");
  const before = state.database;
  if (database && [...byId("database").options].some((one) => one.value === database)) state.database = database;
  byId("database").value = state.database;
  if (fresh || before !== state.database) await told(search);
  if (key) await told(() => show(key));
  document.body.dataset.ready = key ?? "list";
}

byId("search").addEventListener("submit", (event) => { event.preventDefault(); told(search); });
byId("database").addEventListener("change", (event) => { location.hash = event.target.value; });
byId("login").addEventListener("submit", (event) => {
  event.preventDefault();
  sessionStorage.setItem("token", byId("token").value);
  byId("login").hidden = true;
  told(() => follow(true));
});
byId("records").addEventListener("keydown", (event) => {
  if (event.key === "ArrowRight") byId("record").focus();
  const step = { ArrowDown: 1, ArrowUp: -1 }[event.key], all = [...document.querySelectorAll("#records button")];
  if (!step) return;
  event.preventDefault();
  all[all.indexOf(document.activeElement) + step]?.focus();
});
window.addEventListener("hashchange", () => follow(false));
told(start);
