"""Releases: clean environments, and wheels with machine code."""
