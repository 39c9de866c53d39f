"""Counts of what has reached a controller."""

from dataclasses import dataclass


@dataclass
class Counters:
    """Counts since the start."""

    commands: int = 0
    refused: int = 0
    setpoints_received: int = 0
    setpoints_refused: int = 0
    missed_ticks: int = 0
