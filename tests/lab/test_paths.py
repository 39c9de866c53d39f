"""Paths shaped along their parameter and joint by joint: the references are the robot's, and distances are right."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.search.subject import Subject

from tvist_controller import calibrations
from tvist_controller.setup import paper_payload
from tvist_lab.studies.path_examples import circle, corner
from tvist_lab.studies.path_shaping import ALONG, JOINTS, UNSLOWED, WAYS, planned, shaped
from tvist_lab.studies.paths import COLUMNS, PathJob, compare, draw, page_of, report, rows, title_of
from tvist_lab.studies.random_paths import KINDS, REGULAR
from tvist_lab.studies.tool_path import ToolPath, jacobian
from tvist_lab.study.measures import kinematics
from tvist_lab.study.tables import cells
from tvist_plant.description import load
from tvist_protocol.motions import MovePath
from tvist_protocol.replies import Accepted


@pytest.fixture(scope="module")
def ur5e():
    return load("ur5e").disturbed_by([])


@pytest.fixture(scope="module")
def job(ur5e, modal):
    return PathJob(ur5e, modal, ("auto",), (0.0, 5.0), seed=5, place=2)


class TestReferences:
    @pytest.mark.parametrize("shaper", ["zv", "auto", "auto-target"])
    def test_a_path_shaped_along_it_is_what_the_robot_plays(self, ur5e, shaper):
        paper = calibrations.load("ur5e_5kg")
        job = PathJob(ur5e, paper, (shaper,), (5.0, 5.0), seed=5, place=2)
        move = draw(job).move
        reference, tvist = planned(ur5e, paper, shaper, move)
        ours = shaped(reference, tvist, ALONG)
        robot = Subject(ur5e, np.array(move.start), paper_payload(ur5e, 5.0), shaper=shaper)
        assert isinstance(robot.send(MovePath, segments=move.command.segments), Accepted)
        robot.until_rest()
        theirs = np.array(robot.references[1:])
        both = min(len(ours), len(theirs))
        assert np.array_equal(ours[: both - 12], theirs[: both - 12])
        assert np.abs(ours[-1] - theirs[-1]).max() < 1e-6

    def test_both_ways_end_where_the_path_ends(self, job):
        reference, tvist = draw(job).plans["auto"]
        for way in WAYS:
            assert np.abs(shaped(reference, tvist, way)[-1] - reference.q[-1]).max() < 1e-6

    def test_the_path_is_kept_along_it_and_left_joint_by_joint(self, ur5e, job):
        reference, tvist = draw(job).plans["auto"]
        path = ToolPath(kinematics(ur5e), reference.sampled())
        off = {way: path.off(shaped(reference, tvist, way)) for way in (ALONG, JOINTS)}
        assert off[ALONG][0].max() < 2e-6
        assert off[ALONG][1].max() < 1e-5
        assert off[JOINTS][0].max() > 5e-5


class TestDraws:
    @pytest.mark.parametrize("place", range(3))
    def test_a_seed_and_a_place_draw_one_path(self, job, place):
        here = replace(job, place=place)
        assert draw(here).move == draw(here).move
        assert draw(here).move.kind == KINDS[place]
        assert draw(here).move != draw(replace(here, seed=6)).move

    def test_starts_are_not_singular_and_speeds_in_their_ranges(self, ur5e, job):
        for place in range(6):
            move = draw(replace(job, place=place)).move
            values = np.linalg.svd(jacobian(kinematics(ur5e), np.array(move.start)), compute_uv=False)
            assert values[-1] >= REGULAR
            for segment in move.command.segments:
                assert 0.1 <= segment.velocity <= 1.0
                assert 0.5 <= segment.acceleration <= 3.0

    def test_kinds_that_are_chosen_take_turns(self, job):
        assert [replace(job, place=place, kinds=("arc",)).kind for place in range(3)] == ["arc"] * 3


class TestDistances:
    @staticmethod
    def straight(q):
        """A tool that the first joint moves along x, the second along y, and the third turns about z."""
        return np.array([q[0], q[1], 0.0]), Rotation.from_rotvec([0.0, 0.0, q[2]]).as_matrix()

    def test_distance_and_angle_are_those_of_the_nearest_place(self):
        x = np.linspace(0.0, 1.0, 11)
        path = ToolPath(self.straight, np.column_stack((x, 0.0 * x, 0.5 * x)))
        distance, angle = path.off(np.array([[0.33, 0.02, 0.165], [0.5, 0.0, 0.35], [1.1, 0.0, 0.5]]))
        assert distance == pytest.approx([0.02, 0.0, 0.1])
        assert angle == pytest.approx([0.0, 0.1, 0.0], abs=1e-12)
        assert path.length == pytest.approx(1.0)

    def test_a_circle_shrinks_joint_by_joint_as_the_impulses_average_it(self, ur5e, modal):
        told = circle(ur5e, modal)
        assert told["at_constant_speed_mm"]["joints"] == pytest.approx(told["predicted_mm"], rel=0.2)
        assert told["largest_distance_mm"]["along"] < 1e-3

    def test_a_corner_is_cut_joint_by_joint(self, ur5e, modal):
        found = corner(ur5e, modal)
        assert found.off[ALONG].max() < 1e-6
        assert found.off[JOINTS].max() > 5e-4
        inside = found.shaped[JOINTS][np.argmax(found.off[JOINTS])]
        assert np.linalg.norm(inside) > np.linalg.norm(found.path, axis=1).min()


@pytest.fixture(scope="module")
def judged(job):
    return list(compare([replace(job, place=place) for place in (0, 2)]))


class TestComparison:
    def test_shaping_reduces_the_vibration_and_joints_stay_within_the_references_limits(self, judged):
        for one in judged:
            ways = one.path["shaped"]["auto"]
            for found in ways.values():
                assert found["peak_m_s2"] < 0.2 * one.path["unshaped_peak_m_s2"]
                assert found["delay_ms"] > 0.0
            for way in (JOINTS, UNSLOWED):
                assert ways[way]["peak_velocity_ratio"] <= 1.0 + 1e-6
                assert ways[way]["peak_acceleration_ratio"] <= 1.01

    def test_the_report_has_what_was_measured_and_the_page_names_its_command(self, judged, ur5e, modal):
        told = {
            "command": "tvist study paths --random 2 --seed 5", "plant": "clean", "payload_kg": [0.0, 5.0],
            "calibration": "ur5e_modal", "circle": circle(ur5e, modal), **report(judged),
        }  # fmt: skip
        assert [row["kind"] for row in told["paths"]] == ["line", "blends"]
        every, lines = (told["summary"][kind] for kind in ("all", "line"))
        assert every["paths"] == 2
        assert title_of("line", lines).startswith("1 line, 1 of them")
        assert {len(row) for row in cells(rows(every), COLUMNS)} == {len(COLUMNS)}
        off = [path["shaped"]["auto"][JOINTS]["off_mm"] for path in told["paths"]]
        assert every["shapers"]["auto"][JOINTS]["off_mm"]["max"] == max(off)
        text = page_of(told, told["command"])
        assert "tvist study paths --random 2 --seed 5" in text
        assert "| auto | joint by joint |" in text
