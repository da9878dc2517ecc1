"""The verdict on a case, from the numbers of its run."""

from dataclasses import dataclass, field

from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.rules import COVERS, RULES, STEPPED, Compared, Finding, record
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


def _told(finding: Finding, evidence: Evidence, compared: Compared) -> str:
    """Return what a run says itself of a rule that does not hold, if that covers it."""
    if (
        finding.rule == "agreement"
        and evidence.stepped
        and evidence.stepped > STEPPED
        and finding.value <= COVERS * evidence.stepped
    ):
        return f"the run says that the given step has an error of about {evidence.stepped:.1%}"
    covered = ("energy", "creation")
    if compared.given_step and evidence.stepped is None:  # It has no other estimate of what the step leaves.
        covered += ("agreement", "momentum")
    if finding.rule in covered and evidence.energy_drift and evidence.energy_drift > DRIFT:
        return f"the run says that its energy drift is {evidence.energy_drift:.2g}"
    return ""


def _may_part(case: Case, compared: Compared) -> bool:
    """Whether bodies may move elsewhere than to their contact: along each other, or by another mass in a mechanism."""
    kind = case.operation.kind
    return kind == "friction" or (kind == "mass" and INTEGRATORS[compared.base.integrator].turns)


def judge(case: Case, evidence: Evidence | Refusal, compared: Compared) -> Verdict:
    """Return the verdict of a case that was run.

    It is right if at least one rule of the case applies to the scene, and all that apply hold.
    """
    if isinstance(evidence, Refusal):
        if case.refusal:
            return Verdict("refused", evidence.reason)
        return Verdict("wrong", f"refused, which this case does not allow: {evidence.reason}")
    rules = case.rules
    if compared.base.contact is not None and evidence.contact is None:
        if not _may_part(case, compared):
            return Verdict("wrong", "no contact occurs, but the unchanged scene has contact")
        rules = ("penetration", *(name for name in rules if name != "penetration"))  # None may be missed.
    findings = [finding for name in rules if (finding := RULES[name](evidence, compared)) is not None]
    if not findings:
        return Verdict("wrong", f"none of the rules {', '.join(case.rules)} applies to this scene")
    findings.append(record(evidence))
    for failing in findings:
        if not failing.holds:
            if case.refusal and (text := _told(failing, evidence, compared)):
                return Verdict("refused", text, failing, findings)
            return Verdict(
                "wrong", f"{failing.rests_on}: {failing.value:.2g}, allowed: {failing.bound:.2g}", failing, findings
            )
    return Verdict("right", "", findings[0], findings)
