"""Fuzzers: input that is wrong in any way gives one clear line or a sound result, never a traceback, a crash or a NaN.

Each module that `__main__` names has `main(count, seed)`, which returns how often each outcome came and counts what
must not happen as `bad`, or raises there, and `BRIEF, LONG`, its counts in the tests and in `make fuzz`.
"""
