"""Rigid bodies as the arm carries them: placed in the flange frame, and joined."""

import pinocchio as pin

from tvist_controller.cell.description import Part, Tool
from tvist_controller.paths.poses import Placement
from tvist_plant.description import Payload
from tvist_plant.model import payload_inertia


def tool_body(tool: Tool) -> Payload:
    """Return a tool as a payload."""
    return Payload(mass=tool.mass, com=tool.cog, inertia=tool.inertia)


def part_body(part: Part, place: Placement) -> Payload:
    """Return a part as a payload, from the pose of its frame in that of the flange."""
    own = Payload(mass=part.mass, com=part.cog, inertia=part.inertia)
    return _payload(pin.SE3(place.rotation, place.position).act(payload_inertia(own)))


def joined(tool: Payload, part: Payload, share: float) -> Payload:
    """Return two bodies as one, of which the second counts with a share of its mass.

    Args:
        tool: The first.
        part: The second.
        share: Share of its mass and inertia, 0 to 1 [-].
    """
    if share == 0.0 or part.mass == 0.0:
        return tool
    own = payload_inertia(part)
    return _payload(payload_inertia(tool) + pin.Inertia(share * own.mass, own.lever, share * own.inertia))


def _payload(inertia: pin.Inertia) -> Payload:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.inertia.tolist()
    x, y, z = inertia.lever.tolist()
    return Payload(mass=float(inertia.mass), com=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz))
