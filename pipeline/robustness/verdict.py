"""The verdict on a case, from the numbers of its run."""

from dataclasses import dataclass, field

from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.rules import COVERS, RULES, STEPPED, Compared, Finding
from gudgeon.pipeline.scenes.robustness import Case
from gudgeon.pipeline.stages.notes.run import DRIFT
from gudgeon.solver.capabilities import INTEGRATORS


@dataclass(frozen=True)
class Verdict:
    """The verdict on a case, with the rules that led to it."""

    verdict: str
    """`right`, `refused`, `wrong`, or `does not apply`."""
    reason: str = ""
    """Why it was refused, is wrong, or does not apply."""
    deciding: Finding | None = None
    """The strictest rule if all hold, else the first that does not hold."""
    findings: list[Finding] = field(default_factory=list)


def _told(one: Finding, found: Evidence, compared: Compared) -> str:
    """Return what a run says itself of a rule that does not hold, if that covers it."""
    if one.rule == "agreement" and found.stepped and found.stepped > STEPPED and one.value <= COVERS * found.stepped:
        return f"the run says that the given step has an error of about {found.stepped:.1%}"
    covered = ("energy", "creation")
    if compared.given_step and found.stepped is None:  # It has no other estimate of what the step leaves.
        covered += ("agreement", "momentum")
    if one.rule in covered and found.energy_drift and found.energy_drift > DRIFT:
        return f"the run says that its energy drift is {found.energy_drift:.2g}"
    return ""


def _may_part(case: Case, compared: Compared) -> bool:
    """Whether bodies may move elsewhere than to their contact: along each other, or by another mass in a mechanism."""
    kind = case.operation.kind
    return kind == "friction" or (kind == "mass" and INTEGRATORS[compared.base.integrator].turns)


def judge(case: Case, found: Evidence | Refusal, compared: Compared) -> Verdict:
    """Return the verdict of a case that was run.

    It is right if at least one rule of the case applies to the scene, and all that apply hold.
    """
    if isinstance(found, Refusal):
        if case.refusal:
            return Verdict("refused", found.reason)
        return Verdict("wrong", f"refused, which this case does not allow: {found.reason}")
    rules = case.rules
    if compared.base.contact is not None and found.contact is None:
        if not _may_part(case, compared):
            return Verdict("wrong", "no contact occurs, but the unchanged scene has contact")
        rules = ("penetration", *(name for name in rules if name != "penetration"))  # None may be missed.
    findings = [one for name in rules if (one := RULES[name](found, compared)) is not None]
    if not findings:
        return Verdict("wrong", f"none of the rules {', '.join(case.rules)} applies to this scene")
    for one in findings:
        if not one.holds:
            if case.refusal and (told := _told(one, found, compared)):
                return Verdict("refused", told, one, findings)
            return Verdict("wrong", f"{one.rests_on}: {one.value:.2g}, allowed: {one.bound:.2g}", one, findings)
    return Verdict("right", "", findings[0], findings)
