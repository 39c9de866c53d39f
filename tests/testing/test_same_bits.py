"""The same test gives the same bits, in whatever order tests run, since each robot starts from the same memory."""

import hashlib

import pytest

OFTEN, SOMETIMES = 3, 20


def bits(robot):
    """A digest of all that a robot sends during a motion with a fault."""
    digest = hashlib.sha256()
    robot.on_state(lambda state: digest.update(repr(state).encode()))
    robot.on_event(lambda event: digest.update(repr(event).encode()))
    robot.on_truth(lambda truth: digest.update(repr(truth).encode()))
    with robot.control("same") as arm:
        arm.inject("torque", joint=2, value=20.0, seconds=0.05)
        arm.move_j([0.2, -3.0, 0.1, -1.6, 0.1, 0.0])
    robot.advance(50)
    robot.info()  # answered behind the last truth
    return digest.hexdigest()


@pytest.fixture(scope="module")
def seen():
    return set()


@pytest.mark.tvist_payload(3.0)
class TestInAnyOrder:
    @pytest.mark.parametrize(
        "run",
        [*range(OFTEN), *(pytest.param(run, marks=pytest.mark.nightly) for run in range(OFTEN, SOMETIMES))],
    )
    def test_the_robot_fixture_repeats_a_motion_bit_for_bit(self, tvist_robot, seen, run):  # noqa: ARG002  each run
        seen.add(bits(tvist_robot))
        assert len(seen) == 1

    @pytest.mark.tvist_seed(1)
    def test_another_seed_gives_other_bits(self, tvist_robot, seen):
        assert bits(tvist_robot) not in seen
