"""A UR5e in a world that goes down on a surface, shaped or not: what the surface and the tool then do."""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from msgspec import structs
from scipy.spatial.transform import Rotation

from proof.bridge.in_lockstep import control, setup_of
from tvist_controller.api.line import body
from tvist_controller.api.robot import Controller, truth_of
from tvist_lab.metrics.agreed_modes import agreed_modes
from tvist_lab.metrics.vibration import amplitude
from tvist_lab.recordings import Floats
from tvist_plant.description import load
from tvist_plant.plant import GRAVITY, PERIOD
from tvist_plant.world.scene_file import find_scene
from tvist_plant.world.world_arm import WorldArm
from tvist_protocol.programs import ProgramRun
from tvist_protocol.replies import Refused
from tvist_protocol.values import Payload

ABOVE = (-2.7, -2.3, -1.2, -1.2124, 1.5708, 0.0)
"""Posture above the surface, with the tool down [rad]."""
CARRIED = Payload(mass=3.0, com=(0.0, 0.0, 0.05), inertia=(4e-3, 0.0, 0.0, 4e-3, 0.0, 2e-3))
LENGTH, RADIUS, HEIGHT = 0.12, 0.02, 0.12
"""Length of the tool, radius of its end, and height of its end over the surface at first [m]."""
DEEP = {1e4: 2.5e-3, 1e5: 8e-4}
"""How far below a surface of some stiffness [N/m] a move ends, about 20 N [m]."""
WITHIN = 2.0
"""Force within which of its last value a surface counts as settled [N]."""
LATER = 0.01
"""Time after a stop from which on the tool's acceleration counts as ring [s]."""
HEAD = """def landing():
  set_tcp(p[0, 0, {length}, 0, 0, 0])
  zero_ftsensor()
  begin = get_target_tcp_pose()
  def below(way):
    return p[begin[0], begin[1], begin[2] - way, begin[3], begin[4], begin[5]]
  end"""
PROGRAMS = {
    "moves": """
  movel(below({near}), a=3, v=0.5)
  textmsg("near")
  sleep(1)
  textmsg("up")
  movel(begin, a=1.2, v=0.25)
  sleep(1)
  textmsg("land")
  movel(below({first}), a=3, v=0.5)
  textmsg("down")
  sleep(1.5)
  textmsg("press")
  movel(below({second}), a=3, v=0.5)
  textmsg("pressed")
  sleep(1.5)""",
    "guarded": """
  textmsg("land")
  while tool_contact(direction=[0, 0, -1, 0, 0, 0]) == 0:
    speedl([0, 0, -0.05, 0, 0, 0], 3, get_steptime())
  end
  textmsg("felt")
  stopl(3)
  textmsg("down")
  sleep(1.5)""",
    "force": """
  movel(below({close}), a=3, v=0.5)
  textmsg("land")
  force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,-20,0,0,0], 2, [0.02,0.02,0.05,0.3,0.3,0.3])
  textmsg("down")
  sleep(2.5)
  end_force_mode()""",
}


@dataclass(frozen=True)
class Landing:
    """What was measured at every tick of a program."""

    force: Floats
    """Force of the surface on the tool, shape (T,) [N]."""
    alpha: Floats
    """Acceleration of the flange without gravity, in its frame, shape (T, 3) [m/s²]."""
    height: Floats
    """Height of the tool's end over the surface, shape (T,) [m]."""
    marks: dict[str, int]
    """Ticks at which the program said where it was."""

    def touch(self) -> int:
        """Tick in which the tool first touches the surface on its way down."""
        return self.marks["land"] + int(np.flatnonzero(self.force[self.marks["land"] :] > 0.0)[0])

    def impact(self) -> dict[str, float]:
        """Return how the tool meets the surface, and how the force goes on until the program presses further."""
        touch, land = self.touch(), self.marks["land"]
        force = self.force[touch : self.marks.get("press")]
        last = float(force[-100:].mean())
        beyond = np.flatnonzero(np.abs(force - last) > WITHIN)
        return {
            "meets_at": float(self.height[touch - 1] - self.height[touch]) / PERIOD,
            "peak": float(force.max()),
            "bounces": int(((force[:-1] > 0.0) & (force[1:] == 0.0)).sum()),
            "settled_ms": 1e3 * PERIOD * (touch - land + (0 if beyond.size == 0 else int(beyond[-1]) + 1)),
            "last": last,
        }

    def ring(self, first: str, last: str | None) -> tuple[float, float | None]:
        """Return the largest acceleration after a stop [m/s²], and the frequency of its ring if it has one [Hz]."""
        alpha = self.alpha[self.marks[first] : None if last is None else self.marks[last]]
        found = agreed_modes(
            alpha, np.linspace(0.0, PERIOD * (len(alpha) - 1), len(alpha)), PERIOD, 2.0 * LATER
        )
        return float(amplitude(alpha)[round(LATER / PERIOD) :].max()), found.f_d if found.ok else None


def landed(robot: str, program: str, stiffness: float, shaper: str, seed: int) -> Landing:
    """Let a robot with a force sensor without noise run one of `PROGRAMS` on a surface of some stiffness [N/m].

    Raises:
        RuntimeError: The program did not run to its end.
    """
    description = load(robot).without_floor()
    silent = structs.replace(description.sensors, force_noise=0.0, torque_noise=0.0)
    description = structs.replace(description, sensors=silent)
    setup = replace(setup_of(description, np.array(ABOVE), CARRIED, shaper, seed), shape_servo=True)
    plain = Controller(setup).latest.actual_TCP_pose
    x, y, z = plain[0], plain[1], plain[2] - LENGTH - HEIGHT
    scene = (
        f'<mujoco><worldbody><body name="tool"><geom type="sphere" size="{RADIUS}" pos="0 0 {LENGTH - RADIUS}"/></body>'
        f'<geom type="box" size="0.1 0.1 0.05" pos="{x} {y} {z - 0.05}" solref="-{stiffness} '
        f'-{0.6 * np.sqrt(stiffness * 3.0)}" friction="0.3"/></worldbody></mujoco>'
    )
    with TemporaryDirectory() as folder:
        file = Path(folder) / "surface.xml"
        file.write_text(scene)
        arm = WorldArm(description, body(CARRIED), find_scene(str(file)))
    controller = Controller(setup, arm)
    token = control(controller)
    deep = DEEP[stiffness]
    ways = {
        "near": HEIGHT - 0.02,
        "close": HEIGHT - 0.002,
        "first": HEIGHT + deep,
        "second": HEIGHT + 2.0 * deep,
    }
    text = HEAD.format(length=LENGTH) + PROGRAMS[program].format(**ways) + "\nend\n"
    reply = controller.receive(ProgramRun(token=token, text=text))
    if isinstance(reply, Refused):
        raise RuntimeError(reply.why)  # noqa: TRY004  it is an answer of the robot
    rows, marks = list[tuple[float, ...]](), dict[str, int]()
    while not rows or controller.programs.state == "PLAYING":
        _, events = controller.tick()
        for event in events:
            if event.kind == "text":
                marks[event.why or ""] = len(rows)
            elif event.kind == "protective_stop" or (event.kind == "warning" and event.line is not None):
                raise RuntimeError(f"{program} with {shaper} at {stiffness:g} N/m: {event.why}")
        truth = truth_of(arm)
        up = Rotation.from_matrix(truth.flange_rotation).inv().apply([0.0, 0.0, GRAVITY])
        place = truth.flange_position[2] + truth.flange_rotation[2, 2] * LENGTH
        rows.append((arm.contact()[2], *(truth.specific_force - up), place - z))
    table = np.array(rows)
    return Landing(table[:, 0], table[:, 1:4], table[:, 4], marks)
