"""Initial setup of a controller: with the clients' messages, this determines all of its behaviour."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import msgspec
import numpy as np

from tvist_controller.cell.description import Cell
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.kinematics.pose import placement
from tvist_controller.sources.mode_source import ModeSource, first_source
from tvist_controller.sources.own_plants import OwnPlant
from tvist_controller.sources.own_shapers import OwnShaper
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription, is_real_body
from tvist_plant.foreign import called, measured_standing
from tvist_plant.model import carries_weight
from tvist_plant.plant import Plant, RealArm, SimulatedArm
from tvist_plant.surroundings import Hand
from tvist_plant.variants import hidden_variant
from tvist_protocol.calibration import Calibration, calibration_of
from tvist_protocol.commands import SetPayload
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Clock
from tvist_protocol.values import Payload, ResetMode
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.named import Registry

_RECORDED = (
    "description", "q", "payload", "carried", "mode", "calibration", "name", "shaper", "seed", "clock", "truth",
)  # fmt: skip
"""Fields stored unchanged in every recording."""
_LATER = ("compensate_sag", "shape_servo", "instance", "hidden")
"""Optional fields, missing in older recordings."""
Adapt = Literal["payload"]  # quantities that can be learnt from the robot's own motions


@dataclass(frozen=True)
class Setup:
    """Initial setup of a controller."""

    description: RobotDescription
    """Description of the robot."""
    q: tuple[float, ...]
    """Initial joint angles, at rest [rad]."""
    payload: Payload
    """Declared payload."""
    calibration: Calibration | None
    """Calibration of the estimator; None before identification, with the estimator `fixed` at 10 Hz and 0.2."""
    name: str = "ur5e"
    """Name of the robot on the network."""
    shaper: str = "zv"
    """Name of the shaper."""
    seed: int = 0
    """Seed of sensor noise and gear errors."""
    clock: Clock = "realtime"
    """Clock that advances time; leases and streams time out only with `realtime`."""
    carried: Payload | None = None
    """Carried payload until a client changes it; None for the declared one."""
    mode: ResetMode = "RUNNING"
    """Initial robot mode."""
    truth: bool = False
    """Whether to publish values that a real robot cannot measure."""
    own_shapers: tuple[OwnShaper, ...] = ()
    """Shapers from files, available by name in addition to the package's."""
    compensate_sag: bool = False
    """Whether set-points compensate the gears' twist under gravity, so that the arm rests on its target."""
    plant: OwnPlant | None = None
    """A plant from a file; None for the flexible arm of the description."""
    hidden: int | None = None
    """Seed of a hidden robot, see `tvist_plant.variants`; None for the robot as described."""
    shape_servo: bool = False
    """Whether `servoj`, `speedj` and `speedl` of programs are shaped if they start at rest."""
    cell: Cell | None = None
    """Wires, tools, gripper and parts around the robot; None for none."""
    adapt: Adapt | None = None
    """Quantity learnt from the arm's own motions; None for none."""
    positions: bool = False
    """Whether the arm's own controller takes positions only, without feed-forward torque."""
    instance: str = ""
    """Part of every lease token that identifies this run; empty where equal runs must be equal."""

    @cached_property
    def registry(self) -> Registry:
        """Shapers available to this robot; raise DesignError if two have the same name."""
        return Registry(own.shaper for own in self.own_shapers)

    def check(self, *, placed: bool = True) -> None:
        """Check what the types of the fields cannot express.

        Args:
            placed: Whether the arm will be placed at `q`; a watched robot stays where it is.

        Raises:
            ValueError: A value is out of range; the message names it.
        """
        joints = self.description.joints
        if len(self.q) != joints:
            model = self.description.robot.model
            raise ValueError(f"start has {len(self.q)} angles: must be {joints}, one per joint of a {model}")
        if placed:
            self._check_start()
        if self.hidden is not None and (self.truth or self.plant is not None):
            given = "truth is on" if self.truth else "a plant is given"
            raise ValueError(f"hidden is {self.hidden}, but {given}: leave one of them out")
        self.registry.check(self.shaper)
        if self.adapt == "payload" and not carries_weight(self.description):
            raise ValueError(
                f"adapt is payload, but no joint of a {self.description.robot.model} carries weight, so its torques do "
                "not tell it: leave adapt out, and declare the payload"
            )
        if self.cell is not None:
            self.cell.check()

    def _check_start(self) -> None:
        for number, (angle, limit) in enumerate(zip(self.q, self.description.limits.position, strict=True)):
            if not abs(angle) <= limit:
                raise ValueError(f"start q[{number}] is {angle}: must be within ±{limit} rad")
        if self.carried is not None and not is_real_body(self.carried.inertia):
            inertia = list(self.carried.inertia)
            raise ValueError(f"payload.inertia is {inertia}: no body has these moments of inertia")
        declared = body(self.payload)
        collisions = CollisionModel(self.description, declared)
        met = collisions.misplaced(np.array(self.q), declared, body(self.carried or self.payload))
        if met is not None:
            raise ValueError(f"start: {met}: choose a posture in which the arm and its payload are clear")

    def source(self) -> ModeSource:
        """Return the initial source of the vibration modes."""
        return first_source(self.description, self.calibration)

    def estimator(self) -> Estimator:
        """Return the initial estimator of the lowest mode."""
        return self.source().estimator(1, self.payload)

    def made_plant(self) -> Plant | None:
        """Make the plant, None for the flexible arm of the description; raise OwnFileError if that fails."""
        carried = body(self.carried or self.payload)
        if self.hidden is not None:
            arm = hidden_variant(self.hidden).make(self.description, carried, self.seed)
            return called(arm, self.description.joints, untold=True)
        made = None if self.plant is None else self.plant.make(self.description, carried, self.seed)
        tool = None if self.cell is None else self.cell.gripping_tool
        if tool is not None and made is not None and made.can(Plant.mount):
            assert self.cell is not None
            assert self.cell.gripper is not None
            tcp = placement(tool.tcp)
            made.mount(Hand(self.cell.gripper.stroke, tcp.position, tcp.rotation))
        return made

    def standing(self, plant: Plant | None) -> "Setup":
        """Return the setup for a plant: a plant that cannot be placed starts at its present position.

        Raises:
            ValueError: See `measured_standing`.
        """
        if plant is None or isinstance(plant, SimulatedArm):
            return self
        stands = replace(self, q=tuple(measured_standing(plant, len(self.q)).q.tolist()))
        if not (isinstance(plant, RealArm) and plant.supervised):
            return stands
        payload = payload_of(plant.payload)
        return replace(stands, description=plant.described(), payload=payload, carried=None, positions=True)

    def to_builtins(self) -> dict[str, Any]:
        """Convert the setup to maps and lists for a recording."""
        content = {name: getattr(self, name) for name in (*_RECORDED, "compensate_sag", "shape_servo")}
        content["own_shapers"] = [own.recorded for own in self.own_shapers]
        optional = {
            "cell": self.cell,
            "plant": self.plant and self.plant.recorded,
            "hidden": self.hidden,
            "instance": self.instance or None,
            "adapt": self.adapt,
        }
        content |= {name: value for name, value in optional.items() if value is not None}
        return dict(msgspec.to_builtins(content))

    @classmethod
    def from_builtins(
        cls, content: dict[str, Any], own_shapers: Sequence[OwnShaper] = (), plant: OwnPlant | None = None
    ) -> "Setup":
        """Restore a setup from a recording.

        Args:
            content: Result of `to_builtins`.
            own_shapers: Shapers from files that the recording names, loaded again.
            plant: Plant that the recording names, loaded again.

        Raises:
            ValueError: A part is missing or invalid.
        """
        try:
            calibration = content["calibration"]
            return cls(
                description=checked(content["description"], RobotDescription),
                q=tuple(map(float, content["q"])),
                payload=checked(content["payload"], Payload),
                carried=None if content["carried"] is None else checked(content["carried"], Payload),
                mode=msgspec.convert(content["mode"], ResetMode),
                calibration=None if calibration is None else calibration_of(calibration),
                own_shapers=tuple(own_shapers),
                plant=plant,
                cell=checked(content["cell"], Cell) if "cell" in content else None,
                adapt=msgspec.convert(content.get("adapt"), Adapt | None),
                **{name: content[name] for name in ("name", "shaper", "seed", "clock", "truth")},
                **{name: content[name] for name in _LATER if name in content},
            )
        except KeyError as error:
            raise ValueError(f"initial setup in the recording: {error.args[0]} is missing") from error
        except TypeError as error:
            raise ValueError(f"initial setup in the recording: {error}") from error
        except ProtocolError as error:
            raise ValueError(f"initial setup in the recording: {error.why}") from error


def body(payload: Payload) -> Body:
    """Convert a payload from the wire to the plant's type."""
    return Body(mass=payload.mass, com=payload.com, inertia=payload.inertia)


def payload_of(told: Body | SetPayload) -> Payload:
    """Return the payload that a command declares or a plant carries as a message."""
    return Payload(mass=told.mass, com=told.com, inertia=told.inertia)


def paper_payload(description: RobotDescription, mass: float | None = None) -> Payload:
    """Return the robot file's payload, scaled to another mass [kg]."""
    own = description.payload
    xx, xy, xz, yy, yz, zz = own.inertia
    share = 1.0 if mass is None or own.mass == 0.0 else mass / own.mass
    return Payload(
        mass=own.mass * share if mass is None or own.mass else mass,
        com=own.com,
        inertia=(xx * share, xy * share, xz * share, yy * share, yz * share, zz * share),
    )


def check_rating(declared: Payload, description: RobotDescription) -> None:
    """Raise ValueError if the declared payload, not the carried one, exceeds the robot's rating."""
    rated = description.limits.payload
    if declared.mass > rated:
        raise ValueError(
            f"payload is {declared.mass:g} kg, above the {description.robot.name}'s rating of {rated:g} kg"
        )
