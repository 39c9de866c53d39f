"""Options of `tvist serve`: the fields of its configuration. config.py has what is made of them, and imports more."""

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
    this one. Read docs/how-to/use-a-real-arm.md first: you answer for what moves."""
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
    adapt: Literal["payload"] | None = None
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
