"""Costs of mechanisms."""
