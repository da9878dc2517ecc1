"""Fuzzers. Each file has `main(count, seed)`, which raises at the first case that must not happen and returns how often
each outcome came, and `BRIEF, LONG`, its counts in the tests and in `make fuzz`.
"""
