"""Measurements of speed on this machine: each part, served robots, and long runs of both."""
