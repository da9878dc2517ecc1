"""The list of deliberate faults: each stands where it says, once, and its tests are there."""

from pathlib import Path

from tests.mutants.native import NATIVE
from tests.mutants.python import PYTHON

ROOT = Path(__file__).resolve().parents[1]
SUBJECTS = {"reduction", "morph", "laws", "response", "estimates", "store", "service", "log"}


def test_each_fault_stands_once_in_its_source() -> None:
    wrong = [fault for fault in (*NATIVE, *PYTHON) if (ROOT / fault.file).read_text().count(fault.old) != 1]
    assert wrong == []


def test_faults_of_python_compile() -> None:
    for fault in PYTHON:
        compile((ROOT / fault.file).read_text().replace(fault.old, fault.new), fault.file, "exec")


def test_there_are_enough_of_every_subject() -> None:
    faults = [*NATIVE, *PYTHON]
    assert len({(fault.file, fault.old, fault.new) for fault in faults}) == len(faults) >= 150
    assert {fault.subject for fault in faults} == SUBJECTS
    for file, _, name in {test.partition("::") for fault in faults for test in fault.tests}:
        assert f"def {name}" in (ROOT / file).read_text()
    assert all(fault.native for fault in NATIVE)
