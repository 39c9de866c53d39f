"""Whatever numbers a program has, and whatever fails, it ends alone."""

import resource
from pathlib import Path

import numpy as np
import pytest

from tvist_controller.host import Host
from tvist_controller.kinematics.arm import Arm
from tvist_controller.paths.poses import placement_vector
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.codec import encode
from tvist_protocol.programs import ProgramRun, ProgramStop
from tvist_protocol.replies import Done

from .hostile import odd
from .robots import UR5E, Kept
from .scripts import URSIM, a_robot, failure, playing, run, start
from .test_hostile_programs import MOST, spending


@pytest.fixture
def little_memory():
    """Let what takes more than a gigabyte fail."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30), before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seeds", [range(100), pytest.param(range(100, 3100), marks=pytest.mark.nightly)])
def test_a_random_program_with_odd_numbers_ends_alone(seeds, little_memory, monkeypatch):
    """Nothing is raised out of a tick, or by a function that does not blame its arguments."""
    spent = spending(monkeypatch)
    for seed in seeds:
        robot = a_robot()
        robot.send(ProgramRun, text=odd(seed))
        for _ in range(600):
            spent[0] = 0
            robot.tick()
            assert spent[0] <= MOST
            if not playing(robot):
                break
        robot.send(ProgramStop)
        robot.until_rest(6000)


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("movel(p[1e8, 0, 0, 0, 0, 0])", "pose[0] is 1e+08: it must be from -1000 to 1000"),
        ("movec(get_target_tcp_pose(), p[0, -1e8, 0, 0, 0, 0])", "pose_to[1] is -1e+08"),
        ("set_tcp(p[1e160, 0, 0, 0, 0, 0])", "tcp[0] is 1e+160: it must be from -10 to 10"),
        ("set_payload(1e300)", "m is 1e+300: it must be from 0 to 100"),
        ("set_target_payload(1, [0, 0, 3])", "cog[2] is 3: it must be from -2 to 2"),
        ("x = get_forward_kin([0,0,0,0,0,0], p[0, 1e160, 0, 0, 0, 0])", "tcp[1] is 1e+160"),
    ],
)
def test_what_a_message_could_not_hold_is_an_exception_of_the_program(line, why):
    assert failure(run(a_robot(), line)).why.startswith(why)


@pytest.mark.parametrize("far", [1.0, 100.0])
def test_a_path_out_of_reach_takes_no_memory_however_long_it_is(far, little_memory):
    """The circle through three points that are nearly on a line is as large as the earth."""
    x, y, z, *turn = placement_vector(*Arm(UR5E).pose(np.array(URSIM)))
    via, pose = (x + 2 * far, y + 3e-6 * far, z, *turn), (x + far, y, z, *turn)
    assert a_robot().send(m.MoveC, via=via, pose=pose).code in {"no_solution", "singular"}


class Heard(Kept):
    """What a robot says."""

    def __init__(self):
        super().__init__()
        self.errors = []
        self.raised = self.errors.append


def fails(*_):
    raise ArithmeticError("on purpose")


def test_a_plan_that_fails_ends_its_program_which_names_the_line_and_is_logged(monkeypatch):
    robot, heard = a_robot(), Heard()
    monkeypatch.setattr(robot.controller.plans, "_order", lambda *_: fails)
    start(robot, "sync()", "movel(p[0.1, -0.4, 0.3, 2, 2, 0])")
    host = Host(robot.controller, heard, survives=True)
    while playing(robot):
        host.tick()
    (warning,) = [event for event in heard.events if event.kind == "warning"]
    assert (warning.line, warning.why) == (3, "an argument does not fit: on purpose")
    assert len(heard.errors) == 1


@pytest.mark.parametrize(("part", "name"), [("motion", "step"), ("programs", "advance"), ("motion", "stop")])
def test_what_fails_stops_the_robot_which_goes_on_when_it_is_unlocked(part, name, monkeypatch):
    robot, heard = a_robot(), Heard()
    host, owner = Host(robot.controller, heard, survives=True), getattr(robot.controller, part)
    start(robot, "sleep(1)")
    with monkeypatch.context() as failing:
        failing.setattr(owner, name, lambda *_: (failing.undo(), fails()))
        if name == "stop":
            assert host.request(encode(c.Stop())).code == "plant_failure"
        host.tick()
    assert [event.code for event in heard.events if event.kind == "protective_stop"] == ["plant_failure"]
    assert len(heard.errors) == 1
    assert host.request(encode(c.UnlockProtectiveStop(token=robot.token))) == Done()
    host.tick()
    assert host.controller.motion.activity.robot_mode.name == "RUNNING"
