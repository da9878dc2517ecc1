"""Tests of `gudgeon feel`."""
