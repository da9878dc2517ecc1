"""Mesh stiffness of data/gears over the angle, by a run and by the published formula: `python -m docs.tools.gear_mesh`.

The formula is that of potential energies: bending, shear and compression of the tooth (Yang and Lin, J. Mech. Trans.
Autom. Des. 109 (1987) 189; shear by Tian, MSc thesis, University of Alberta, 2004), of its foundation (Sainsot, Velex
and Duverger, J. Mech. Des. 126 (2004) 748), and of the contact, π E b/4 (1 − ν²); pairs of teeth act in parallel.
ISO 6336-1 gives the mean over a pitch, c_γ = c' (0.75 ε_α + 0.25), c' = 0.8/q'.
"""

import sys
from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson

import gudgeon
from gudgeon.modaldb.records.trajectory import Trajectory

E, NU, WIDTH = 206e9, 0.3, 3e-3
TEETH, MODULE, ALPHA, HUB, FILLET = 24, 5e-3, np.radians(20.0), 0.030, 1.5e-3
DISTANCE, START = 0.1201, np.radians(-9.0)
"""Of the axes [m], and the pinion's angle at the start."""
RELIEVED = 1e-3
"""Height of the tip relief, where the formula does not hold [m]."""
SAINSOT = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)
"""L*, M*, P*, Q* over 1/θ², h², h/θ, 1/θ, h, 1."""


def involute(angle: float | np.ndarray) -> float | np.ndarray:
    """Return inv α = tan α − α."""
    return np.tan(angle) - angle


@dataclass(frozen=True)
class Gear:
    """One gear of the pair."""

    pitch: float = MODULE * TEETH / 2

    @property
    def base(self) -> float:
        return float(self.pitch * np.cos(ALPHA))

    @property
    def tip(self) -> float:
        return self.pitch + MODULE

    @property
    def root(self) -> float:
        return self.pitch - 1.25 * MODULE

    @property
    def half(self) -> float:
        """Half the angle of a tooth at its base."""
        return float(np.pi / (2 * TEETH) + involute(ALPHA))

    @property
    def foot(self) -> float:
        """Half its angle at the root circle."""
        return self.half + float(np.arcsin(FILLET / (self.root + FILLET)))

    def profile(self) -> np.ndarray:
        """Return places along the axis of a tooth and its half thickness there [m], (p, 2), from the root on."""
        bend, centre = self.foot - self.half, self.root + FILLET
        turn = np.linspace(self.foot + np.pi, self.half + np.pi / 2, 200)[1:]
        fillet = centre * np.array([np.cos(self.foot), np.sin(self.foot)]) + FILLET * np.column_stack(
            [np.cos(turn), np.sin(turn)]
        )
        line = np.linspace(centre * np.cos(bend), self.base, 50)[1:, None] * [np.cos(self.half), np.sin(self.half)]
        radius = np.linspace(self.base, self.tip, 400)[1:]
        angle = self.half - involute(np.arccos(self.base / radius))
        flank = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return np.vstack([fillet, line, flank])

    def compliance(self, radius: float) -> float:
        """Return the deflection of tooth and foundation along the line of action per force at a radius [m/N]."""
        pressure = np.arccos(self.base / radius)
        angle = self.half - involute(pressure)
        at, thick, lean = radius * np.cos(angle), radius * np.sin(angle), pressure - angle
        x, y = self.profile().T
        here = x < at
        x, y = np.append(x[here], at), np.append(y[here], thick)
        moment = np.cos(lean) * (at - x) - np.sin(lean) * thick
        per_length = moment**2 / (E * 2 / 3 * y**3 * WIDTH)
        per_length += (1.2 * np.cos(lean) ** 2 * 2 * (1 + NU) + np.sin(lean) ** 2) / (E * 2 * y * WIDTH)
        tooth = float(simpson(per_length, x=x))
        h, foot = self.root / HUB, self.foot
        L, M, P, Q = SAINSOT @ [1 / foot**2, h**2, h / foot, 1 / foot, h, 1.0]
        lever = (at - thick * np.tan(lean) - self.root) / (2 * self.root * foot)
        ground = np.cos(lean) ** 2 / (E * WIDTH) * (L * lever**2 + M * lever + P * (1 + Q * np.tan(lean) ** 2))
        return tooth + float(ground)


def pair_stiffness(turned: np.ndarray) -> np.ndarray:
    """Return the stiffness of the pair of teeth 0 over the pinion's angle [N/m], NaN where it is not in contact.

    Args:
        turned: Angle of the axis of the pinion's tooth from the line of centres, along its motion, (s,).
    """
    gear = Gear()
    working = np.arccos(2 * gear.base / DISTANCE)
    # The flank meets the line of action where the roll angle from the base circle is this.
    roll = np.tan(working) + turned + gear.half - involute(working)
    length, whole = gear.base * roll, 2 * gear.base * np.tan(working)
    one, other = np.hypot(gear.base, length), np.hypot(gear.base, whole - length)
    least = np.pi * E * WIDTH / (4 * (1 - NU**2))
    found = np.full(len(turned), np.nan)
    effective = gear.tip - RELIEVED
    for k in np.flatnonzero((length > 0) & (length < whole) & (one <= effective) & (other <= effective)):
        found[k] = 1 / (gear.compliance(one[k]) + gear.compliance(other[k]) + 1 / least)
    return found


def formula(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh stiffness over the pinion's angle since the start [N/m], and the pairs in contact, (s,) each."""
    pitch = 2 * np.pi / TEETH
    pairs = np.array([pair_stiffness(START + angles + k * pitch) for k in (-1, 0, 1)])
    return np.nansum(pairs, axis=0), np.isfinite(pairs).sum(axis=0)


def iso_mean() -> float:
    """Return c_γ of ISO 6336-1 method B, without its factor 0.8 of measured gears, times the width [N/m]."""
    least = 0.04723 + (0.15551 + 0.25791) / TEETH
    gear = Gear()
    working = np.arccos(2 * gear.base / DISTANCE)
    contact = 2 * (np.sqrt(gear.tip**2 - gear.base**2) - gear.base * np.tan(working)) / (np.pi * MODULE * np.cos(ALPHA))
    return float(1e9 / least * (0.75 * contact + 0.25) * WIDTH)


def measured(found: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return of a run the pinion's angle since the start, the force [N] and the deflection of the mesh [m], (s,)."""
    gear = Gear()
    turned, driven = found.joints["shaft"].angle, found.joints["axle"].angle
    force = np.linalg.norm(sum(one.force for one in found.contacts.values()), axis=1)
    gap = 2 * gear.base * (involute(np.arccos(2 * gear.base / DISTANCE)) - involute(ALPHA))
    return turned, force, gear.base * (turned + driven) - gap


def main(scene: str = "data/gears") -> None:
    """Run the scene, and print its stiffness per width beside the formula's and that of ISO 6336-1."""
    found = gudgeon.run(scene, until="solve").trajectory()
    angles, force, deflection = measured(found)
    stiffness, pairs = formula(angles)
    for count in (1, 2):
        # Not at the start; tip relief lets the next pair take its load over some degrees.
        here = (pairs == count) & (np.cumsum(np.diff(pairs, prepend=0) != 0) > 1)
        ratio = (force / deflection)[here] / stiffness[here]
        print(
            f"{count} pairs by the formula: run over formula {ratio.mean():.3f}, {ratio.min():.3f} to {ratio.max():.3f}"
        )
    pitch = angles > angles[-1] - 2 * np.pi / TEETH
    mean, own = (float(one[pitch].mean()) * 1e-9 / WIDTH for one in (force / deflection, stiffness))
    print(
        f"mean over the last pitch: run {mean:.2f}, formula {own:.2f}, ISO {0.8e-9 * iso_mean() / WIDTH:.2f} N/(mm um)"
    )
    print(f"transmission error over it: {1e6 * float(np.ptp(deflection[pitch])):.1f} um, peak to peak")


if __name__ == "__main__":
    main(*sys.argv[1:])
