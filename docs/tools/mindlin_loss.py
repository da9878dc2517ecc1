"""Loss in a cycle of Mindlin's sphere (N1) over the mesh: `python -m docs.tools.mindlin_loss [SIZE/a …]`.

Halves of two caps whose meshes do not match, elements of the lower one 1.3 times as large. In the second column the
compliance across is k times the normal one, k = (2 − ν)/(2 − 2ν): the loss then follows from normal contact alone
(Ciavarella, J. Appl. Mech. 65, 1998, 998), and what is left is its error.
"""

import sys
import tempfile
from pathlib import Path

from tests.validation.friction.statics import lost_in_a_cycle, proportional, statics_of
from tests.validation.friction.test_mindlin import AMPLITUDE, LOST, RADIUS, half_pair

SIZES = (0.35, 0.27, 0.24, 0.2, 0.17, 0.15)


def main(sizes: list[float]) -> None:
    """Print the errors of loss and stick radius of each size of elements."""
    print("| elements of the upper cap over a | points | loss | with proportional compliance | stick radius |")
    print("|---|---|---|---|---|")
    for size in sizes:
        with tempfile.TemporaryDirectory() as folder:
            pair = half_pair(Path(folder), size)
        found = statics_of(pair)
        (loss, stick), (normal, _) = (lost_in_a_cycle(one) for one in (found, proportional(found)))
        errors = (loss / LOST["value"] - 1, normal / LOST["value"] - 1,
                  stick / RADIUS["value"] / (1 - AMPLITUDE) ** (1 / 3) - 1)  # fmt: skip
        print(f"| {size:g} | {len(pair.areas)} | {' | '.join(f'{100 * one:+.1f} %' for one in errors)} |", flush=True)


if __name__ == "__main__":
    main([float(one) for one in sys.argv[1:]] or list(SIZES))
