"""Every command has one row, which says all that is true of it."""

from typing import get_args

from tvist_controller.dispatch.table import COMMANDS
from tvist_controller.planning.snapshot import MOTION
from tvist_protocol import commands as c
from tvist_protocol.channels import tag
from tvist_protocol.transitions import TRANSITIONS, Activity


def test_every_command_has_a_row():
    assert set(COMMANDS) == set(get_args(c.Command))


def test_what_is_planned_on_the_arm_at_rest_is_what_moves_it_along_a_path():
    """The row says on which state a command is planned, the table of transitions where it leads."""
    planned = {tag(row.message) for row in COMMANDS.values() if row.plan and row.plan.needs is MOTION}
    assert planned == {row.trigger for row in TRANSITIONS if row.target is Activity.MOVING} - {"resume"}
