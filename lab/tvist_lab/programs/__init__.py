"""Runs of robot programs: how they ended, their messages, and the vibration after each stop."""
