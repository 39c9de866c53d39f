"""Plans of a robot that has just started and rests, for studies without a running controller."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.dispatch.planner import Planner
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.planning.basis import FilterBasis, MotionBasis, PlanBasis, ToolBasis
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.setup import Setup, body
from tvist_protocol.commands import MoveJ
from tvist_protocol.motions import MoveC, MoveL, MovePath
from tvist_shaping.base import Filter

FLANGE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Tool centre point at the flange's origin [m, rad]."""


def plan_from_rest(
    setup: Setup, command: MoveJ | MoveL | MoveC | MovePath, tcp: Sequence[float] = FLANGE
) -> tuple[PlannedMove, Filter]:
    """Plan a motion as the robot of a setup does before its first tick.

    Args:
        setup: The robot; it rests at `q`, at full speed, with `shaper` for the declared payload.
        command: The motion; its token is not checked.
        tcp: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].

    Returns:
        The motion, and the filter that it was planned for, at rest at q = 0.

    Raises:
        RefusalError: There is no such motion, or it would lead to a collision.
        ValueError: There is no such shaper for this robot.
    """
    planner, q = Planner(setup), np.array(setup.q, dtype=float)
    first = planner.filters.first()
    source, tvist = first.source, first.tvist
    on = FilterBasis(tvist.name, tvist.estimator.modes, source, setup.payload, setup.payload)
    motion = MotionBasis(
        q=q,
        speed=1.0,
        slowest=None,
        excess=tvist.excess,
        surplus=tvist.surplus,
        tcp=tuple(tcp),
        declared_body=body(setup.payload),
        bodies=InverseDynamics(setup.description, body(setup.payload)).bodies,
        filter=on,
    )
    found = planner.plan(command, PlanBasis(on, motion, ToolBasis(tuple(tcp), q))).found
    if isinstance(found, RefusalError):
        raise found
    assert isinstance(found, PlannedMove)
    return found, tvist
