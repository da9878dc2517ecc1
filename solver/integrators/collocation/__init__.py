"""Integrators of contact laws, smooth functions of indentation: exact modal motion under forces to be found."""
