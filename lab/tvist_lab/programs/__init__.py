"""Runs of robot programs: how they ended, what they said, and how much the tool shook after each stop."""
