"""An arm that stands somewhere, has power, brakes and faults of its own, and cannot be placed."""

import numpy as np
import pytest
from tests.own_arm import STANDS, SWITCHES, OwnArm

from tvist_controller.controller import Controller
from tvist_controller.motion.arm_power import STALE
from tvist_controller.sources.own_plants import OwnPlant
from tvist_plant.foreign import told
from tvist_plant.plant import PlantError
from tvist_protocol import commands as c
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import UR5E, NoArm, Robot, setup

TARGET = tuple(np.add(STANDS, [0.3, -0.2, 0.2, 0.0, 0.1, 0.0]).tolist())


def ready():
    """A robot that has switched its arm on."""
    plant = OwnArm(UR5E, UR5E.payload)
    robot = Robot(plant=plant)
    robot.tick(SWITCHES + 1)
    return plant, robot


def modes(robot):
    state = robot.states[-1]
    return RobotMode(state.robot_mode), SafetyMode(state.safety_mode)


def test_it_is_not_stepped_before_the_first_tick_and_the_line_begins_where_it_stands():
    plant = OwnArm(UR5E, UR5E.payload)
    controller = Controller(setup(), plant)
    assert plant._ticks == 0
    assert controller.setup.q == tuple(STANDS)
    assert controller.latest.actual_q == list(STANDS) == controller.latest.target_q
    assert (plant.q == STANDS).all()


def test_it_moves_once_its_drives_are_ready_and_not_before():
    robot = Robot(plant=OwnArm(UR5E, UR5E.payload))
    robot.tick(SWITCHES // 2)
    refused = robot.send(c.MoveJ, q=TARGET)
    assert (refused.code, "not ready" in refused.why) == ("wrong_mode", True)
    robot.tick(SWITCHES)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)
    assert robot.until_rest().actual_q == pytest.approx(TARGET, abs=5e-4)


def test_a_program_waits_until_its_drives_are_ready():
    robot = Robot(plant=OwnArm(UR5E, UR5E.payload))
    robot.send(c.ProgramRun, text=f"def p():\n  movej({list(TARGET)})\nend\n")
    robot.tick(1500)
    assert robot.kinds()[:4] == ["program_started", "motion_started", "motion_done", "program_stopped"]
    assert robot.states[-1].actual_q == pytest.approx(TARGET, abs=5e-4)


def test_power_and_brakes_follow_the_robot_mode_and_it_goes_on_from_where_it_was_moved_to():
    plant, robot = ready()
    assert plant.calls == [(True, False)]
    assert robot.send(c.PowerOff) is not None
    robot.tick()
    assert plant.calls[-1] == (False, True)
    plant.q = plant.q + 0.05  # by hand
    robot.tick(3)
    assert robot.send(c.PowerOn) is not None
    robot.tick(SWITCHES + 2)
    assert plant.calls[-1] == (True, False)
    assert robot.states[-1].target_q == pytest.approx(STANDS + 0.05)
    assert robot.states[-1].actual_q == pytest.approx(STANDS + 0.05, abs=5e-4)


def test_power_on_does_not_let_an_arm_that_is_held_sink_to_where_it_is_measured():
    plant, robot = ready()
    plant.measure, measure = lambda: sagging(measure()), plant.measure
    assert isinstance(robot.send(c.PowerOn), Done)
    robot.tick()
    assert robot.states[-1].target_q == pytest.approx(STANDS)


def sagging(measured):
    measured.q = measured.q - 0.002
    return measured


def test_what_moves_it_until_its_drives_hold_it_is_no_jump_of_theirs():
    plant = OwnArm(UR5E, UR5E.payload)
    robot = Robot(plant=plant)
    robot.tick(SWITCHES // 2)
    plant.q = plant.q + 0.1  # it is let go for a moment
    robot.tick(SWITCHES)
    assert robot.states[-1].target_q == pytest.approx(STANDS + 0.1)
    assert np.abs(np.diff(robot.column("actual_q"), axis=0)).max() <= 0.1 + 1e-9
    assert robot.states[-1].actual_q == pytest.approx(STANDS + 0.1, abs=5e-3)


def test_a_fault_right_after_its_drives_hold_it_lets_the_line_begin_anew_once():
    plant = OwnArm(UR5E, UR5E.payload)
    robot = Robot(plant=plant)
    begun, reset = [], robot.controller.cycle.reset
    robot.controller.cycle.reset = lambda *q, **options: (
        begun.append(len(robot.states)) or reset(*q, **options)
    )
    while not begun:
        robot.tick()
    plant.fault = "joint 3 is too warm"
    robot.tick(20)
    assert len(begun) == 1
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)


def test_it_is_asked_once_where_it_stands_when_the_line_begins():
    plant = OwnArm(UR5E, UR5E.payload)
    cycle, asked, measure = Controller(setup(), plant).cycle, [], plant.measure
    plant.measure = lambda: asked.append(1) or measure()
    cycle.reset(STANDS)
    assert len(asked) == 1


def test_it_is_left_without_power():
    plant, robot = ready()
    robot.controller.motion.power.end()
    assert plant.stops == 1
    assert plant.calls[-1] == (False, True)


def test_a_fault_of_its_own_stops_it_until_the_fault_is_gone_and_safety_is_restarted():
    plant, robot = ready()
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    plant.fault = "joint 3 is too warm"
    robot.until_rest()
    robot.tick(2)
    stops = [event for event in robot.events if event.kind == "safety_stop"]
    assert [event.category for event in stops] == [0]
    assert "joint 3 is too warm" in stops[0].why
    assert "motion_stopped" in robot.kinds()
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    assert plant.stops == 1
    assert robot.send(c.PowerOn).code == "wrong_mode"
    robot.send(c.RestartSafety)
    robot.tick()
    assert modes(robot)[1] is SafetyMode.FAULT  # it is still too warm
    plant.fault = None
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    robot.tick(SWITCHES + 1)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)
    assert robot.until_rest().actual_q == pytest.approx(TARGET, abs=5e-4)


def test_power_that_comes_back_before_the_next_tick_is_switched_on_again():
    plant, robot = ready()
    for kind, fields in ((SimulationInject, {"fault": "fault"}), (c.RestartSafety, {}), (c.PowerOn, {})):
        assert isinstance(robot.send(kind, **fields), Done)
    robot.tick(SWITCHES + 1)
    assert modes(robot) == (RobotMode.RUNNING, SafetyMode.NORMAL)
    assert plant.calls == [(True, False), (True, False)]
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)


def test_one_that_switches_itself_off_stops_the_robot():
    plant, robot = ready()
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    plant.stop()
    robot.until_rest()
    robot.tick()
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    assert any("switched off its drives" in (event.why or "") for event in robot.events)


def test_one_that_does_not_answer_is_told_of_once():
    plant, robot = ready()
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    plant.silent = True
    robot.tick(50)
    failures = [event for event in robot.events if event.code == "plant_failure"]
    assert [event.kind for event in failures] == ["motion_stopped", "safety_stop"]
    assert failures[-1].why == "the arm does not answer"
    stood = np.array(robot.states[-1].actual_q)
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    plant.silent = False
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    robot.tick(SWITCHES + 2)
    assert robot.states[-1].target_q == pytest.approx(stood)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)
    assert robot.until_rest().actual_q == pytest.approx(TARGET, abs=5e-4)


@pytest.mark.parametrize("unknown", ["failing", "not finite"])
def test_where_it_stands_may_be_unknown_until_it_answers_again(unknown):
    plant, robot = ready()
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    plant.silent, plant.measure = True, fails if unknown == "failing" else lambda: not_finite(plant)
    robot.tick(3)
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    assert np.isfinite(robot.states[-1].target_q).all()
    robot.send(c.RestartSafety)
    refused = robot.send(c.PowerOn)
    assert (refused.code, "plant OwnArm" in refused.why) == ("wrong_mode", True)
    robot.send(c.RestartSafety)
    plant.silent = False
    del plant.measure
    assert isinstance(robot.send(c.PowerOn), Done)
    robot.tick(SWITCHES + 2)
    assert robot.states[-1].target_q == pytest.approx(plant.q)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)
    assert robot.until_rest().actual_q == pytest.approx(TARGET, abs=5e-4)


def test_it_cannot_be_served_if_nobody_knows_where_it_stands():
    plant = OwnArm(UR5E, UR5E.payload)
    plant.measure = fails
    with pytest.raises(ValueError, match="where it stands is unknown: no answer"):
        Controller(setup(), plant)


def fails():
    raise PlantError("no answer")


def not_finite(plant):
    measured = OwnArm.measure(plant)
    measured.q = measured.q * np.nan
    return measured


@pytest.mark.parametrize("method", ["condition", "stop", "switch"])
def test_one_that_does_not_answer_may_fail_in_any_method(method):
    class Fails(OwnArm):
        broken = False

    def answer(self, *_, **given):
        if self.broken:
            raise PlantError("no answer")
        return own.fget(self) if isinstance(own, property) else own(self, **given)

    own = getattr(OwnArm, method)
    setattr(Fails, method, property(answer) if isinstance(own, property) else answer)
    plant = Fails(UR5E, UR5E.payload)
    robot = Robot(plant=plant)
    robot.tick(SWITCHES + 1)
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    plant.broken = True
    robot.send(SimulationInject, fault="fault")
    robot.tick(1000)
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    robot.tick()
    assert robot.send(c.MoveJ, q=TARGET).code == "wrong_mode"
    plant.broken = False
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    robot.tick(SWITCHES + 2)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)


@pytest.mark.parametrize("field", ["q", "moment"])
def test_one_that_measures_what_is_no_number_stops_the_robot(field):
    plant, robot = ready()
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    step = plant.step

    def wrong(command):
        measured = step(command)
        setattr(measured, field, np.full(6, np.nan))
        return measured

    plant.step = wrong
    robot.tick()
    assert any("no number" in (event.why or "") for event in robot.events)
    assert modes(robot)[1] is SafetyMode.FAULT


def test_measurements_whose_time_does_not_pass_are_no_measurements():
    plant, robot = ready()
    plant.measure, kept = (lambda: kept), plant.measure()
    robot.tick(STALE + 1)
    assert any("not measured" in (event.why or "") for event in robot.events)
    assert modes(robot)[1] is SafetyMode.FAULT


def test_it_cannot_be_put_anywhere():
    _, robot = ready()
    before = robot.controller.latest
    refused = robot.send(SimulationReset, q=TARGET)
    assert (refused.code, "OwnArm" in refused.why) == ("unknown_type", True)
    assert robot.controller.latest == before
    assert isinstance(Robot(plant=NoArm()).send(SimulationReset, q=tuple(UR5E.poses["Q2"])), Done)


def test_a_plant_needs_one_of_two_ways_to_begin():
    class Neither:
        payload = UR5E.payload

        def step(self, command):  # noqa: ARG002  as the interface has it
            raise AssertionError

    with pytest.raises(ValueError, match="Neither has neither reset nor measure"):
        Controller(setup(), Neither())


class Cut(OwnArm):
    """An arm whose cable may be cut: each method then raises what no method of a plant should."""

    cut = ()

    def __getattribute__(self, name):
        if name in object.__getattribute__(self, "cut"):
            raise OSError("no cable")
        return object.__getattribute__(self, name)

    def push(self, torque):
        """Feel nothing."""


def cut_off():
    """A robot whose arm is switched on, and the arm."""
    arms = []
    plant = OwnPlant("cut.py:Cut", "", lambda *given: arms.append(Cut(*given)) or arms[0])
    robot = Robot(plant=plant.make(UR5E, UR5E.payload))
    robot.tick(SWITCHES + 1)
    return arms[0], robot


@pytest.mark.parametrize(
    "names", [("step",), ("condition",), ("step", "condition", "switch", "measure", "stop")]
)
def test_whatever_a_method_of_somebody_s_own_arm_raises_stops_that_robot_alone_and_is_named(names):
    arm, robot = cut_off()
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)
    arm.cut = names
    robot.tick(5)
    stops = [event for event in robot.events if event.kind == "safety_stop"]
    assert [(event.category, "OSError: no cable" in event.why) for event in stops] == [(0, True)]
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    raised = told(robot.controller.cycle.plant)
    assert raised
    assert all(isinstance(error, OSError) and error.__traceback__ for error in raised)
    arm.cut = ()
    assert (arm.stops > 0) == ("stop" not in names)
    robot.send(c.RestartSafety)
    robot.send(c.PowerOn)
    robot.tick(SWITCHES + 2)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)


def test_a_push_or_reset_that_fails_is_refused_and_stops_the_robot():
    arm, robot = cut_off()
    robot.send(SimulationInject, fault="torque", joint=1, value=5.0, seconds=0.05)
    arm.cut = ("push",)
    refused = robot.send(SimulationInject, fault="torque", joint=0, value=5.0, seconds=1.0)
    assert (refused.code, "OSError: no cable" in refused.why) == ("plant_failure", True)
    robot.tick(100)
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)


def test_a_simulated_arm_that_goes_on_failing_gets_no_power():
    class Mock(NoArm):
        def step(self, command):
            if self.broken:
                raise PlantError("the glass is broken")
            return super().step(command)

        broken = False

    plant = Mock()
    robot = Robot(plant=plant)
    robot.tick(10)
    plant.broken = True
    robot.tick(20)
    assert modes(robot) == (RobotMode.POWER_OFF, SafetyMode.FAULT)
    assert [event.kind for event in robot.events if event.code == "plant_failure"] == ["safety_stop"]
