"""The lists of a state that instruments compute from, as one array, which takes less time than one for each."""

from struct import pack

import numpy as np

from tvist_plant.model import Floats
from tvist_protocol.stream import State

JOINT_LISTS = (
    "target_q", "target_qd", "target_qdd", "shaped_q", "shaped_qd", "shaped_qdd", "shaped_moment", "actual_q",
    "actual_qd", "actual_moment",
)  # fmt: skip
"""Rows by the names of RTDE's variables: the reference before shaping, the one after it with the torques that it needs,
and what is measured."""
ROWS = len(JOINT_LISTS)
UNSHAPED, SHAPED = slice(0, 3), slice(3, 6)
"""Rows of the two references: positions, velocities and accelerations."""
SHAPED_QD, SHAPED_QDD, SHAPED_MOMENT, ACTUAL_Q, ACTUAL_QD, ACTUAL_MOMENT = range(4, ROWS)
"""Single rows."""


def joint_lists(state: State) -> bytearray:
    """Return the rows one behind the other, as doubles in the machine's order."""
    q, qd, qdd = state.target_q, state.target_qd, state.target_qdd
    unshaped = (
        *(q if state.unshaped_q is None else state.unshaped_q),
        *(qd if state.unshaped_qd is None else state.unshaped_qd),
        *(qdd if state.unshaped_qdd is None else state.unshaped_qdd),
    )
    shaped = *q, *qd, *qdd, *state.target_moment
    measured = *state.actual_q, *state.actual_qd, *state.actual_moment
    return bytearray(pack(f"{ROWS * len(q)}d", *unshaped, *shaped, *measured))


def as_rows(lists: bytearray) -> Floats:
    """Return what `joint_lists` has made as an array, shape (10, n)."""
    return np.ndarray((ROWS, len(lists) // (8 * ROWS)), buffer=lists)
