"""Run fuzzers at length: `python -m tests.fuzz [NAME ...] [--seed N] [--count N]`, all of them by default."""

import argparse
import time
from importlib import import_module
from pathlib import Path

NAMES = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py") if not path.stem.startswith("test_"))


def run() -> None:
    """Run the fuzzers and print their outcomes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*NAMES, []], metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, help="of each fuzzer; default: its own")
    options = parser.parse_args()
    for name in options.names or NAMES:
        fuzzer = import_module(f"tests.fuzz.{name}")
        begun = time.perf_counter()
        outcomes = fuzzer.main(options.count or fuzzer.LONG, options.seed)
        text = ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items()))
        print(f"{name}: {text}; {time.perf_counter() - begun:.0f} s", flush=True)


if __name__ == "__main__":
    run()
