"""Extraction of normal modes beside peers, whole jobs in processes of their own: `python -m tests.benchmarks.modes`."""
