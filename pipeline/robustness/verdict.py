"""From what a run found to right, refused or wrong."""

from dataclasses import dataclass, field

from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.rules import RULES, Compared, Finding
from gudgeon.pipeline.scenes.robustness import Case


@dataclass(frozen=True)
class Verdict:
    """What became of a case."""

    verdict: str
    """`right`, `refused`, `wrong`, or `does not apply`."""
    reason: str = ""
    """Of a refusal, of what is wrong, or why it does not apply."""
    deciding: Finding | None = None
    """The sharpest rule that holds, or the first that does not."""
    findings: list[Finding] = field(default_factory=list)


def judge(case: Case, found: Evidence | Refusal, compared: Compared) -> Verdict:
    """Return the verdict of a case that was run.

    Right needs every rule of the case that has something to say to hold, and at least one that has.
    """
    if isinstance(found, Refusal):
        if case.refusal:
            return Verdict("refused", found.reason)
        return Verdict("wrong", f"refused, which it must not be: {found.reason}")
    if compared.base.contact is not None and found.contact is None:
        return Verdict("wrong", "nothing touches, though the scene as it is does")
    findings = [one for name in case.rules if (one := RULES[name](found, compared)) is not None]
    if not findings:
        return Verdict("wrong", f"none of {', '.join(case.rules)} says anything of this scene")
    broken = next((one for one in findings if not one.holds), None)
    if broken is not None:
        text = f"{broken.rests_on}: {broken.value:.2g}, allowed: {broken.bound:.2g}"
        return Verdict("wrong", text, broken, findings)
    return Verdict("right", "", findings[0], findings)
