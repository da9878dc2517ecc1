"""A cyclic chain of two-mass sectors, a bladed disk in small: F5 of the reference set, tuned and mistuned."""

from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.wheel.cyclic.harmonic import harmonic_modes, tuned_frequencies
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import lowest_pairs
from gudgeon.pipeline.applications.wheel.cyclic.synthesis import InterfaceChoice, sector_parts, synthesise
from gudgeon.pipeline.applications.wheel.cyclic.whole_wheel import wheel_problem
from tests.validation.cyclic_chain import F5, chain, tuned_modes, wheel_frequencies

EXACT = 1e-11
"""Round-off of a dense eigenproblem; the reference itself is good to 1e-12 and asks for 1e-9."""


@pytest.mark.parametrize("expected", F5["expected"]["tuned"], ids=lambda one: f"n={one['nodal_diameter']}")
def test_f5_tuned(expected: dict[str, Any]) -> None:
    modes = harmonic_modes(chain()[0], expected["nodal_diameter"], 2)
    np.testing.assert_allclose(modes.angular_frequencies / (2 * np.pi), expected["f_Hz"], rtol=EXACT)
    assert modes.multiplicity == expected["multiplicity"]


def test_f5_mistuned() -> None:
    sector, mistuning = chain()
    ours = wheel_frequencies(sector, 24, mistuning) / (2 * np.pi)
    np.testing.assert_allclose(ours, F5["expected"]["mistuned_f_Hz"], rtol=EXACT)


def test_f5_by_synthesis_is_exact() -> None:
    """A sector's only interior dof is its blade: one fixed-interface mode is all of it."""
    sector, mistuning = chain()
    parts = sector_parts(sector, 1)
    for kept, count in ((True, 0), (False, None), (False, 1)):
        one = synthesise(parts, InterfaceChoice(np.array([kept]), count), 24, mistuning)
        np.testing.assert_allclose(one.angular_frequencies / (2 * np.pi), F5["expected"]["mistuned_f_Hz"], rtol=EXACT)


def test_f5_harmonics_are_the_wheel() -> None:
    sector, _ = chain()
    ours = tuned_frequencies(tuned_modes(sector, 2))
    np.testing.assert_allclose(ours, wheel_frequencies(sector, len(ours)), rtol=EXACT)


def test_f5_localisation() -> None:
    """The largest share that one blade has in the blades' energy, mode by mode of the first family."""
    sector, mistuning = chain()
    blades = lowest_pairs(wheel_problem(sector, mistuning), 12).vectors[1::2]
    share = blades**2 / (blades**2).sum(axis=0)
    np.testing.assert_allclose(share.max(axis=0), F5["expected"]["mistuned_localisation_of_first_family"], rtol=1e-9)
