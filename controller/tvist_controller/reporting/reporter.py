"""Conversion of a tick's signals into messages for clients."""

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.rotation import rotation_vector
from tvist_controller.line.sample import Sample
from tvist_controller.reporting.report import Layouts, Report
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats
from tvist_plant.plant import PERIOD, InWorld, ModalPlant, Plant, PlantTruth, Truthful
from tvist_protocol.stream import Truth
from tvist_shaping.base import Filter

NO_MODES: dict[str, list[float]] = {"f_d": [], "zeta": [], "participation": []}
TRUE_MODES_EVERY = 50
"""Ticks between two computations of the arm's true modes, whose eigenvalue problem takes a good part of a tick."""


class Reporter:
    """Creates reports and truths.

    Args:
        description: The robot.
        plant: Its arm, of which truths are.
    """

    def __init__(self, description: RobotDescription, plant: Plant) -> None:
        self._joints = description.joints
        self._arm = Arm(description)
        self._layouts = Layouts()
        self._true_modes: dict[str, list[float]] = {}
        self._plant = plant
        self._modal = plant if isinstance(plant, ModalPlant) else None
        self._world = plant if isinstance(plant, InWorld) else None

    def report(
        self,
        tick: int,
        sample: Sample,
        tvist: Filter,
        drive_delay: float,
        modes: tuple[int, int, int],
        speed: float,
        setpoint_sequence: int | None,
        missed_ticks: int,
    ) -> Report:
        """Return the report of a tick; every tick needs one.

        Args:
            tick: Number of the tick.
            sample: Signals along the control line.
            tvist: The filter.
            drive_delay: Time by which commands for the drives are later than their targets [s].
            modes: Present robot mode, safety mode and runtime state.
            speed: Share of the programmed speed [-].
            setpoint_sequence: Sequence number of the newest accepted set-point.
            missed_ticks: Number of ticks that began too late.
        """
        return Report(
            tick, sample, modes, speed, tvist.f_d, tvist.zeta, tvist.delay + drive_delay,
            tvist.clipped, setpoint_sequence, missed_ticks, self._arm, self._layouts,
        )  # fmt: skip

    def set_tcp(self, offset: tuple[float, ...]) -> None:
        """Set the tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
        self._arm = self._arm.with_tool(offset)

    def truth(self, tick: int, *, with_modes: bool) -> Truth:
        """Return what a real robot cannot measure, after a tick.

        Its modes are updated every `TRUE_MODES_EVERY` ticks; they are empty lists if the plant does not provide them.

        Args:
            tick: Number of the tick.
            with_modes: Whether modes are wanted: they take half a tick to compute.

        Raises:
            ValueError: The plant does not provide the truth.
        """
        if with_modes and (not self._true_modes or tick % TRUE_MODES_EVERY == 0):
            modes = None if self._modal is None else self._modal.modes()
            self._true_modes = {
                name: [] if modes is None else getattr(modes, name)[: self._joints].tolist()
                for name in ("f_d", "zeta", "participation")
            }
        truth, world = truth_of(self._plant), self._world
        return Truth(
            tick=tick,
            timestamp=tick * PERIOD,
            motor_q=truth.motor_q.tolist(),
            motor_qd=truth.motor_qd.tolist(),
            gear_deflection=truth.gear_deflection.tolist(),
            link_deflection=truth.link_deflection.tolist(),
            flange_pose=truth.flange_position.tolist() + rotation_vector(truth.flange_rotation),
            tool_acceleration=truth.specific_force.tolist(),
            static_gear_deflection=_listed(truth.static_gear_deflection),
            static_link_deflection=_listed(truth.static_link_deflection),
            body_poses=[] if world is None else world.places().ravel().tolist(),
            contact_force=[] if world is None else world.contact().tolist(),
            **(self._true_modes or NO_MODES),
        )

    def forget_modes(self) -> None:
        """Have the modes computed anew, since the arm was placed elsewhere."""
        self._true_modes = {}


def truth_of(plant: Plant) -> PlantTruth:
    """Return what a real robot cannot measure, from a plant that provides it.

    Raises:
        ValueError: The plant does not provide it.
    """
    truth = plant.truth() if isinstance(plant, Truthful) else None
    if truth is None:
        raise ValueError(
            f"truth is on, but the plant {type(plant).__name__} cannot report it: turn truth off"
        )
    return truth


def _listed(values: Floats | None) -> list[float]:
    return [] if values is None else list(values.tolist())
