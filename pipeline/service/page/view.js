// A part in 3-D that turns and vibrates in a mode. Points and shapes are sent once; the motion is made on the graphics card.

import * as THREE from "./vendor/three.module.js";

const VERTEX = `
attribute vec3 shape;
attribute float value;
uniform float amplitude;
uniform float swing;
varying vec3 seen;
varying float size;
void main() {
  vec4 place = modelViewMatrix * vec4(position + amplitude * swing * shape, 1.0);
  seen = place.xyz;
  size = value;
  gl_Position = projectionMatrix * place;
}`;
const FRAGMENT = `
uniform float coloured;
varying vec3 seen;
varying float size;
vec3 warm(float t) {
  vec3 low = vec3(0.23, 0.30, 0.75), middle = vec3(0.87, 0.87, 0.87), high = vec3(0.71, 0.02, 0.15);
  return t < 0.5 ? mix(low, middle, 2.0 * t) : mix(middle, high, 2.0 * t - 1.0);
}
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float light = 0.45 + 0.55 * abs(dot(normal, normalize(vec3(0.3, 0.5, 1.0))));
  gl_FragColor = vec4(mix(vec3(0.66, 0.70, 0.75), warm(size), coloured) * light, 1.0);
}`;
const HERTZ = 0.8;
const FILM = 6; // Seconds of a film.

const lengths = (shape) => Float32Array.from({ length: shape.length / 3 }, (_, at) => Math.hypot(shape[3 * at], shape[3 * at + 1], shape[3 * at + 2]));

export class View {
  constructor(stage) {
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "part in 3-D; arrow keys turn it, plus and minus zoom, space stops the motion");
    stage.append(this.canvas);
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01, 100);
    this.turn = { about: 0.7, above: 0.45, away: 2.0 };
    this.uniforms = { amplitude: { value: 0 }, swing: { value: 0 }, coloured: { value: 1 } };
    this.running = true;
    this.frames = 0;
    this.phase = 0;
    this.listen();
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(stage);
    this.stage = stage;
    this.fit();
    const draw = (now) => {
      if (!this.canvas.isConnected) return this.dispose();
      if (this.running) this.phase += (now - (this.before ?? now)) / 1000;
      this.before = now;
      this.render();
      requestAnimationFrame(draw);
    };
    requestAnimationFrame(draw);
  }

  show(skin) {
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(skin.points, 3));
    this.geometry.setAttribute("shape", new THREE.BufferAttribute(new Float32Array(skin.points.length), 3));
    this.geometry.setAttribute("value", new THREE.BufferAttribute(new Float32Array(skin.points.length / 3), 1));
    this.geometry.setIndex(new THREE.BufferAttribute(skin.triangles, 1));
    this.geometry.computeBoundingSphere();
    const { center, radius } = this.geometry.boundingSphere;
    const material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: this.uniforms, side: THREE.DoubleSide });
    const mesh = new THREE.Mesh(this.geometry, material);
    mesh.position.copy(center).multiplyScalar(-1 / radius);
    mesh.scale.setScalar(1 / radius);
    mesh.frustumCulled = false;
    this.radius = radius;
    this.scene.add(mesh);
  }

  // Values colour the points, 0 to 1; without them the length of the shape does.
  vibrate(shape, values) {
    this.geometry.attributes.shape.copyArray(shape).needsUpdate = true;
    this.geometry.attributes.value.copyArray(values ?? lengths(shape)).needsUpdate = true;
  }

  // Frames of displacements and of values, one after the other; `told` hears the number of each frame that is shown.
  film(frames, values, count, told) {
    this.frame = -1;
    this.onFrame = (share) => {
      const number = Math.min(count - 1, Math.floor(share * count)), size = frames.length / count;
      if (number === this.frame) return;
      this.frame = number;
      this.vibrate(frames.subarray(number * size, (number + 1) * size), values.subarray((number * size) / 3, ((number + 1) * size) / 3));
      told(number);
    };
  }

  set scale(share) {
    this.uniforms.amplitude.value = share * this.radius;
  }

  set coloured(on) {
    this.uniforms.coloured.value = on ? 1 : 0;
  }

  render() {
    const { about, above, away } = this.turn;
    this.uniforms.swing.value = this.onFrame ? 1 : Math.sin(2 * Math.PI * HERTZ * this.phase);
    this.onFrame?.((this.phase / FILM) % 1);
    const flat = Math.cos(above);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(flat * Math.cos(about), flat * Math.sin(about), Math.sin(above)).multiplyScalar(away * 1.9);
    this.camera.lookAt(0, 0, 0);
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  move(about, above, closer = 1) {
    this.turn.about += about;
    this.turn.above = Math.max(-1.5, Math.min(1.5, this.turn.above + above));
    this.turn.away = Math.max(0.6, Math.min(8, this.turn.away * closer));
  }

  listen() {
    let held = null;
    this.canvas.addEventListener("pointerdown", (event) => { held = event; this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener("pointerup", () => { held = null; });
    this.canvas.addEventListener("pointermove", (event) => {
      if (held) this.move(-(event.clientX - held.clientX) / 150, (event.clientY - held.clientY) / 150);
      if (held) held = event;
    });
    this.canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.move(0, 0, event.deltaY > 0 ? 1.1 : 1 / 1.1); }, { passive: false });
    const keys = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.15], ArrowDown: [0, -0.15], "+": [0, 0, 1 / 1.1], "-": [0, 0, 1.1] };
    this.canvas.addEventListener("keydown", (event) => {
      if (event.key === " ") this.running = !this.running;
      else if (keys[event.key]) this.move(...keys[event.key]);
      else return;
      event.preventDefault();
    });
  }

  dispose() {
    this.observer.disconnect();
    this.geometry?.dispose();
    this.renderer.dispose();
  }
}
