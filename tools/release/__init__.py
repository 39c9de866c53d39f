"""Releases: one version for all distributions, a dated changelog, a tag."""
