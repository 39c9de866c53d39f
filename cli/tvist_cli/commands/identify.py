"""`tvist identify`: identify a robot's vibration, or its payload, from the robot's own sensors."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.identified import report_from_logs, report_modal, report_payload, report_polynomial
from tvist_cli.output import progress, typed, waiting
from tvist_cli.poses import pose
from tvist_cli.robot_logs import robot_logs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_client.arm import Arm
    from tvist_client.robot import Robot
    from tvist_lab.identification.identify import Identification
    from tvist_lab.identification.modal import ModalIdentification
    from tvist_lab.identification.payload import PayloadFound
    from tvist_plant.description import RobotDescription
    from tvist_protocol.calibration import Calibration
    from tvist_protocol.info import Info

ROBOT = "ur5e"
"""Robot that is identified unless another one is named."""

Doing = Callable[["Robot", "Arm"], Awaitable[Any]]


def identify(
    endpoint: str | None = None,
    *,
    plant: str | None = None,
    yes: bool = False,
    output: Path = Path("calibration.json"),
    name: str | None = None,
    from_: Annotated[list[Path] | None, Parameter(name="--from")] = None,
    columns: str | None = None,
    robot: str | None = None,
    description: str | None = None,
    security: Path | None = None,
    namespace: str = "",
    model: Literal["polynomial", "modal"] = "polynomial",
    payload: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    configurations: int = 160,
    repeats: int = 3,
    ring_downs: int = 12,
    payloads: str | None = None,
    poses: int = 6,
    declare: bool = False,
    seed: int = 0,
    at: list[str] | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Excite the arm, fit its vibration and write a calibration; or identify the payload; or do with logs alone.

    The polynomial model describes the lowest mode with one payload, from many configurations: about a minute in this
    process, half an hour over a network. The modal model describes every mode with any payload, from a dozen
    ring-downs: seconds in this process, a minute over a network. --payload without a mass makes no calibration, but
    identifies mass and centre of mass of the payload from the joint torques.

    --from moves nothing: the stops of everyday motions in recordings and logs tell the modal model, and the polynomial
    one where they cover the workspace. It says how much of the workspace they tell, and which three moves would tell
    most.

    --plant ur://ADDRESS moves a robot of UR's, which takes positions and tells its angles and the accelerometer of its
    tool. It starts tvist serve --enable-motion for it, shows a plan of small moves as a table and a picture, and asks
    before anything moves. Both models are made, the polynomial one only if the moves cover the workspace, and the lag
    of the robot's servo is in the file, too.

    Without an endpoint, a robot is simulated in this process as fast as possible.

    Args:
        endpoint: Zenoh endpoint of a served robot.
        plant: Address of a robot of UR's to move and identify, ur://ADDRESS[:PORT].
        yes: With --plant: move without asking.
        output: Calibration file to write.
        name: Name of the calibration; default: the name of the file.
        from_: Recording or log of the robot to identify it from without moving it, repeatable.
        columns: Names of a CSV's columns with --from if they are not RTDE's; see tvist log analyze.
        robot: Name of the served robot [ur5e]; in this process, the robot file [ur5e]; with --from, the robot file [the
            one whose model the logs name].
        description: Robot file with the link masses of a served robot; default: the UR5e's.
        namespace: Namespace of the robot, if it is served in one.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        model: Model to fit.
        payload: Mass of the disc that the robot simulated in this process carries in kg, or with --from that the arm
            carried [what the logs say]. Without a mass: identify the payload.
        configurations: Number of configurations, spread over the workspace (polynomial).
        repeats: Number of jogs averaged in each configuration (polynomial).
        ring_downs: Total number of ring-downs (modal).
        payloads: Masses in kg, separated by commas, that a simulated arm carries in turn (modal); default: nothing and
            the robot file's payload in this process, which is 0,5 for the ur5e; the declared payload over a network.
        poses: Number of poses in which the arm rests to identify the payload.
        declare: Declare the identified payload to the robot.
        seed: Seed of the choice of configurations and, in this process, of noise and gear errors.
        at: Poses to measure with more weight (polynomial): names from the robot file, or angles separated by commas
            [all poses of the robot file].
        figures: Folder to write figures to: the fit (polynomial) and, in this process, maps of the lowest mode's
            frequency and damping over the workspace, identified against true.
        look: How to write the figures.
        json: Print one JSON object.
    """
    if min(configurations, repeats, ring_downs, poses) < 1:
        raise Failure("configurations, repeats, ring-downs and poses must be at least 1", code=2)
    _check_model(model, payloads, at)
    look.check(figures)
    if not output.absolute().parent.is_dir():  # said before half an hour of jogs
        raise Failure(f"output is {output}: its folder does not exist", code=2)
    endpoint, mass = _endpoint_and_mass(endpoint, payload)
    if plant is not None or yes:
        others = endpoint, from_, description, columns
        _at_robot(plant, robot, mass, ring_downs, seed, output, name, others, sure=yes, json=json)
        return
    if from_:
        if endpoint is not None or description is not None or (payload is not None and mass is None):
            raise Failure(
                "--from identifies from logs alone: leave out endpoint and description, and name a mass",
                code=2,
            )
        _from_logs(from_, robot, mass, columns, output, name or output.stem, json=json)
        return
    if columns is not None:
        raise Failure("columns is for logs: give --from too, or leave it out", code=2)
    robot = robot or ROBOT
    from tvist_plant.description import DescriptionError, load

    with told(DescriptionError, code=2):
        arm = load(description or (robot if endpoint is None else ROBOT))
    place = _Place(endpoint, robot, security, namespace, mass, seed)
    called = name or output.stem
    if payload is not None and mass is None:
        _payload(place, arm, poses, declare=declare, json=json)
    elif model == "modal":
        whole = payloads is None and mass is None and endpoint is None
        masses = f"0,{arm.payload.mass:g}" if whole else payloads
        _modal(place, arm, ring_downs, masses, output, called, figures, look, json=json)
    else:
        anchors = place.anchors(at)
        _polynomial(place, arm, anchors, configurations, repeats, output, called, figures, look, json=json)


def _check_model(model: str, payloads: str | None, at: list[str] | None) -> None:
    if model == "polynomial" and payloads is not None:
        raise Failure("payloads is for the modal model: give --model modal too, or leave it out", code=2)
    if model == "modal" and at:
        raise Failure("at is for the polynomial model: leave it out, or give --model polynomial", code=2)


def _at_robot(
    plant: str | None,
    robot: str | None,
    mass: float | None,
    ring_downs: int,
    seed: int,
    output: Path,
    name: str | None,
    others: tuple[object, ...],
    *,
    sure: bool,
    json: bool,
) -> None:
    if plant is None:
        raise Failure("yes is for --plant: give that too, or leave it out", code=2)
    if any(others):
        raise Failure(
            "--plant starts its own server: leave out endpoint, --from, --columns and --description", code=2
        )
    from tvist_cli.identified_robot import identify_robot

    called = name or output.stem
    identify_robot(plant, robot or ROBOT, mass, ring_downs, seed, output, called, sure=sure, json=json)


class _Place:
    """The robot to identify: a served one, or one in this process."""

    def __init__(
        self,
        endpoint: str | None,
        robot: str,
        security: Path | None,
        namespace: str,
        mass: float | None,
        seed: int,
    ) -> None:
        from tvist_controller.setup import check_rating
        from tvist_lab.in_process import free_setup
        from tvist_server.config import from_mapping
        from tvist_server.option_values import StartError

        self.endpoint, self.robot, self.mass, self.seed = endpoint, robot, mass, seed
        self.security, self.namespace = security, namespace
        self._setup = None
        if endpoint is None:
            content = {
                "robot": robot,
                "payload": mass,
                "overload": True,  # refused below, without the hint for who serves
                "calibration": "none",
                "clock": "free",
                "seed": seed,
                "truth": True,
            }
            with told(StartError, code=2):
                self._setup = free_setup(from_mapping(content, "options"))
            with told(ValueError, code=2):
                check_rating(self._setup.payload, self._setup.description)

    @property
    def options(self) -> str:
        """Option that names the robot in this process, where it is not the default."""
        return f" --robot {self.robot}" if self._setup is not None and self.robot != ROBOT else ""

    def anchors(self, names: list[str] | None) -> list[tuple[float, ...]]:
        """Return poses of the robot, or angles; by default all poses that it has a name for."""

        async def info(client: "Robot", _arm: "Arm") -> "Info":
            return await client.info()

        known: Info = self.run(info)
        return [_pose(text, known.poses, len(known.joints)) for text in names or known.poses]

    def run(self, doing: Doing) -> Any:
        """Run a coroutine as a client with control."""

        async def whole() -> Any:
            async with self._controlled() as (client, arm):
                return await doing(client, arm)

        return asyncio.run(whole())

    def calibrate(self, ring_downs: int, doing: Callable[..., Awaitable[Any]], output: Path) -> Any:
        """Run an identification that makes so many ring-downs, and write its calibration."""
        from tvist_lab.identification.fit import FitError
        from tvist_protocol.calibration import calibration_to_json

        with told(FitError, OSError):
            with progress(ring_downs, "ring-downs") as bar:
                done = self.run(partial(doing, progress=lambda: bar(1, None)))
            output.write_bytes(calibration_to_json(done.calibration))
        return done

    @asynccontextmanager
    async def _controlled(self) -> "AsyncIterator[tuple[Robot, Arm]]":
        from tvist_client.robot import Robot
        from tvist_lab.in_process import robot_in_process

        async with AsyncExitStack() as stack:
            if self._setup is not None:
                client = await stack.enter_async_context(robot_in_process(self._setup))
            else:
                connected = await Robot.connect(
                    str(self.endpoint), self.robot, security=self.security, namespace=self.namespace
                )
                client = await stack.enter_async_context(connected)
            yield client, await stack.enter_async_context(client.control("identify"))


def _polynomial(
    place: _Place,
    arm: "RobotDescription",
    anchors: list[tuple[float, ...]],
    configurations: int,
    repeats: int,
    output: Path,
    name: str,
    figures: Path | None,
    look: FigureOptions,
    *,
    json: bool,
) -> None:
    from tvist_lab.identification.identify import MeasurementPlan
    from tvist_lab.identification.identify import identify as run

    plan = MeasurementPlan(
        configurations=configurations, anchors=tuple(anchors), repeats=repeats, seed=place.seed
    )
    command = f"tvist identify --configurations {configurations} --repeats {repeats} --seed {place.seed}"
    command += place.options if place.mass is None else f"{place.options} --payload {place.mass:g}"
    doing = partial(run, plan=plan, name=name, command=command)
    done: Identification = place.calibrate(configurations + len(anchors), doing, output)
    if figures is not None:
        from tvist_lab.figures import identified_figure

        with look.into(figures) as save:
            identification = identified_figure(
                done.calibration, done.q, done.f_d, done.zeta, done.true_f_d, done.true_zeta
            )
            maps = (
                _maps(arm, done.calibration, done.calibration.payload.mass) if place.endpoint is None else {}
            )
            write(save, {"identification": identification, **maps})
    found, own = done.calibration.payload.mass, arm.payload.mass
    options = place.options if found == own else f"{place.options} --payload {found:g}"
    report_polynomial(done, output, options, json=json)


def _modal(
    place: _Place,
    arm: "RobotDescription",
    ring_downs: int,
    masses: str | None,
    output: Path,
    name: str,
    figures: Path | None,
    look: FigureOptions,
    *,
    json: bool,
) -> None:
    from tvist_controller.setup import paper_payload
    from tvist_lab.identification.modal import identify_modal
    from tvist_lab.identification.modal_plan import ModalPlan, jog_of

    carried = () if masses is None else tuple(paper_payload(arm, mass) for mass in _masses(masses))
    plan = ModalPlan(ring_downs=ring_downs, payloads=carried, seed=place.seed, jog=jog_of(arm))
    command = f"tvist identify --model modal --ring-downs {ring_downs} --seed {place.seed}"
    command += place.options
    if masses is not None:
        command += f" --payloads {masses}"
    elif place.mass is not None:
        command += f" --payload {place.mass:g}"
    doing = partial(identify_modal, description=arm, plan=plan, name=name, command=command)
    done: ModalIdentification = place.calibrate(ring_downs, doing, output)
    if figures is not None:
        mass = arm.payload.mass if place.mass is None else place.mass
        with look.into(figures) as save:
            write(save, _maps(arm, done.calibration, mass))
    report_modal(done, output, place.options, json=json)


def _maps(arm: "RobotDescription", calibration: "Calibration", mass: float) -> "dict[str, Figure]":
    """Draw the lowest mode over the workspace, identified and true, with a payload of this mass [kg]."""
    from tvist_lab.figures import workspace_map_figure
    from tvist_lab.identification.workspace_map import QUANTITIES, workspace_map

    found = workspace_map(arm, calibration, mass)
    if found is None:
        return {}
    words = f"{arm.robot.name}, {mass:g} kg, calibration {calibration.name}"
    return {f"map_{name}": workspace_map_figure(found, key, words) for key, name in QUANTITIES.items()}


def _from_logs(
    files: list[Path],
    robot: str | None,
    mass: float | None,
    columns: str | None,
    output: Path,
    name: str,
    *,
    json: bool,
) -> None:
    arm, logs = robot_logs(files, robot, mass, columns)
    from tvist_lab.identification.from_logs import identify_from_logs
    from tvist_lab.recordings import RecordingError
    from tvist_protocol.calibration import calibration_to_json

    with told(RecordingError, OSError), waiting("identifying") as step:
        done = identify_from_logs(arm, logs, name=name, command=typed()[:500], progress=step)
        output.write_bytes(calibration_to_json(done.calibration))
    named = arm.robot.name
    report_from_logs(done, output, "" if named == ROBOT else f" --robot {robot or named}", json=json)


def _payload(place: _Place, arm: "RobotDescription", poses: int, *, declare: bool, json: bool) -> None:
    from tvist_lab.identification.payload import identify_payload

    with told(OSError), progress(poses + 1, "poses") as bar:

        async def run(client: "Robot", control: "Arm") -> "PayloadFound":
            found = await identify_payload(
                client, control, arm, poses=poses, seed=place.seed, progress=lambda: bar(1, None)
            )
            if declare:
                new = found.payload
                await control.set_payload(new.mass, new.com, new.inertia)
            return found

        found = place.run(run)
    report_payload(found, declared=declare, json=json)


def _endpoint_and_mass(endpoint: str | None, payload: list[str] | None) -> tuple[str | None, float | None]:
    """Separate mass and endpoint: --payload may have no value and then takes the endpoint that follows it."""
    mass = None
    for word in payload or []:
        try:
            given, mass = mass, float(word)
            if given is not None:
                raise Failure(f"payload is {given:g} and {mass:g}: give one mass", code=2)
        except ValueError:
            if endpoint is not None or "/" not in word:
                raise Failure(f"payload is {word!r}: must be a mass in kg, or nothing", code=2) from None
            endpoint = word
    return endpoint, mass


def _masses(text: str) -> tuple[float, ...]:
    try:
        masses = tuple(float(part) for part in text.split(","))
    except ValueError:
        masses = ()
    if not masses or not all(0.0 <= mass <= 100.0 for mass in masses) or len(set(masses)) < len(masses):
        raise Failure(
            f"payloads is {text!r}: must be different masses from 0 to 100 kg, separated by commas", code=2
        )
    return masses


def _pose(text: str, poses: Mapping[str, tuple[float, ...]], joints: int) -> tuple[float, ...]:
    angles = pose(text, poses, "at")
    if len(angles) != joints:
        raise Failure(f"at has {len(angles)} angles, {text.strip()}: the arm has {joints} joints", code=2)
    return angles
