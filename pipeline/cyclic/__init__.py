"""Cyclic symmetry: a wheel of N equal sectors from one of them, and what mistuning does to it.

`cyclic_sector` finds the pairs of nodes; `harmonic_modes` and `tuned_modes` solve one harmonic or all of them;
`wheel_problem` assembles the whole wheel, blades mistuned or not; `SectorParts` reduces it by synthesis of sectors.
"""

from pipeline.cyclic.harmonic import HarmonicModes, harmonic_modes, tuned_frequencies, tuned_modes
from pipeline.cyclic.sector import CyclicSymmetry, Sector, cyclic_sector
from pipeline.cyclic.synthesis import (
    InterfaceChoice,
    SectorParts,
    Synthesis,
    compare_interfaces,
    sector_parts,
    synthesise,
)
from pipeline.cyclic.wheel import Mistuning, part_stiffness, wheel_frequencies, wheel_problem

__all__ = [
    "CyclicSymmetry",
    "HarmonicModes",
    "InterfaceChoice",
    "Mistuning",
    "Sector",
    "SectorParts",
    "Synthesis",
    "compare_interfaces",
    "cyclic_sector",
    "harmonic_modes",
    "part_stiffness",
    "sector_parts",
    "synthesise",
    "tuned_frequencies",
    "tuned_modes",
    "wheel_frequencies",
    "wheel_problem",
]
