"""Configuration of `tvist serve`, from the command line or a TOML file."""

import dataclasses
import ipaddress
import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, TypeVar

from msgspec import Meta, Struct
from msgspec.structs import replace

from tvist_controller.cell.description import Cell, as_declared
from tvist_controller.setup import Adapt, Setup, check_rating, paper_payload
from tvist_controller.sources.own_plants import OwnPlant, load_plant, load_world
from tvist_plant import user_file
from tvist_plant.description import RobotDescription, load
from tvist_protocol.calibration import Calibration
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Clock
from tvist_protocol.values import Namespace, Payload, RobotName, Seed
from tvist_server.allowed_hosts import AllowedHosts
from tvist_server.moving.moved_robot import MovedRobot
from tvist_server.moving.servo_lag import ServoLag
from tvist_server.option_values import (
    MOST,
    StartError,
    members,
    numbers_of,
    posture,
    read_start_file,
    ticks_of,
)
from tvist_server.profiles import PLAIN, PROFILES, Profile, ProfileName
from tvist_server.program_folder import ProgramFolder
from tvist_server.start_files import InitialState, calibration_for, read_cell, shaped_by
from tvist_server.ur_ports import InterfaceName, UrPorts
from tvist_server.watching.place import is_place, place_of
from tvist_server.watching.watched_robot import WatchedRobot

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_NAME = "ur5e"
SPEED_CAP = 0.5
"""Largest speed of a robot that is moved, unless another is given [rad/s]."""
TOOL_IN_WORLD = 1.0
"""Mass on the flange in a scene if the profile has none: its sensor does not feel what the wrist touches [kg]."""
_REAL = ("enable_motion", "speed_cap", "tcp", "servo_lag")
MOST_LAG, LEAST_GAIN = 0.15, 50.0
"""Largest time and smallest gain of a `servoj` that can be compensated [s, 1/s²]."""
_INSTEAD = {
    "name": "leave name out, since several robots are named after their files",
    "robot": "add it to the list of robots",
}
"""What to do with a key that excludes `robots`."""
T = TypeVar("T")


class ServeConfig(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of `tvist serve` and keys of its configuration file; their docstrings are the help of the command line.

    A default that is no plain value stands in brackets.
    """

    name: RobotName = DEFAULT_NAME
    """Name of the robot on the network."""
    robot: str = "ur5e"
    """Name of a robot that comes with the package, or path of a robot file."""
    robots: str | None = None
    """Serve several robots, given as `ROBOT[*COUNT]` separated by commas: `ur5e*2,other.toml` serves ur5e-1, ur5e-2 and
    other. Replaces --name and --robot."""
    workers: Annotated[int, Meta(ge=1, le=256)] = 1
    """Number of processes that the robots are spread over, behind the same endpoint; each further one uses one more
    core. If one dies, all end, with exit code 1."""
    listen: tuple[str, ...] | None = None
    """Zenoh endpoint to listen on, repeatable [tcp/127.0.0.1:7447; none if the robot connects to a router]."""
    connect: tuple[str, ...] = ()
    """Endpoint of a router through which clients reach the robot, repeatable: the robot uses the first that answers. If
    none does within 10 s, the command fails; a router that is lost later is looked for again."""
    namespace: Namespace | None = None
    """Words separated by / that precede the robot's keys, such as hall-3, so that robots of one name can share a
    network. Clients give the same --namespace."""
    metrics: str | None = None
    """ADDRESS:PORT to publish figures for Prometheus on, over HTTP without encryption, or PORT of 127.0.0.1."""
    security: str | None = None
    """Folder made by tvist keys. The endpoint is then tls/ADDRESS:PORT, and clients without a role have no access. With
    --connect, the folder of a robot, made by tvist keys --member; the router checks clients."""
    insecure: bool = False
    """Accept remote connections without TLS and do not authenticate clients; anyone can move the robot."""
    cell: str | None = None
    """TOML file with what stands around the robot: wires, tools, a gripper, parts. Its first tool is carried, and
    declared unless --payload says otherwise. Programs reach the gripper; with --ur clients do, too, on port 63352."""
    profile: ProfileName | None = None
    """Set of defaults. ursim is like UR's simulator: it starts an arm of UR's kind in URSim's posture, with a payload
    of 0 kg, shaper none, --quiet, --no-floor and --compensate-sag. real starts in the same posture and is otherwise
    like a robot: it has the robot file's payload, noise, a floor, sag and shaper zv. Options that you give take
    precedence [ursim with --ur and for tvist run; without it, the defaults named at each option]."""
    payload: Annotated[float, Meta(ge=0, le=100)] | None = None
    """Mass of the disc on the flange in kg, both carried and declared to the controller [that of the robot file, 5 for
    the ur5e; with the profile ursim 0, or 1 with --world]."""
    overload: bool = False
    """Start even if the payload exceeds the robot's rating. The drives may not hold it; the robot then makes a
    protective stop."""
    shaper: str | None = None
    """Any name that tvist shapers lists, such as none, zv, auto or elastic; or FILE.py:NAME, which runs that file and
    adds your own shaper to those that clients can choose [zv; none with the profile ursim]."""
    shape_servo: bool = False
    """Shape servoj, speedj and speedl of programs too, where they begin at rest. Without this option they bypass the
    shaper, since their client usually closes a loop, to which the shaper would add its delay."""
    plant: str | None = None
    """The arm to move [the simulated flexible arm of the robot file]: that arm with something that its controller does
    not know, such as stribeck, hysteresis, torsion, base, backlash, combined, springs-30 or springs+30; FILE.py:NAME,
    which runs that file; or an installed plant, such as mujoco. NAME takes a RobotDescription and a Payload, and makes
    a plant. ur://ADDRESS[:PORT] only watches a robot of UR's through its RTDE interface: its state becomes ours, and
    nothing moves it from here without --enable-motion."""
    enable_motion: bool = False
    """Move the robot at ur://ADDRESS, which is in remote control: a program on its controller follows the set-points of
    this one. Read docs/how-to/use-a-real-arm.md before: whoever gives this option answers for what moves."""
    speed_cap: Annotated[float, Meta(ge=0.05, le=3.2)] | None = None
    """With --enable-motion: largest speed of every joint in rad/s, for moves, streams and programs alike; the limits of
    the robot file and of the robot itself hold as well [0.5]."""
    tcp: str | tuple[float, ...] | None = None
    """With --enable-motion: tool centre point that the robot has to have, x,y,z in m and rotation vector rx,ry,rz in
    rad in the flange frame; another one is refused [any: the robot's is taken over]."""
    servo_lag: str | tuple[float, ...] | None = None
    """With --enable-motion: lag of the robot's servoj, which set-points then make up for: T,k in s and 1/s², as
    tvist identify finds it, or simulated for a robot of tvist serve --ur [the calibration's, if it has one]."""
    world: str | None = None
    """Scene in which the arm stands, and whose things it touches: table, wall, peg, pallet, or a file in MuJoCo's
    format, in the frame of the arm's base. The arm is then simulated by MuJoCo, and has a force sensor in its flange.
    Needs the extra world [nothing to touch; that of the cell, if it names one]."""
    hidden: Seed | None = None
    """Simulate an arm that is not quite its file: springs, dampers, loops, rotors, friction and payload are drawn from
    this seed and told to nobody. With several robots, each further one uses the next."""
    adapt: Adapt | None = None
    """payload: after each motion the robot finds from its torques what it carries, and moves as an arm that carries it,
    instead of what is declared; tvist forget undoes that [nothing]."""
    calibration: str | None = None
    """Name of a calibration that comes with the package, or path of a calibration file; none for a robot that is yet to
    be identified [the one that comes with the package for this robot]."""
    clock: Clock = "realtime"
    """realtime, or lockstep, in which a client steps the simulation."""
    speed: Annotated[float, Meta(gt=0, le=100)] = 1.0
    """Simulation speed relative to real time."""
    realtime_priority: bool = False
    """Run the control loop with real-time priority (SCHED_FIFO), if the system permits it."""
    start: str | tuple[float, ...] | None = None
    """Pose to start in: a name from the robot file, such as Q1, Q2 or Q3, or joint angles in rad separated by commas
    [Q1; the posture of URSim with a profile]."""
    state: str | None = None
    """TOML or JSON file with the state to start in: any of q, payload (the carried one), mode, shaper, seed."""
    seed: Seed = 0
    """Seed of sensor noise and gear errors; with several robots, each further one uses the next."""
    record: str | None = None
    """MCAP file to record into. It must not exist, unless --keep is given. With several robots, each records into a
    file of its own, FILE-NAME.mcap."""
    keep: str | None = None
    """Let the recording keep the last 90s, 10min or 2h, and at most a quarter more, and forget what was before [it
    keeps all]. It then consists of complete files, FILE-1-part0001.mcap, FILE-1-part0002.mcap and so on, at the next
    start FILE-2-part0001.mcap and so on; those of the five latest runs before stay."""
    dump: str | None = None
    """Folder to save the last second before a failure of the simulated arm to [the system's temporary folder]."""
    truth: bool = False
    """Always publish what a real robot cannot measure, such as the arm's deflection, on tvist/NAME/truth and in the
    recording."""
    quiet: bool | None = None
    """Simulate sensors without noise and angles with an encoder's resolution, for clients that wait until values stop
    changing [off]."""
    floor: bool | None = None
    """Refuse motions that bring the arm or its payload to the floor of the robot file [on]."""
    compensate_sag: bool | None = None
    """Let the drives lead by the angle that gravity twists the gears, so that the measured joint angles at rest are the
    target angles [off]."""
    programs: str | None = None
    """Folder with programs in URScript, NAME.script or NAME.urp, that clients load by their names. With several robots,
    a robot uses the folder of its name in it, if there is one."""
    ur: bool = False
    """Open UR's own interfaces as well: RTDE, real-time client, dashboard, primary and secondary, interpreter mode. The
    profile is then ursim, if you give no other, and no --enable-motion."""
    ur_address: str = "127.0.0.1"
    """IP address on which UR's interfaces listen; each further robot uses the next address."""
    ur_ports: UrPorts = UrPorts()
    """Change the port of one UR interface, repeatable: rtde=31004, or dashboard=off to close it. The others are
    primary, secondary, realtime, interpreter, primary_read_only, secondary_read_only and realtime_read_only, and for
    a cell gripper."""
    ur_allow: tuple[str, ...] = ()
    """Let programs open sockets to this machine too, repeatable: an IP address, a network such as 192.168.1.0/24, or a
    name as programs write it [only the machine that sent the program]."""
    reserve_inputs: tuple[str, ...] = ()
    """Answer IN_USE to clients of RTDE that ask for this input, repeatable, as a robot does while a fieldbus holds it:
    speed_slider_mask, for example, or a pattern such as 'input_int_register_*'."""

    def setups(self) -> list[Setup]:
        """Return the initial setup of every robot's controller.

        Raises:
            StartError: See `setup`.
            UserFileError: See `setup`.
        """
        if self.robots is None:
            return [self.setup()]
        found = members(self.robots, MOST * self.workers)
        # Each robot starts as it would alone, apart from the noise.
        starts: dict[str, Setup] = {}
        for member in found:
            if member.robot not in starts:
                starts[member.robot] = replace(self, robot=member.robot).setup()
        return [
            dataclasses.replace(
                starts[member.robot],
                name=member.name,
                seed=self.seed + index,
                hidden=None if self.hidden is None else self.hidden + index,
            )
            for index, member in enumerate(found)
        ]

    def program_folder(self, name: str) -> ProgramFolder | None:
        """Return the folder with a robot's programs; None if there is none.

        Raises:
            StartError: `programs` is not a folder.
        """
        if self.programs is None:
            return None
        if not Path(self.programs).is_dir():
            raise StartError(f"programs is {self.programs!r}: must be a folder that exists")
        return ProgramFolder.of(Path(self.programs), name)

    def dump_folder(self) -> Path:
        """Return the folder for the last second before a failure.

        Raises:
            StartError: `dump` is not a folder, so that this second would be lost.
        """
        if self.dump is None:
            try:
                return Path(tempfile.gettempdir())
            except (
                FileNotFoundError
            ):  # as in a container without any; what is then saved there says that it is lost
                return Path.cwd()
        if not Path(self.dump).is_dir():
            raise StartError(f"dump is {self.dump!r}: must be a folder that exists")
        return Path(self.dump)

    def keep_ticks(self) -> int | None:
        """Return the number of ticks that a recording keeps at least; None if it keeps all.

        Raises:
            StartError: `keep` is no duration, or nothing is recorded.
        """
        if self.keep is None:
            return None
        if self.record is None:
            raise StartError(f"keep is {self.keep}, but nothing is recorded: give record, too")
        return ticks_of(self.keep, "keep")

    def allowed_hosts(self) -> AllowedHosts:
        """Return the machines that programs may connect to."""
        return AllowedHosts(self.ur_allow)

    def interfaces(self, number: int) -> tuple[str, dict[InterfaceName, int]]:
        """Return address and ports of UR's interfaces, and of a gripper, of the robot with this index.

        Raises:
            StartError: `ur_address` is not an IP address, or too few addresses follow it.
        """
        try:
            first = ipaddress.ip_address(self.ur_address)
            address = first + number
        except ValueError as error:
            raise StartError(f"ur_address is {self.ur_address!r}: must be an IP address ({error})") from error
        if number and first.is_unspecified:
            raise StartError(f"ur_address is {self.ur_address}: several robots need one address each")
        ports = self.ur_ports.open()
        if self.cell is not None and self.ur_ports.gripper:
            ports["gripper"] = self.ur_ports.gripper
        return str(address), ports

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Endpoints to listen on: those of `listen`, or the default; none by default if robots connect to a router."""
        return (() if self.connect else (DEFAULT_ENDPOINT,)) if self.listen is None else self.listen

    @property
    def place(self) -> str:
        """The place at which clients reach the robots, in words."""
        places = [f"on {', '.join(self.endpoints)}"] if self.endpoints else []
        places += [f"through the router at {', '.join(self.connect)}"] if self.connect else []
        return " and ".join(places) + (f" in namespace {self.namespace}" if self.namespace else "")

    def command_line(self, command: str, name: str) -> str:
        """Return the command line that reaches a robot from this machine."""
        words = ["tvist", command]
        first = (*self.endpoints, *self.connect)[0]
        if first != DEFAULT_ENDPOINT:
            here = first.replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")  # noqa: S104  only said
            words.append(here)
        words += ["--name", name] if name != DEFAULT_NAME else []
        words += ["--namespace", self.namespace] if self.namespace else []
        return " ".join([*words, "--security", "FOLDER"] if self.security is not None else words)

    def setup(self) -> Setup:
        """Return the initial setup of one robot's controller.

        Raises:
            StartError: A value contradicts another one, or names something that does not exist.
            UserFileError: A file that is named has the wrong kind of content.
        """
        try:
            chosen, description = self.profile_in_force, load(self.robot)
            if self.ur:
                self.ur_ports.check_joints(description.robot.name, description.joints)
            profile = PLAIN if chosen is None else PROFILES[chosen]
            real = self.plant is not None and is_place(self.plant)
            watched = real and not self.enable_motion
            self._check_real(real=real)
            calibration = calibration_for(self.calibration, description)
            cell = None if self.cell is None else read_cell(self.cell)
            setup = Setup(
                description=self._described(description, profile),
                q=posture(_either(self.start, profile.start(description) or "Q1"), description),
                payload=self._declared(description, profile, cell),
                carried=None if cell is None or not cell.tools else as_declared(cell.tools[0]),
                cell=cell,
                calibration=calibration,
                name=self.name,
                seed=self.seed,
                clock=self.clock,
                truth=self.truth or self._scene(cell) is not None,
                compensate_sag=_either(self.compensate_sag, profile.compensate_sag),
                shape_servo=self.shape_servo,
                adapt=self.adapt,
                plant=self._plant(cell, description, calibration),
                hidden=self.hidden,
            )
            setup = shaped_by(setup, "none" if watched else _either(self.shaper, profile.shaper))
            if self.state is not None:
                setup = read_start_file(self.state, "state", InitialState).on(setup)
            setup.check(placed=not real)
        except user_file.UserFileError:
            raise
        except ValueError as error:
            raise StartError(str(error)) from error
        if not self.overload:
            try:
                check_rating(setup.payload, description)
            except ValueError as error:
                raise StartError(f"{error}: give --overload to insist") from error
        return setup

    def _check_real(self, *, real: bool) -> None:
        """Check that nothing is asked of a robot of UR's that it cannot do, and that what is for one has one.

        Raises:
            ValueError: It is, or has none.
        """
        if not real:
            given = [name for name in _REAL if getattr(self, name)]
            if given:
                raise ValueError(f"{given[0]} is for a robot of UR's: give --plant ur://ADDRESS, too")
            return
        asked: dict[str, object] = {
            "adapt": self.adapt, "cell": self.cell, "state": self.state, "truth": self.truth or None,
            "robots": self.robots,
        }  # fmt: skip
        what = "only knows what its own controller tells"
        if not self.enable_motion:
            asked |= {
                "shaper": self.shaper, "start": self.start, "speed_cap": self.speed_cap,
                "tcp": self.tcp, "servo_lag": self.servo_lag, "shape_servo": self.shape_servo or None,
            }  # fmt: skip
            what = "is only watched"
        for name, value in asked.items():
            if value is not None:
                raise ValueError(f"{name} is {value}, but the robot at {self.plant} {what}: leave {name} out")

    def _plant(
        self, cell: Cell | None, description: RobotDescription, calibration: Calibration | None
    ) -> OwnPlant | None:
        """Find the plant, or the scene in which the arm stands; None for the simulated arm of the robot file.

        Raises:
            ValueError: There is none, or both are given.
            UserFileError: See `load_plant`.
        """
        world = self._scene(cell)
        if world is not None:
            if self.plant is not None or self.hidden is not None:
                other = f"hidden is {self.hidden}" if self.plant is None else f"plant is {self.plant}"
                raise ValueError(
                    f"world is {world}, in which MuJoCo simulates the arm, but {other}: leave one out"
                )
            return load_world(world)
        if self.plant is None or not is_place(self.plant):
            return None if self.plant is None else load_plant(self.plant)
        where = place_of(self.plant)
        if not self.enable_motion:
            return OwnPlant(str(where), "", partial(WatchedRobot, where))
        moved = partial(
            MovedRobot,
            where,
            speed_cap=_either(self.speed_cap, SPEED_CAP),
            tool=None if self.tcp is None else numbers_of("tcp", self.tcp, 6),
            lag=self._lag(calibration),
            start=None if self.start is None else posture(self.start, description),
        )
        return OwnPlant(str(where), "", moved)

    def _scene(self, cell: Cell | None) -> str | None:
        """Scene in which the arm stands: that which is given, or else that of the cell; None for none."""
        return self.world or (None if cell is None else cell.world)

    def _lag(self, calibration: Calibration | None) -> ServoLag | None:
        """Return the lag of a robot that is moved: the one given, or the calibration's.

        Raises:
            ValueError: It is none.
        """
        if self.servo_lag == "simulated":
            return ServoLag.simulated()
        if self.servo_lag is not None:
            time, gain = numbers_of("servo_lag", self.servo_lag, 2)
        elif (
            calibration is not None
            and calibration.servo_lag_s is not None
            and calibration.servo_gain is not None
        ):
            time, gain = calibration.servo_lag_s, calibration.servo_gain
        else:
            return None
        if not (0.0 <= time <= MOST_LAG and gain >= LEAST_GAIN):
            raise ValueError(
                f"servo_lag is {time:g},{gain:g}: must be a time from 0 to {MOST_LAG:g} s and a gain of {LEAST_GAIN:g} "
                "1/s² or more"
            )
        return ServoLag(time, gain)

    @property
    def profile_in_force(self) -> ProfileName | None:
        """Profile that gives the defaults; None for those of a robot without a profile."""
        return self.profile or ("ursim" if self.ur and not self.enable_motion else None)

    def _described(self, description: RobotDescription, profile: Profile) -> RobotDescription:
        """Return the robot with the sensors and the floor that it is to have."""
        if _either(self.quiet, profile.quiet):
            description = description.quiet()
        return description if _either(self.floor, profile.floor) else description.without_floor()

    def _declared(self, description: RobotDescription, profile: Profile, cell: Cell | None) -> Payload:
        """Return the declared payload: the tool of the cell, unless another mass is given."""
        if self.payload is None and cell is not None and cell.tools:
            return as_declared(cell.tools[0])
        mass = _either(self.payload, profile.payload)
        if self.payload is None and mass == 0.0 and self._scene(cell) is not None:
            mass = min(TOOL_IN_WORLD, description.limits.payload)
        return paper_payload(description, mass)


def from_mapping(content: object, source: str) -> ServeConfig:
    """Check a mapping of values and convert it; messages name its source.

    Raises:
        StartError: A key is unknown, a value is out of range, or one key excludes another.
    """
    if isinstance(content, dict) and content.get("robots") is not None:
        for key, instead in _INSTEAD.items():
            if content.get(key) is not None:
                raise StartError(f"{source}: robots and {key} exclude each other: {instead}")
    try:
        return checked(content, ServeConfig)
    except ProtocolError as error:
        raise StartError(f"{source}: {error.why}") from error


def _either(given: T | None, default: T) -> T:
    """Return what is given, or else the default."""
    return default if given is None else given
