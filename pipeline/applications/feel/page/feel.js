// The handle of a browser: mouse, keyboard or gamepad move the tool, its force is an arrow, a bar and a rumble.

import { Guard } from "./guard.js";
import * as THREE from "./vendor/three.module.js";

const PERIOD = 8; // Milliseconds between poses, and samples of the guard.
const SPEED = 0.02; // Of keys and sticks [m/s of the handle].
const TURN = 0.5; // [rad/s]
const HOMING = 0.15; // Time in which the way to the start becomes a third of itself [s].
const TAKEN = 4001; // Why a socket is closed: another page has the handle.

const at = (id) => document.getElementById(id);
const shown = await (await fetch("scene")).json();
at("name").textContent = `${shown.name}: ${shown.body}`;
at("bar").max = shown.force;

const stage = at("stage");
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
const dark = matchMedia("(prefers-color-scheme: dark)");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
stage.append(renderer.domElement);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(35, 1, 0.01, 100);
camera.up.set(0, 0, 1);
scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.2));
const sun = new THREE.DirectionalLight(0xffffff, 1.5);
sun.position.set(2, -3, 4);
scene.add(sun);

const part = (triangles, colour) => {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(triangles.flat(2)), 3));
  geometry.computeVertexNormals();
  const material = new THREE.MeshStandardMaterial({ color: colour, side: THREE.DoubleSide, flatShading: true });
  return new THREE.Mesh(geometry, material);
};
for (const triangles of shown.fixed) scene.add(part(triangles, 0x9aa3af));
const tool = new THREE.Group();
for (const triangles of shown.moved) tool.add(part(triangles, 0x2f6fb3));
const ghost = new THREE.Mesh(new THREE.SphereGeometry(0.02, 24, 12), new THREE.MeshBasicMaterial());
const arrow = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 0.01, 0xc8321f);
for (const one of [ghost, arrow.line, arrow.cone]) { // Seen through the parts, into which forces often point.
  one.material.depthTest = false;
  one.renderOrder = 1;
}
scene.add(tool, ghost, arrow);
const paint = () => { renderer.setClearColor(colour("--ground")); ghost.material.color.set(colour("--mark")); };
dark.addEventListener("change", paint);
paint();

const view = { about: -1.0, above: 0.35, away: 3.2 };
const right = new THREE.Vector3(), up = new THREE.Vector3(), ahead = new THREE.Vector3();
const look = () => {
  const { about, above, away } = view;
  camera.position.set(Math.cos(above) * Math.cos(about), Math.cos(above) * Math.sin(about), Math.sin(above)).multiplyScalar(away);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  camera.matrixWorld.extractBasis(right, up, ahead);
};
const fit = () => {
  const { clientWidth: width, clientHeight: height } = stage;
  renderer.setSize(width, height);
  renderer.setPixelRatio(window.devicePixelRatio);
  camera.aspect = width / Math.max(height, 1);
  camera.updateProjectionMatrix();
};
new ResizeObserver(fit).observe(stage);
fit();
look();

const pose = [0, 0, 0, 0, 0, 0];
let place = [0, 0, 0, 0, 0, 0];
const guard = new Guard(1000 / PERIOD, shown.force, shown.mass);
const shift = (direction, way) => ["x", "y", "z"].forEach((axis, i) => { pose[i] += direction[axis] * way; });

stage.addEventListener("pointerdown", (event) => { stage.setPointerCapture(event.pointerId); stage.focus(); });
stage.addEventListener("contextmenu", (event) => event.preventDefault());
stage.addEventListener("pointermove", (event) => {
  if (!event.buttons) return;
  if (event.buttons & 2) {
    view.about -= 0.006 * event.movementX;
    view.above = Math.min(1.5, Math.max(-1.5, view.above + 0.006 * event.movementY));
    return look();
  }
  const way = (shown.reach * 2) / stage.clientHeight;
  shift(right, event.movementX * way);
  shift(up, -event.movementY * way);
});
stage.addEventListener("wheel", (event) => { event.preventDefault(); shift(ahead, Math.sign(event.deltaY) * shown.reach * 0.03); }, { passive: false });
const down = new Set();
let homing = false; // Back to the start, in a way that the guard can follow.
const KEYS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown", "q", "e"];
stage.addEventListener("keydown", (event) => {
  if (event.key === "Home") homing = true;
  if (KEYS.includes(event.key)) { down.add(event.key); event.preventDefault(); }
});
stage.addEventListener("keyup", (event) => down.delete(event.key));
stage.addEventListener("blur", () => down.clear());
stage.focus();

const drift = (seconds) => {
  const held = (key) => (down.has(key) ? 1 : 0);
  let [x, y, z, turn] = [held("ArrowRight") - held("ArrowLeft"), held("ArrowUp") - held("ArrowDown"),
    held("PageDown") - held("PageUp"), held("q") - held("e")];
  for (const pad of navigator.getGamepads?.() ?? []) {
    if (!pad) continue;
    const axis = (i) => (Math.abs(pad.axes[i] ?? 0) > 0.1 ? pad.axes[i] : 0);
    x += axis(0); y -= axis(1); turn -= axis(2); z += axis(3);
  }
  const way = Math.min(SPEED, shown.reach) * seconds;
  shift(right, x * way); shift(up, y * way); shift(ahead, z * way);
  pose[5] += turn * TURN * seconds;
  if (!homing) return;
  const left = Math.max(...pose.map(Math.abs)) > 1e-6 ? Math.exp(-seconds / HOMING) : 0;
  pose.forEach((one, i) => { pose[i] = one * left; });
  homing = left > 0;
};

let socket, joined = false, rumbled = 0;
const connect = () => {
  socket = new WebSocket(`ws://${location.host}/ws`);
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = (event) => {
    joined = false;
    guard.wrench.fill(0);
    if (event.code === TAKEN) { tell("lost", "another page has the handle; load this page again to take it"); return; }
    tell("lost", "connection lost; trying again");
    setTimeout(connect, 1000);
  };
};
const tell = (kind, text) => { const box = at("state"); box.className = kind; if (box.textContent !== text) box.textContent = text; };
const STATES = { live: "live", fading: "no poses: the force fades", silent: "no poses: no force", fault: "faulty pose: no force" };
const si = (value, unit) => {
  if (!Number.isFinite(value)) return "outside of the field";
  const size = Math.abs(value);
  const steps = [[1e-12, "p"], [1e-9, "n"], [1e-6, "µ"], [1e-3, "m"], [1, ""], [1e3, "k"]];
  const [factor, prefix] = steps.findLast(([least]) => size >= least) ?? (size === 0 ? [1, ""] : steps[0]);
  return `${(value / factor).toPrecision(3)} ${prefix}${unit}`;
};
const take = (got) => {
  if (!joined) { // The handle stays where it is, and goes on with the work that was done on it.
    pose.splice(0, 6, ...got.pose);
    guard.start(pose, got.work);
    joined = true;
  }
  guard.model = got.model;
  place = got.tool;
  const { wrench } = guard;
  const size = Math.hypot(...wrench.slice(0, 3));
  tell(got.state, STATES[got.state]);
  at("bar").value = size;
  at("force").textContent = si(size, "N");
  at("truth").textContent = got.truth === null ? "outside of the field" : si(Math.hypot(...got.truth.slice(0, 3)), "N");
  at("torque").textContent = si(Math.hypot(...wrench.slice(3)), "N m");
  at("handle").textContent = pose.slice(0, 3).map((one) => (1e3 * one).toFixed(1)).join(", ") + " mm";
  at("tool").textContent = place.slice(0, 3).map((one) => (1e6 * one).toFixed(3)).join(", ") + " µm";
  at("reserve").textContent = si(got.reserve, "J");
  at("loop").textContent = `${got.period.toFixed(2)} ms, ${got.missed} missed`;
  const now = performance.now();
  if (size > 0 && now - rumbled > 100) {
    rumbled = now;
    for (const pad of navigator.getGamepads?.() ?? []) {
      const strong = Math.min(1, size / shown.force);
      pad?.vibrationActuator?.playEffect?.("dual-rumble", { duration: 120, strongMagnitude: strong, weakMagnitude: strong / 2 }).catch(() => {});
    }
  }
};
connect();
setInterval(() => {
  if (socket.readyState !== WebSocket.OPEN || !joined) return;
  guard.sample(pose);
  socket.send(JSON.stringify({ pose, work: guard.work }));
}, PERIOD);

let before = performance.now(), drawn = "", frames = 0;
const draw = (now) => {
  drift(Math.min(0.1, (now - before) / 1000));
  before = now;
  const to = 1 / shown.size;
  const pivot = new THREE.Vector3(...shown.pivot);
  const vector = new THREE.Vector3(...place.slice(3));
  const angle = vector.length();
  tool.quaternion.setFromAxisAngle(angle ? vector.normalize() : new THREE.Vector3(0, 0, 1), angle);
  tool.position.copy(pivot).sub(pivot.clone().applyQuaternion(tool.quaternion)).add(new THREE.Vector3(...place.slice(0, 3)).multiplyScalar(to));
  ghost.position.copy(pivot).add(new THREE.Vector3(...pose.slice(0, 3)).multiplyScalar(to / shown.length));
  const force = new THREE.Vector3(...guard.wrench.slice(0, 3));
  const size = force.length();
  arrow.visible = size > 0;
  if (size > 0) {
    arrow.position.copy(pivot).add(new THREE.Vector3(...place.slice(0, 3)).multiplyScalar(to));
    arrow.setDirection(force.normalize());
    const long = 0.1 + 0.7 * Math.min(1, size / shown.force);
    arrow.setLength(long, 0.3 * long, 0.15 * long);
  }
  // What looks as before is not drawn again, beside a loop that must not wait.
  const seen = [tool.position, tool.quaternion, ghost.position, force, camera.position].flatMap((one) => one.toArray());
  const sizes = [Number(dark.matches), size / shown.force, ...renderer.getSize(new THREE.Vector2()), renderer.getPixelRatio()];
  const looks = [...seen, ...sizes].map((one) => one.toFixed(4)).join();
  if (looks !== drawn) { renderer.render(scene, camera); frames += 1; }
  drawn = looks;
  requestAnimationFrame(draw);
};
requestAnimationFrame(draw);
window.feel = { pose, guard, get wrench() { return guard.wrench; }, get frames() { return frames; } };
