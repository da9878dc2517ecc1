"""`python -m tests.pipeline.applications.feel.motions [grips] [FIRST LAST]`: random motions, and what each gains.

Sines to 15 Hz, shakes, moves with stops and swings, given or in the grip of a hand, through four fields at scales 1 to
1e9, 100 to 2000 poses a second and delays to 10 ms each way. The motion ends after 1.1 s; what is felt 0.6 s later is
held. Prints a line for each motion that gains more than 1e-6 of what it exchanges, or that feels less than 90 % of the
force of S (docs/feel.md) in the end. With `grips` a hand of random stiffness and speed leads the handle along the two
paths of the tests, or half of the time as far along x as along z.
"""

import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.applications.feel.device import Script, Scripted
from tests.pipeline.applications.feel.tools import felt, gain, tool

KINDS = ("plates", "attracted", "repelled", "adhesion")
RATES, DELAYS = (100.0, 250.0, 500.0, 1000.0, 2000.0), (0.0, 1e-3, 2e-3, 5e-3, 1e-2)
GAINED, HELD = 1e-6, 0.9
ENDS, SECONDS = 1.1, 1.7
"""When the motion ends, and when it is looked at [s]."""


class Motion(NamedTuple):
    """One random motion."""

    kind: str
    scale: float
    rate: float
    delay: float
    name: str
    grip: tuple[float, float] | None
    script: Script


def _along(z: float, x: float = 0.0) -> np.ndarray:
    return np.array([x, 0.0, z, 0.0, 0.0, 0.0])


def _script(rng: np.random.Generator) -> tuple[str, Script]:
    family = rng.integers(4)
    if family == 0:
        count = rng.integers(1, 5)
        rates = np.exp(rng.uniform(np.log(0.5), np.log(15), count))
        sizes = 6e-3 / (1 + rates**1.3) * rng.uniform(0.3, 1, count)
        begins = rng.uniform(0, 2 * np.pi, count)

        def sines(t: float) -> np.ndarray:
            z = sizes @ (np.sin(2 * np.pi * rates * t + begins) - np.sin(begins))
            return _along((1 - np.exp(-t / 0.05)) * float(z), 1e-3 * np.sin(5 * t))

        return "sines", sines
    if family == 1:
        rate, size, goal = rng.uniform(6, 15), rng.uniform(2e-4, 1e-3), rng.uniform(-5e-3, 5e-3)
        return "shake", lambda t: _along(goal * min(1, t / 0.4) + size * np.sin(2 * np.pi * rate * t))
    if family == 2:
        places = np.concatenate([[0], rng.uniform(-0.012, 0.012, 5)])
        time = rng.uniform(0.12, 0.3)

        def moves(t: float) -> np.ndarray:
            i = min(int(t / time), 4)
            u = min(max((t / time - i) / 0.7, 0), 1)
            return _along(places[i] + (places[i + 1] - places[i]) * u**3 * (10 - 15 * u + 6 * u * u))

        return "moves", moves
    slow, wide = rng.uniform(0.5, 3), rng.uniform(2e-3, 12e-3)
    small, quick = rng.uniform(2e-4, 1e-3), rng.uniform(5, 15)
    return "swing", lambda t: _along(
        (1 - np.exp(-t / 0.05)) * (wide * np.sin(2 * np.pi * slow * t) + small * np.sin(2 * np.pi * quick * t))
    )


def swing(time: float) -> np.ndarray:
    """A motion through the field and back, across 24 mm of the handle."""
    z = 0.012 * np.sin(2 * np.pi * 1.3 * time) * (1 - np.exp(-time))
    return np.array([0.001 * np.sin(5 * time), 0.0, z, 0.0, 0.0, 0.0])


def wander(time: float) -> np.ndarray:
    """A motion of four frequencies up to 6 Hz that no observer foresees."""
    rates, sizes = np.array([0.7, 1.9, 3.7, 6.0]), np.array([4e-3, 2e-3, 1e-3, 6e-4])
    z = sizes @ (np.sin(2 * np.pi * rates * time + np.arange(4)) - np.sin(np.arange(4)))
    return np.array([0.001 * np.sin(5 * time), 0.0, z * (1 - np.exp(-time / 0.05)), 0.0, 0.0, 0.0])


def led(path: Script, speed: float, size: float, across: bool) -> Script:
    """A path at another speed and size; `across`, both x and z are its sum of x and z."""

    def script(time: float) -> np.ndarray:
        pose = size * path(speed * time)
        if across:
            pose[0], pose[2] = pose[0] + pose[2], pose[0] + pose[2]
        return pose

    return script


def grip(seed: int) -> Motion:
    """Return the motion of a seed along a path of the tests, in the grip of a hand."""
    rng = np.random.default_rng(seed)
    kind, scale = KINDS[rng.integers(4)], 10 ** rng.uniform(0, 9)
    rate, delay = float(rng.choice(RATES)), float(rng.choice(DELAYS))
    path, across = (swing, wander)[rng.integers(2)], bool(rng.integers(2))
    script = led(path, rng.uniform(0.7, 1.3), rng.uniform(0.8, 1.2), across)
    stiffness = float(np.exp(rng.uniform(np.log(100), np.log(1000))))
    name = f"{path.__name__}{' across' if across else ''}"
    return Motion(kind, scale, rate, delay, name, (stiffness, 0.17 * float(np.sqrt(stiffness))), script)


def motion(seed: int) -> Motion:
    """Return the motion of a seed."""
    rng = np.random.default_rng(seed)
    kind, scale = KINDS[rng.integers(4)], 10 ** rng.uniform(0, 9)
    rate, delay = float(rng.choice(RATES)), float(rng.choice(DELAYS))
    name, script = _script(rng)
    return Motion(kind, scale, rate, delay, name, (300.0, 3.0) if rng.random() < 0.33 else None, script)


class Measured(NamedTuple):
    """What a motion gains and holds."""

    gained: float
    """Energy over that exchanged."""
    held: float
    """Force in the end over that of S."""
    yields: bool
    """Whether the whole force would pull the handle out of the hand's grip by more than the reserve pays for."""


def measured(one: Motion) -> Measured:
    """Move a handle, and return what it gains and holds."""
    device = Scripted(lambda t: one.script(min(t, ENDS)), rate=one.rate, delay=one.delay, grip=one.grip)
    coupling, found = felt(one.kind, device, one.scale, SECONDS)
    x = device.pose / coupling.way
    _, wrench = tool(one.kind).settled(x, coupling.at.copy(), coupling.energies)
    force = wrench[2] * coupling.scales.force * coupling.scales.length / coupling.way[2]
    held = float(device.wrench[2] / force) if force else 1.0
    # In a grip of stiffness K the handle yields by F / K, by which the force takes F² / (2 K).
    taken = (1.0 - held**2) * force**2 / (2.0 * one.grip[0]) if one.grip else 0.0
    return Measured(gain(one.kind, coupling, device)[0], held, taken > found[-1].reserve)


def main(first: int = 0, last: int = 240, make: Callable[[int], Motion] = motion) -> None:
    """Print what fails, and how many."""
    gained = held = yields = 0
    for seed in range(first, last):
        one = make(seed)
        found = measured(one)
        less = found.held < HELD
        gained, held, yields = gained + (found.gained > GAINED), held + less, yields + (less and found.yields)
        if found.gained > GAINED or less:
            hand = "gripped" if one.grip else "given"
            place = f"{one.kind}, scale {one.scale:.1e}, {one.rate:g} Hz, {1e3 * one.delay:g} ms, {one.name}, {hand}"
            reason = ", the hand yields" if less and found.yields else ""
            print(f"{seed}: {place}: gains {found.gained:.1e}, holds {found.held:.3f}{reason}", flush=True)
    print(f"{gained} of {last - first} gain energy, {held} hold less than {HELD:.0%} of their force, of these {yields}"
          " since the hand yields")  # fmt: skip


if __name__ == "__main__":
    words = sys.argv[1:]
    grips = words[:1] == ["grips"]
    main(*(int(one) for one in words[grips:][:2]), make=grip if grips else motion)
