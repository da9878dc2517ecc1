"""Ports: every place of a system at which a force acts, as rows over coordinates and over the residual flexibility."""
