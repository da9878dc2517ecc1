"""Contacts whose interfaces are found by proximity."""
