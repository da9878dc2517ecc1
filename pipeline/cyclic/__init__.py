"""Cyclic symmetry: a wheel of N equal sectors from one of them, and what mistuning does to it.

`cyclic_sector` finds the pairs of nodes; `harmonic_modes` and `tuned_modes` solve one harmonic or all of them;
`wheel_problem` assembles the whole wheel, blades mistuned or not; `synthesise` reduces it by synthesis of sectors;
`engine_order_response` gives the blades' amplitudes of either.
"""

from gudgeon.pipeline.cyclic.forced import (
    blades_of_synthesis,
    blades_of_wheel,
    direct_response,
    engine_order_response,
    magnification,
)
from gudgeon.pipeline.cyclic.harmonic import HarmonicModes, harmonic_modes, tuned_frequencies, tuned_modes
from gudgeon.pipeline.cyclic.sector import Sector, cyclic_sector
from gudgeon.pipeline.cyclic.synthesis import InterfaceChoice, SectorParts, Synthesis, sector_parts, synthesise
from gudgeon.pipeline.cyclic.whole_wheel import (
    Mistuning,
    part_stiffness,
    wheel_frequencies,
    wheel_motion,
    wheel_problem,
)
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry

__all__ = [
    "CyclicSymmetry",
    "HarmonicModes",
    "InterfaceChoice",
    "Mistuning",
    "Sector",
    "SectorParts",
    "Synthesis",
    "blades_of_synthesis",
    "blades_of_wheel",
    "cyclic_sector",
    "direct_response",
    "engine_order_response",
    "harmonic_modes",
    "magnification",
    "part_stiffness",
    "sector_parts",
    "synthesise",
    "tuned_frequencies",
    "tuned_modes",
    "wheel_frequencies",
    "wheel_motion",
    "wheel_problem",
]
