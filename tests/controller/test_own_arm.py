"""A real arm: a given position, power, brakes and faults, or a controller of its own."""

from dataclasses import replace

import numpy as np
import pytest
from tests.own_arm import STANDS, SWITCHES, OwnArm

from tvist_controller.controller import Controller
from tvist_controller.motion.arm_power import STALE
from tvist_controller.setup import body, paper_payload
from tvist_controller.sources.own_plants import OwnPlant
from tvist_plant.description import Payload
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.foreign import called, told
from tvist_plant.plant import PERIOD, Condition, Halt, Measurement, Plant, PlantError, RobotReport
from tvist_protocol import commands as c
from tvist_protocol.io import SetIo
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q2, UR5E, NoArm, Robot, setup

TARGET = tuple(np.add(STANDS, [0.3, -0.2, 0.2, 0.0, 0.1, 0.0]).tolist())


def ready():
    """Return a robot whose arm is switched on."""
    plant = OwnArm(UR5E, UR5E.payload)
    robot = Robot(plant=plant)
    robot.tick(SWITCHES + 1)
    return plant, robot


def modes(robot):
    state = robot.states[-1]
    return RobotMode(state.robot_mode), SafetyMode(state.safety_mode)


FAILED = RobotMode.POWER_OFF, SafetyMode.FAULT


def moving(robot):
    robot.send(c.MoveJ, q=TARGET)
    robot.tick(100)


def restart(robot):
    robot.send(c.RestartSafety)
    reply = robot.send(c.PowerOn)
    robot.tick(SWITCHES + 2)
    return reply


def moves(robot):
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)
    assert robot.until_rest().actual_q == pytest.approx(TARGET, abs=5e-4)


def test_the_line_starts_at_the_measured_position_without_a_step():
    controller = Controller(setup(), OwnArm(UR5E, UR5E.payload))
    assert controller.setup.q == tuple(STANDS)
    assert controller.latest.actual_q == list(STANDS) == controller.latest.target_q


def test_an_arm_moves_only_after_its_drives_are_ready():
    robot = Robot(plant=OwnArm(UR5E, UR5E.payload))
    robot.tick(SWITCHES // 2)
    refused = robot.send(c.MoveJ, q=TARGET)
    assert (refused.code, "not ready" in refused.why) == ("wrong_mode", True)
    robot.tick(SWITCHES)
    moves(robot)


def test_power_and_brakes_follow_the_robot_mode():
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


def test_a_fault_of_the_arm_stops_it_until_safety_is_restarted():
    plant, robot = ready()
    moving(robot)
    plant.fault = "joint 3 is too warm"
    robot.until_rest()
    robot.tick(2)
    stops = robot.told("safety_stop")
    assert [event.category for event in stops] == [0]
    assert "joint 3 is too warm" in stops[0].why
    assert "motion_stopped" in robot.kinds()
    assert modes(robot) == FAILED
    assert plant.stops == 1
    assert robot.send(c.PowerOn).code == "wrong_mode"
    robot.send(c.RestartSafety)
    robot.tick()
    assert modes(robot)[1] is SafetyMode.FAULT  # it is still too warm
    plant.fault = None
    restart(robot)
    moves(robot)


def test_an_arm_that_does_not_answer_is_reported_once():
    plant, robot = ready()
    moving(robot)
    plant.silent = True
    robot.tick(50)
    failures = [event for event in robot.events if event.code == "plant_failure"]
    assert [event.kind for event in failures] == ["motion_stopped", "safety_stop"]
    assert failures[-1].why == "the arm does not answer"
    stood = np.array(robot.states[-1].actual_q)
    assert modes(robot) == FAILED
    plant.silent = False
    restart(robot)
    assert robot.states[-1].target_q == pytest.approx(stood)
    moves(robot)


@pytest.mark.parametrize("unknown", ["failing", "not finite"])
def test_power_on_is_refused_while_the_position_is_unknown(unknown):
    plant, robot = ready()
    moving(robot)
    plant.silent, plant.measure = True, fails if unknown == "failing" else lambda: not_finite(plant)
    robot.tick(3)
    assert modes(robot) == FAILED
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
    moves(robot)


def test_an_arm_with_unknown_position_cannot_start():
    plant = OwnArm(UR5E, UR5E.payload)
    plant.measure = fails
    with pytest.raises(ValueError, match="where it stands is unknown: no answer"):
        Controller(setup(), plant)


def fails(*_):
    raise PlantError("no answer")


def not_finite(plant):
    measured = OwnArm.measure(plant)
    measured.q = measured.q * np.nan
    return measured


@pytest.mark.parametrize("field", ["q", "moment"])
def test_non_finite_measurements_stop_the_robot(field):
    plant, robot = ready()
    moving(robot)
    step = plant.step
    plant.step = lambda command: replace(step(command), **{field: np.full(6, np.nan)})
    robot.tick()
    assert any("not finite numbers" in (event.why or "") for event in robot.events)
    assert modes(robot)[1] is SafetyMode.FAULT


def test_stale_measurements_stop_the_robot():
    plant, robot = ready()
    plant.measure, kept = (lambda: kept), plant.measure()
    robot.tick(STALE + 1)
    assert any("not measured" in (event.why or "") for event in robot.events)
    assert modes(robot)[1] is SafetyMode.FAULT


def test_an_arm_without_reset_cannot_be_placed():
    _, robot = ready()
    before = robot.controller.latest
    refused = robot.send(SimulationReset, q=TARGET)
    assert (refused.code, "OwnArm" in refused.why) == ("unknown_type", True)
    assert robot.controller.latest == before
    assert isinstance(Robot(plant=NoArm()).send(SimulationReset, q=tuple(UR5E.poses["Q2"])), Done)


class Cut(OwnArm):
    """An arm with a cable that may be cut: its methods then raise exceptions that plants should not raise."""

    cut = ()

    def __getattribute__(self, name):
        if name in object.__getattribute__(self, "cut"):
            raise OSError("no cable")
        return object.__getattribute__(self, name)

    def push(self, torque):
        """Feel nothing."""


@pytest.mark.parametrize(
    "names", [("step",), ("condition",), ("step", "condition", "switch", "measure", "stop")]
)
def test_an_exception_of_a_plant_method_stops_the_robot_and_is_reported(names):
    arm = Cut(UR5E, UR5E.payload)
    robot = Robot(plant=OwnPlant("cut.py:Cut", "", lambda *_: arm).make(UR5E, UR5E.payload))
    robot.tick(SWITCHES + 1)
    moving(robot)
    arm.cut = names
    robot.tick(5)
    stops = robot.told("safety_stop")
    assert [(event.category, "OSError: no cable" in event.why) for event in stops] == [(0, True)]
    assert modes(robot) == FAILED
    raised = told(robot.controller.cycle.plant)
    assert raised
    assert all(isinstance(error, OSError) and error.__traceback__ for error in raised)
    arm.cut = ()
    assert (arm.stops > 0) == ("stop" not in names)
    restart(robot)
    assert isinstance(robot.send(c.MoveJ, q=TARGET), Accepted)


def test_a_simulated_arm_that_keeps_failing_stays_without_power():
    plant = NoArm()
    robot = Robot(plant=plant)
    robot.tick(10)

    plant.step = fails
    robot.tick(20)
    assert modes(robot) == FAILED
    assert [event.kind for event in robot.events if event.code == "plant_failure"] == ["safety_stop"]


PUSH = {"fault": "torque", "joint": 1, "value": 40.0, "seconds": 0.1}


def test_a_given_flexible_arm_equals_the_default_plant():
    """The setup determines the payload, whatever the plant carried before."""
    given = FlexibleArm(UR5E, Payload())
    robots = Robot(seed=3), Robot(seed=3, plant=given)
    for robot in robots:
        assert isinstance(robot.send(c.MoveJ, q=tuple(Q2.tolist())), Accepted)
        robot.tick(200)
        assert robot.send(SimulationInject, **PUSH) == Done()
        robot.until_rest()
    assert robots[0].states == robots[1].states
    assert robots[1].controller.cycle.plant is given
    assert given.payload == body(paper_payload(UR5E))


@pytest.mark.parametrize("plant", [NoArm(), type("Own", (NoArm, Plant), {"payload": Payload()})()])
def test_a_user_plant_follows_the_reference(plant):
    """It follows the reference plus the lead for the twist of the flexible arm's gears."""
    robot = Robot(plant=plant)
    robot.send(c.MoveJ, q=tuple(Q2.tolist()))
    assert robot.until_rest().actual_q == pytest.approx(Q2, abs=1e-6)
    np.testing.assert_allclose(robot.column("actual_q"), robot.column("target_q"), rtol=0.0, atol=5e-4)


@pytest.mark.parametrize(("fields", "method"), [(PUSH, "push"), ({"fault": "nan"}, "make_nan")])
def test_faults_that_the_plant_cannot_simulate_are_refused(fields, method):
    refused = Robot(plant=NoArm()).send(SimulationInject, **fields)
    assert refused.code == "unknown_fault"
    assert "NoArm" in refused.why
    assert method in refused.why


def test_truth_is_refused_for_a_plant_that_cannot_report_it():
    with pytest.raises(ValueError, match="NoArm cannot report it"):
        Controller(setup(truth=True), NoArm())


@pytest.mark.parametrize(("field", "value", "said"), [
    ("q", np.zeros(5), r"measured q has shape \(5,\): its shape must be \(6,\)"),
    ("qd", [0.0] * 6, "measured qd is not an array"),
    ("accelerometer", np.zeros(6), r"must be \(3,\)"),
    ("wrench", np.zeros(3), r"measured wrench has shape \(3,\): its shape must be \(6,\)"),
])  # fmt: skip
def test_measurements_of_wrong_shape_are_refused_at_start(field, value, said):
    class Wrong(NoArm):
        def step(self, command):
            parts = {"q": command.q, "qd": command.qd, "moment": command.q, "accelerometer": np.zeros(3)}
            return Measurement(**(parts | {field: value}))

    with pytest.raises(ValueError, match=f"plant Wrong: .*{said}"):
        Controller(setup(), Wrong())


class OtherController:
    """Follows the commanded positions exactly, and stops when commanded."""

    payload = Payload(mass=5.0)

    def __init__(self):
        self.q, self.holds, self.halt, self.forbids, self.ticks = np.array(Q2), False, None, None, 0
        self.sent = []
        still = Measurement(self.q, np.zeros(6), np.zeros(6), np.zeros(3))
        shaped = np.array([self.q, *np.zeros((3, 6))])
        self.report = RobotReport(0, still, shaped, (7, 1, 1), 1.0, 0, payload=self.payload, slider=1.0)

    def described(self):
        return UR5E

    def latest_report(self):
        return self.report

    def wait(self, timeout):  # noqa: ARG002
        return True

    def switch(self, *, power, brakes):
        self.holds, self.halt = power and not brakes, None

    def stop(self):
        self.holds = False

    @property
    def condition(self):
        return Condition(self.holds, halt=self.halt)

    def measure(self):
        if self.forbids is not None:
            raise PlantError(self.forbids)
        return self._measured()

    def step(self, command):
        self.ticks += 1
        if self.holds and self.halt is None:
            self.q = command.q.copy()
            self.sent.append(self.q)
        return self._measured()

    def _measured(self):
        return Measurement(
            self.q, np.zeros(6), np.zeros(6), np.array([0.0, 0.0, 9.81]), timestamp=self.ticks * PERIOD
        )

    def says(self, **changes):
        self.report = replace(self.report, **changes)


@pytest.fixture
def arm():
    return OtherController()


@pytest.fixture
def robot(arm):
    robot = Robot(plant=arm)
    robot.tick(5)
    return robot


def let_move(robot, arm):
    robot.send(c.MoveJ, q=[Q2[0] + 0.5, *Q2[1:]], velocity=0.5, acceleration=1.0, jerk=20.0)
    robot.tick(200)
    assert np.abs(arm.q - np.array(Q2)).max() > 0.01


def halted(robot, arm, safety):
    arm.halt = Halt("somebody stopped it", safety)
    arm.says(modes=(7, safety, 1))
    robot.tick(2)


@pytest.mark.parametrize(
    "safety", [SafetyMode.NORMAL, SafetyMode.PROTECTIVE_STOP, SafetyMode.ROBOT_EMERGENCY_STOP]
)
def test_after_a_stop_by_the_arm_controller_nothing_is_sent_until_the_line_restarts(robot, arm, safety):
    let_move(robot, arm)
    halted(robot, arm, safety)
    sent = len(arm.sent)
    protective = safety == SafetyMode.PROTECTIVE_STOP
    state = robot.states[-1]
    assert state.safety_mode == safety
    assert state.robot_mode == (RobotMode.RUNNING if protective else RobotMode.POWER_OFF)
    told = [event for event in robot.events if event.why == "somebody stopped it"]
    assert {event.kind for event in told} == {
        "motion_stopped",
        "protective_stop" if protective else "safety_stop",
    }
    again = c.UnlockProtectiveStop if protective else c.PowerOn
    arm.forbids = "switch it on at the robot"
    assert isinstance(robot.send(again), Refused)
    arm.forbids, arm.q = None, arm.q + 0.05  # people have moved it meanwhile
    arm.says(modes=(7, 1, 1))
    robot.tick(300)
    assert (len(arm.sent), arm.holds) == (sent, False)
    reply = robot.send(again)
    assert not isinstance(reply, Refused), reply
    robot.tick(20)
    stands = arm.sent[sent]
    assert len(arm.sent) > sent + 10
    assert all(np.abs(q - stands).max() < 1e-12 for q in arm.sent[sent:])
    assert stands == pytest.approx(arm.q, abs=1e-12)


def test_a_lease_expires_while_the_arm_controller_does_not_answer(arm):
    robot = Robot(plant=arm, clock="realtime", lease_s=0.2)
    robot.tick(5)
    arm.latest_report = fails
    robot.tick(200)
    assert robot.controller.session.lease is None
    assert "lease_lost" in [event.kind for event in robot.events]


def test_the_speed_slider_of_the_robot_scales_motions(robot, arm):
    robot.send(c.SetSpeed, fraction=0.5)
    arm.says(slider=0.4)
    robot.tick(2)
    assert robot.states[-1].speed_scaling == pytest.approx(0.2)
    assert robot.controller.io().target_speed_fraction == 0.5
    arm.says(slider=1.0)
    robot.tick(2)
    assert robot.states[-1].speed_scaling == pytest.approx(0.5)


@pytest.mark.parametrize("said", [{"slider": np.nan}, {"slider": -1.0}, {"speed": np.inf}, {"tool": (1.0,)}])
def test_impossible_reports_stop_the_robot_and_name_the_field(arm, said):
    robot = Robot(plant=called(arm, 6))
    robot.tick(5)
    let_move(robot, arm)
    arm.says(**said)
    robot.tick(2)
    assert f"{next(iter(said))} is" in robot.events[-1].why
    assert not arm.holds


def test_commands_that_would_not_reach_the_robot_are_refused(robot):
    for command, given, words in (
        (SetIo, {"digital_output_mask": 1, "digital_outputs": 1}, "only set-points are sent"),
        (c.SetPayload, {"mass": 1.0, "com": (0.0, 0.0, 0.0), "inertia": (0.0,) * 6}, "set it there first"),
        (c.SetShaper, {"name": "elastic"}, "takes positions only"),
    ):
        reply = robot.send(command, **given)
        assert isinstance(reply, Refused)
        assert words in reply.why


def test_positions_sent_to_a_real_arm_are_not_corrected_for_gear_twist(robot, arm):
    let_move(robot, arm)
    targets = [state.target_q for state in robot.states if state.tick > 10]
    assert np.array(arm.sent[-150:]) == pytest.approx(np.array(targets[-150:]), abs=1e-12)
