"""Options of `tvist serve`: the fields of its configuration. config.py evaluates them, with more imports."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from tvist_protocol.info import Clock
from tvist_protocol.values import Namespace, RobotName, Seed
from tvist_server.ur_ports import UrPorts

DEFAULT_NAME = "ur5e"
ProfileName = Literal["ursim", "real"]


class ServeOptions(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of `tvist serve` and keys of its configuration file; the docstrings are the help, with [default]."""

    name: RobotName = DEFAULT_NAME
    """Name of the robot on the network."""
    robot: str = "ur5e"
    """Name of a robot that comes with the package, or path of a robot file."""
    robots: str | None = None
    """Serve several robots, as `ROBOT[*COUNT]` separated by commas: `ur5e*2,other.toml` serves ur5e-1, ur5e-2 and
    other. Replaces --name and --robot."""
    workers: Annotated[int, Meta(ge=1, le=256)] = 1
    """Number of processes to spread the robots over, behind the same endpoint; each needs a core. If one dies, all
    end with exit code 1."""
    listen: tuple[str, ...] | None = None
    """Zenoh endpoint to listen on, repeatable [tcp/127.0.0.1:7447; none with --connect]."""
    connect: tuple[str, ...] = ()
    """Endpoint of a router through which clients reach the robot, repeatable: the first that answers is used. If none
    answers within 10 s, the command fails; a router lost later is retried."""
    namespace: Namespace | None = None
    """Words separated by / that precede the robot's keys, such as hall-3, so that robots of the same name can share a
    network. Clients give the same --namespace."""
    metrics: str | None = None
    """Publish figures for Prometheus on ADDRESS:PORT, or on PORT of 127.0.0.1, over unencrypted HTTP."""
    security: str | None = None
    """Folder made by tvist keys. The endpoint is then tls/ADDRESS:PORT, and clients without a role have no access.
    With --connect, a folder made by tvist keys --member; the router checks clients."""
    insecure: bool = False
    """Accept remote connections without TLS or authentication; anyone can move the robot."""
    cell: str | None = None
    """TOML file with the robot's surroundings: wires, tools, a gripper, parts. Its first tool is carried, and
    declared unless you give --payload. Programs can use the gripper, and with --ur clients can too, on port 63352."""
    profile: ProfileName | None = None
    """Set of defaults. ursim behaves like UR's simulator: a UR arm starts in URSim's posture, with a payload of 0 kg,
    shaper none, --quiet, --no-floor and --compensate-sag. real starts in the same posture but behaves like a robot:
    the robot file's payload, noise, a floor, sag and shaper zv. Options that you give take precedence [ursim with
    --ur and for tvist run; otherwise the defaults of each option]."""
    payload: Annotated[float, Meta(ge=0, le=100)] | None = None
    """Mass of the disc on the flange in kg, both carried and declared to the controller [that of the robot file, 5
    for the ur5e; with the profile ursim 0, or 1 with --world]."""
    overload: bool = False
    """Start even if the payload exceeds the robot's rating. The drives may not hold it; the robot then makes a
    protective stop."""
    shaper: str | None = None
    """Name of a shaper that tvist shapers lists, such as none, zv, auto or elastic; or FILE.py:NAME, which runs that
    file and adds your own shaper to those that clients can choose [zv; none with the profile ursim]."""
    shape_servo: bool = False
    """Also shape servoj, speedj and speedl of programs that start at rest. Otherwise they bypass the shaper, because
    their client usually closes a loop, to which the shaper would add delay."""
    plant: str | None = None
    """The arm to move [the simulated flexible arm of the robot file]: that arm with a property unknown to its
    controller, such as stribeck, hysteresis, torsion, base, backlash, combined, springs-30 or springs+30;
    FILE.py:NAME, which runs that file; or an installed plant, such as mujoco. NAME takes a RobotDescription and a
    Payload, and returns a plant. ur://ADDRESS[:PORT] only watches a real UR robot through its RTDE interface: its
    state is published, and nothing moves it without --enable-motion."""
    enable_motion: bool = False
    """Move the robot at ur://ADDRESS, which must be in remote control: a program on its controller follows the
    set-points of this server. First read docs/how-to/use-a-real-arm.md: you are responsible for what moves."""
    speed_cap: Annotated[float, Meta(ge=0.05, le=3.2)] | None = None
    """With --enable-motion: largest speed of every joint in rad/s, for moves, streams and programs; the limits of the
    robot file and of the robot itself also apply [0.5]."""
    tcp: str | tuple[float, ...] | None = None
    """With --enable-motion: tool centre point that the robot must have, x,y,z in m and rotation vector rx,ry,rz in
    rad in the flange frame; any other is refused [any: the robot's own is used]."""
    servo_lag: str | tuple[float, ...] | None = None
    """With --enable-motion: lag of the robot's servoj to compensate: T,k in s and 1/s², as found by tvist identify,
    or simulated for a robot of tvist serve --ur [the calibration's, if it has one]."""
    world: str | None = None
    """Scene around the arm, which the arm can touch: table, wall, peg, pallet, or a file in MuJoCo's format, in the
    frame of the arm's base. MuJoCo then simulates the arm, with a force sensor in its flange. Needs the extra world
    [nothing to touch; the cell's scene, if it names one]."""
    hidden: Seed | None = None
    """Simulate an arm that deviates from its file: springs, dampers, loops, rotors, friction and payload are drawn
    from this seed and not published. With several robots, each further one uses the next seed."""
    adapt: Literal["payload"] | None = None
    """payload: identify the carried payload from the torques after each motion, and use it instead of the declared
    one; tvist forget undoes this [nothing]."""
    calibration: str | None = None
    """Name of a calibration that comes with the package, or path of a calibration file; none for a robot that is not
    identified yet [the package's calibration for this robot]."""
    clock: Clock = "realtime"
    """realtime, or lockstep, in which a client steps the simulation."""
    speed: Annotated[float, Meta(gt=0, le=100)] = 1.0
    """Simulation speed relative to real time."""
    realtime_priority: bool = False
    """Run the control loop with real-time priority (SCHED_FIFO), if the system permits it."""
    start: str | tuple[float, ...] | None = None
    """Pose to start in: a name from the robot file, such as Q1, Q2 or Q3, or joint angles in rad separated by commas
    [Q1; URSim's posture with a profile]."""
    state: str | None = None
    """TOML or JSON file with the state to start in: any of q, payload (the carried one), mode, shaper, seed."""
    seed: Seed = 0
    """Seed of sensor noise and gear errors; with several robots, each further one uses the next seed."""
    record: str | None = None
    """MCAP file to record into. It must not exist, unless you give --keep. With several robots, each records into its
    own file, FILE-NAME.mcap."""
    keep: str | None = None
    """Keep only the last 90s, 10min or 2h of the recording, and at most a quarter more [everything]. It then consists
    of complete files, FILE-1-part0001.mcap, FILE-1-part0002.mcap and so on, and FILE-2-part0001.mcap and so on after
    the next start; those of the five latest earlier runs are kept."""
    dump: str | None = None
    """Folder for a recording of the last second before the simulated arm fails [the system's temporary folder]."""
    truth: bool = False
    """Always publish what a real robot cannot measure, such as the arm's deflection, on tvist/NAME/truth and in the
    recording."""
    quiet: bool | None = None
    """Simulate sensors without noise and angles with an encoder's resolution, for clients that wait until values stop
    changing [off]."""
    floor: bool | None = None
    """Refuse motions that bring the arm or its payload to the floor of the robot file [on]."""
    compensate_sag: bool | None = None
    """Let the drives lead by the angle that gravity twists the gears, so that the measured joint angles at rest are
    the target angles [off]."""
    programs: str | None = None
    """Folder with URScript programs, NAME.script or NAME.urp, that clients load by name. With several robots, a robot
    uses the subfolder of its name, if there is one."""
    ros2: bool = False
    """Also start tvist ros2, and be the router of ROS 2 nodes with rmw_zenoh, as rmw_zenohd is. Every ROS 2 node that
    reaches the endpoint can move the robot. Several robots have the namespaces of their names."""
    ur: bool = False
    """Also open UR's own interfaces: RTDE, real-time client, dashboard, primary and secondary, interpreter mode. The
    profile is then ursim, unless you give another one or --enable-motion."""
    ur_address: str = "127.0.0.1"
    """IP address on which UR's interfaces listen; each further robot uses the next address."""
    ur_ports: UrPorts = UrPorts()
    """Change the port of a UR interface, repeatable: rtde=31004, or dashboard=off to close it. The others are
    primary, secondary, realtime, interpreter, primary_read_only, secondary_read_only and realtime_read_only, and for
    a cell gripper."""
    ur_allow: tuple[str, ...] = ()
    """Let programs open sockets to this machine too, repeatable: an IP address, a network such as 192.168.1.0/24, or
    a name as programs write it [only the machine that sent the program]."""
    reserve_inputs: tuple[str, ...] = ()
    """Answer IN_USE to RTDE clients that request this input, repeatable, as a robot does while a fieldbus holds it:
    speed_slider_mask, for example, or a pattern such as 'input_int_register_*'."""
