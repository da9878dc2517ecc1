"""Fuzzers: input that is wrong in any way gives one clear line or a sound result, never a traceback or a NaN.

Each module has `main(count, seed)`, which tries so many cases and returns the number of bad ones; `test_fuzz.py` runs
each briefly, `make fuzz` for long.
"""
