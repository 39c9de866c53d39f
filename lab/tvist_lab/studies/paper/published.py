"""Results in the paper: Thomsen, Søe-Knudsen, Brandt, Zhang, ICINCO 2019, doi 10.5220/0007834504880498."""

import json
from functools import cache
from importlib import resources
from typing import Any


@cache
def published() -> dict[str, Any]:
    """Return tables, configurations and captions of figures, with numbers."""
    return dict(json.loads((resources.files(__package__) / "published.json").read_text(encoding="utf-8")))


def pose(name: str) -> tuple[float, ...]:
    """Return the joint angles of Q1, Q2 or Q3 [rad]."""
    return tuple(published()["configurations"][name]["q"])


ARMS = ("ur5e", "ur5e_stiction")
"""Robots for the experiment: the first is fitted to Table 1, the second is also tuned to Table 2."""
MOTIONS = {"Q1-Q2": ("Q1", "Q2"), "Q1-Q3": ("Q1", "Q3"), "Q3-Q1": ("Q3", "Q1")}
"""Start and end of the three motions, by name."""
