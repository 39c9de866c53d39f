"""Searches for violations of a robot's guarantees: in stops, streams, changes during motion, and whole sequences."""
