"""Piecewise exact motion: linear between events, and every closing, opening, slip and stick located on it."""
