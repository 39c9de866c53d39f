"""A controller in front of a robot moves it as one inside would, over a link that loses packages."""

from itertools import islice, pairwise

import numpy as np
import pytest
from tests.bridge.in_lockstep import IDEAL, Bridge, HiddenRobot, Link, Way
from tests.bridge.motions import PAPER, Asked, asked, made
from tests.controller.robots import Q1, UR5E

from tvist_controller.setup import paper_payload
from tvist_lab.study.measures import WORTH
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_server.moving import program as registers

PAYLOAD = paper_payload(UR5E)
NEAR = Q1 + np.array([0.15, 0.0, 0.0, 0.1, 0.1, 0.1])  # what needs more than 90 % of a torque is late
SHORT = Asked(NEAR, (1.5, 2.0, 100.0))


def test_packages_arrive_in_order_within_the_jitter_and_those_behind_a_lost_one_with_it():
    link, sent = Link(loss=0.02), np.arange(0.0, 20_000.0, 2.0)
    way = Way(link, [7])
    took = np.array([way.arrival(now) - now for now in sent])
    assert (np.diff(took) >= -2.0).all()
    late = took > link.delay + link.jitter
    assert took[~late].min() >= link.delay - link.jitter
    assert took.max() <= 2.0 * (link.delay + link.jitter + link.again[1])
    lost = [now and not before for before, now in pairwise(late)]
    assert 0.7 < np.sum(lost) / (0.02 * len(sent)) < 1.3
    assert np.allclose(took, [again.arrival(now) - now for again in [Way(link, [7])] for now in sent])


def targets(side, ticks):
    rows = []
    for _ in range(ticks):
        side.tick()
        state = side.robot.controller.latest
        rows.append((state.target_q, state.actual_q))
    return np.array(rows)


@pytest.mark.parametrize("shaper", ["zv", "auto"])
def test_over_an_ideal_link_the_robot_s_target_is_that_of_a_shaper_inside_a_fixed_time_later(shaper):
    inside = HiddenRobot(UR5E, 3, Q1, PAYLOAD, shaper)
    bridge = Bridge(UR5E, 3, Q1, PAYLOAD, shaper, IDEAL)
    for side in (inside, bridge):
        side.send(MoveJ, q=tuple(NEAR.tolist()))
    there, through = targets(inside, 500), targets(bridge, 500)
    late = bridge.late
    assert late <= 3  # a tick to be there, a period of buffer, and the robot's differentiator
    apart = np.abs(through[late:, 0] - there[:-late, 0])
    assert apart.max() < 1e-5
    # Nothing is compensated twice: the arm rests where the robot alone would let it rest, not only its target.
    assert np.abs(through[-1] - there[-1]).max() < 2e-5
    assert np.abs(through[-1, 0] - NEAR).max() < 1e-9


def test_equal_seeds_make_equal_motions_and_other_links_other_ones():
    def motion(link):
        bridge = Bridge(UR5E, 5, Q1, PAYLOAD, "zv", link)
        bridge.send(MoveJ, q=tuple(NEAR.tolist()))
        return targets(bridge, 300).tobytes()

    lossy = Link(loss=0.02)
    assert motion(lossy) == motion(lossy) != motion(Link())


@pytest.mark.parametrize("robot", ["ur5e", "ur5-light"])
def test_the_paper_s_motions_come_first_and_random_ones_follow_from_where_each_ended(robot):
    description = load(robot)
    few, same = (list(islice(asked(description, 3, 11), None)) for _ in range(2))
    assert [one.q.tolist() for one in few[: len(PAPER)]] == [list(description.poses[name]) for name in PAPER]
    assert len(few) == len(PAPER) + 3
    assert all((one.q == other.q).all() for one, other in zip(few, same, strict=True))


def test_a_motion_that_the_robot_refuses_ends_the_comparison_and_says_why():
    far = Asked(np.full(6, 7.0), SHORT.speed)
    done = made(HiddenRobot(UR5E, 3, Q1, PAYLOAD), [far, SHORT])
    assert done.peaks == []
    assert "q[0]" in done.stops[0]


@pytest.mark.nightly
@pytest.mark.parametrize("shaper", ["auto", "auto-target"])
@pytest.mark.parametrize(("name", "seed"), [("ur5e", 11), ("ur5-light", 12), ("ur5e", 13)])
def test_over_a_link_that_loses_packages_a_shaper_in_front_leaves_what_one_inside_leaves(
    name, seed, shaper, measured
):
    description = load(name)
    payload, start = paper_payload(description), np.array(description.poses["Q1"])
    motions = list(asked(description, 12, seed))
    bridge = Bridge(description, seed, start, payload, shaper, Link())
    sides = (
        HiddenRobot(description, seed, start, payload),
        HiddenRobot(description, seed, start, payload, shaper),
        bridge,
    )
    plain, inside, through = (made(side, motions) for side in sides)
    assert not inside.stops + through.stops
    before, within, behind = map(np.array, (plain.peaks, inside.peaks, through.peaks))
    count = min(map(len, (before, within, behind)))
    rings = before[:count] >= WORTH
    less, less_through = (
        100.0 * (1.0 - peaks[:count][rings] / before[:count][rings]) for peaks in (within, behind)
    )
    points = less_through - less
    apart = 1e3 * float(np.abs(np.array(inside.ends) - np.array(through.ends)).max())
    ages, speed = bridge.port.counts.played, min(description.limits.velocity)
    older = 100.0 * sum(number for age, number in ages.items() if age > 2) / sum(ages.values())
    for what, value in {
        "motions that ring": rings.sum(), "inside, median [%]": np.median(less),
        "through, median [%]": np.median(less_through), "points, median": np.median(points),
        "points, p5": np.percentile(points, 5), "points, worst": points.min(),
        "periods alone": bridge.port.output(registers.ALONE), "set-points older than two ticks [%]": older,
        "rest apart [mrad]": apart,
    }.items():  # fmt: skip
        measured(what, f"{value:.4g}")
    assert rings.sum() >= 8
    assert points.min() > -3.0
    assert bridge.port.counts.largest_step <= speed * PERIOD
    assert bridge.port.setpoints.limited == 0
    assert apart < 0.05
