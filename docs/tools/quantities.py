"""`python -m docs.tools.quantities`: write docs/quantities.md from the registry of quantities."""

from pathlib import Path

from gudgeon.solver.registry import REGISTRY, Quantity

PAGE = Path(__file__).resolve().parents[1] / "quantities.md"
HEAD = """# Quantities of a run

Written by `python -m docs.tools.quantities` from `solver/registry.py`. Every integrator gives the same quantities, and
so does full FE where it records them. A scene names them as `OWNER.name` in `report.quantities`, and `summary.json`
lists them with value and unit. N is a number from 1.

An impact is a time in which a normal force acts on a contact. The window is `run.window`. Impacts that are separated by
less than it are one. By default that time is 2.5 periods of the highest kept frequency of an elastic body in contact,
of several bodies the longest of these periods, one period where all contacts have nonlinear laws, at most the duration
of the run, and 0 for rigid bodies: the modes resolve a force over it. The window of a contact is then a tenth of its
hardest impact, at most that time; where it is below the shortest kept period, `force_resolved` is the force over that
time. Contacts of methods without residual flexibility keep that time as their window. A peak force is a mean over the
window of the mean over the window; the raw peak, a further quantity, contains the cut-off frequency of the modal basis
and does not converge. The default of full FE is two steps with a law, else the shortest period that its steps resolve.
"""
TITLES = {
    "contact": "`CONTACT.`: contacts", "body": "`BODY.`: bodies with rigid motions", "force": "`FORCE.`: moving forces",
    "joint": "`JOINT.`: joints of two markers",
    "gauge": "`BODY.GAUGE.`: gauges", "probe": "`PROBE.`: probes",
    "component": "`COMPONENT.`: components",
}  # fmt: skip


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for owner, title in TITLES.items():
        rows = [_row(one) for one in REGISTRY if one.owner == owner]
        head = "| name | unit | definition | sign | bandwidth |\n|---|---|---|---|---|\n"
        parts.append(f"\n## {title}\n\n{head}" + "\n".join(rows) + "\n")
    return "".join(parts)


def _row(one: Quantity) -> str:
    cells = f"`{one.name}`", one.unit, one.definition.replace("|", "\\|"), one.sign, one.bandwidth
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
