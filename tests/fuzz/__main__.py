"""Run fuzzers at length: `python -m tests.fuzz [NAME ...] [--seed N] [--count N]`, all of them by default."""

import argparse
import sys
import time
from importlib import import_module

NAMES = ("decks", "full_disk", "mesh_files", "out_folders", "records", "run_kills", "scenes", "signals", "solutions",
         "superelements", "writer_kills")  # fmt: skip


def run() -> None:
    """Run the fuzzers and print their outcomes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*NAMES, []], metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, help="of each fuzzer; default: its own")
    options, bad = parser.parse_args(), 0
    for name in options.names or NAMES:
        fuzzer = import_module(f"tests.fuzz.{name}")
        begun = time.perf_counter()
        outcomes = fuzzer.main(options.count or fuzzer.LONG, options.seed)
        bad += outcomes["bad"]
        text = ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items()))
        print(f"{name}: {text}; {time.perf_counter() - begun:.0f} s", flush=True)
    sys.exit(min(bad, 1))


if __name__ == "__main__":
    run()
