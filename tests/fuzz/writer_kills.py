"""Writers that are killed, each at a random moment of `put`.

No record is lost or wrong, and the next writer removes what the killed ones have left.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from tests.modaldb.samples import INPUTS, mesh

BRIEF, LONG = 3, 200
LONGEST_LIFE = 0.25
"""Seconds that a writer lives at most after its first record: some hundred records."""
WRITER = """
import itertools, sys
import numpy as np
from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records import NodalRecord
store = modaldb.open(sys.argv[1])
force = np.random.default_rng(int(sys.argv[2])).random((20_000, 3))
for number in itertools.count():
    inputs = {"round": int(sys.argv[2]), "number": number}
    record = NodalRecord(1e-6, force[:, 0], force + number, force, 0.0, number, 0, 0.0, 0.0)
    store.put(content_key(inputs), "nodal", record, inputs)
    print(number, flush=True)
"""


def main(count: int, seed: int = 1) -> Counter[str]:
    """Kill `count` writers; return the numbers of kills, of kills that left a scratch, and of records."""
    outcomes: Counter[str] = Counter()
    dice = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "db"
        for number in range(count):
            command = [sys.executable, "-c", WRITER, str(root), str(number)]
            with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
                assert writer.stdout is not None
                assert writer.stdout.readline() == b"0\n"
                left = len([*root.glob("??/.writing-*")])
                assert left <= 1, f"kill {number}: {left} scratches stand although a writer came after their own"
                time.sleep(dice.uniform(0, LONGEST_LIFE))
                os.kill(writer.pid, signal.SIGKILL)
                acknowledged = writer.stdout.read().split()
            outcomes["kills"] += 1
            outcomes["kills that left a scratch"] += bool([*root.glob("??/.writing-*")])
            store = modaldb.open(root)
            for one in [0, *map(int, acknowledged[:-1])]:
                assert store.has(content_key({"round": number, "number": one})), f"kill {number}: {one} was lost"
        for path, fault in modaldb.open(root).verify():
            assert fault is None, f"{path}: {fault}"
            outcomes["records"] += 1
        modaldb.open(root).put(content_key(INPUTS), "mesh", mesh(), INPUTS)
        assert not [path for path in root.rglob("*") if path.name.startswith(".")]
    return outcomes
