// The guard of the handle, as in guard.py: it renders a model of the force at the handle's own place, so that the handle
// gains no energy.

const ROOM = 0.1; // Reach by which torques become forces [m].
const WEIGHTS = [1, 1, 1, ROOM ** 2, ROOM ** 2, ROOM ** 2];
const RISE = 0.3, LOST = 0.02, MOST_LOST = 0.3, SPENT = 0.2, FALLEN = 0.1, DAMPS = 0.3;
const STIFFEST = 0.25, STIFF = 300, QUICK = 4, RELAXED = 0.1, MEMORY = 0.2, SAFE = 2;

const dot = (a, b) => a.reduce((sum, one, i) => sum + one * b[i], 0);
const plus = (a, b, factor = 1) => a.map((one, i) => one + factor * b[i]);
const weighted = (a) => a.map((one, i) => one * WEIGHTS[i]);
const strength = (force) => Math.sqrt(dot(force.map((one, i) => one / WEIGHTS[i]), force));

// S less that at the start [J], force, restoring stiffness [N/m], and what S may differ by [J], of a model at a pose.
export const modelled = ({ place, step, marks, energies, forces, stiffness }, pose) => {
  const line = weighted(step), square = dot(step, line), last = marks.length - 1;
  const s = Math.min(marks[last], Math.max(marks[0], dot(plus(pose, place, -1), line) / square));
  let i = 0;
  while (i < last - 1 && marks[i + 1] <= s) i += 1;
  const span = marks[i + 1] - marks[i], t = (s - marks[i]) / span;
  const force = plus(forces[i], plus(forces[i + 1], forces[i], -1), t);
  const a = dot(forces[i], step) * span, b = dot(forces[i + 1], step) * span;
  const low = energies[i], high = energies[i + 1];
  const beside = plus(plus(pose, place, -1), step, -s);
  const rest = high - low + 0.5 * (a + b);
  const energy = low - t * a - 0.5 * t * t * (b - a) + t * rest
    + 0.5 * stiffness * dot(weighted(beside), beside) - dot(force, beside);
  return { energy, force, bend: Math.max(0, a - b) / (span * span * square), off: 4 * t * (1 - t) * Math.abs(rest) };
};

export class Guard {
  constructor(rate, force, mass) {
    Object.assign(this, { rate, force, mass, model: null });
    this.start([0, 0, 0, 0, 0, 0], 0);
  }

  // Begin at a pose with the work done so far [J]; forces that have risen before do not rise again.
  start(pose, work) {
    this.work = work;
    this.share = work === 0 ? 0 : 1;
    this.reserve = 0;
    this.wrench = [0, 0, 0, 0, 0, 0];
    this.pose = [...pose];
    this.step = [0, 0, 0, 0, 0, 0];
    this.deviation = 0;
    this.friction = 0;
    this.held = 1;
    this.given = 1;
  }

  // The wrench that is held from now until the next sample [N, N m].
  sample(pose) {
    this.move(pose);
    if (this.model === null) return this.wrench;
    const { model, step } = this, mass = this.mass * this.rate ** 2;
    const now = modelled(model, pose), next = modelled(model, plus(pose, step));
    const square = dot(weighted(step), step);
    let need = 0.5 * Math.max(now.bend, next.bend) * (Math.sqrt(square) + this.deviation) ** 2
      + Math.max(now.off, next.off);
    const resists = now.energy > 0 && this.cost(now.force) < 0;
    if (resists || Math.max(0, -now.energy) - this.work >= need * this.share) {
      this.share = Math.min(1, this.share + 1 / (this.rate * RISE));
    }
    const here = this.share * now.energy, there = this.share * next.energy;
    need *= this.share;
    const halfway = modelled(model, plus(pose, step, 0.5)).force;
    let force = (dot(halfway, step) < dot(now.force, step) ? halfway : now.force).map((one) => this.share * one);
    const reserve = this.reserve = Math.max(0, -here) - this.work;
    if (here > 0 && reserve < here) force = this.rubbed(force, here);
    else {
      [this.friction, this.held] = [0, 1];
      this.given = Math.min(1, this.given + 1 / (this.rate * RISE));
      force = force.map((one) => this.given * one);
    }
    const falls = Math.max(0, -there) - Math.max(0, -here);
    let allowed = Math.max(0, reserve + falls);
    if (there > 0 && there < here && reserve < here) allowed *= Math.max(FALLEN, 1 - there / here);
    if (there <= 0) {
      const lost = reserve > need ? LOST : MOST_LOST;
      allowed = falls - lost * Math.abs(falls) + SPENT * Math.max(0, reserve - need) + Math.min(0, reserve);
    }
    const excess = dot(force, step) - allowed;
    if (excess > 0 && square > 0) {
      let damping = DAMPS * mass * square;
      const unsure = this.deviation / Math.sqrt(square) - 1;
      if (unsure > 0) damping = Math.min(damping, 0.5 * Math.max(0, reserve) / unsure);
      force = plus(force, weighted(step), -Math.min(excess, Math.max(0, dot(force, step)) + damping) / square);
    }
    this.wrench = this.limited(force.map((one) => model.share * one));
    return this.wrench;
  }

  move(pose) {
    const step = plus(pose, this.pose, -1), change = plus(step, this.step, -1);
    this.work += dot(this.wrench, step);
    const kept = this.deviation * Math.max(0, 1 - 1 / (this.rate * MEMORY));
    this.deviation = Math.max(kept, SAFE * Math.sqrt(dot(weighted(change), change)));
    [this.pose, this.step] = [[...pose], step];
  }

  rubbed(whole, above) {
    let size = strength(whole);
    if (size === 0) return whole;
    const reserve = Math.max(0, this.reserve), mass = this.mass * this.rate ** 2;
    const stiffness = Math.min(reserve > 0 ? Math.max(STIFF, QUICK * size ** 2 / reserve) : Infinity, STIFFEST * mass);
    const slid = this.friction * Math.max(0, 1 - 1 / (this.rate * RELAXED)) + stiffness * dot(whole, this.step) / size;
    this.friction = Math.min(Math.max(slid, 0), (1 - reserve / above) * size);
    const left = this.given = 1 - this.friction / size;
    const force = whole.map((one) => left * one);
    size *= left;
    if (size <= 0) return force;
    const cost = this.cost(force);
    const before = Math.max(0, dot(this.wrench.map((one, i) => one / WEIGHTS[i]), force)) / size ** 2;
    const moved = size ** 2 / mass, bent = cost - before * moved;
    let share = (Math.sqrt(bent * bent + 4 * moved * reserve) - bent) / (2 * moved);
    if (share < before) share = cost <= 0 ? before : Math.min(before, reserve / cost);
    this.held = Math.min(1, share, cost < 0 ? Infinity : this.held + 1 / (this.rate * RISE));
    this.given = left * this.held;
    return force.map((one) => this.held * one);
  }

  cost(force) {
    return dot(force, this.step) + this.deviation * strength(force);
  }

  limited(wrench) {
    if (!wrench.every(Number.isFinite)) return [0, 0, 0, 0, 0, 0];
    const found = [...wrench];
    for (const [first, most] of [[0, this.force], [3, this.force * ROOM]]) {
      const size = Math.hypot(...found.slice(first, first + 3));
      if (size > most) for (let i = first; i < first + 3; i += 1) found[i] *= most / size;
    }
    return found;
  }
}
