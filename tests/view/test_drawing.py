"""The arm that the page draws in a browser, compared with pinocchio and the simulated arm's truth."""

import struct
from urllib.parse import urlsplit

import numpy as np
import pinocchio as pin
import pytest
from msgspec.structs import replace
from tests.conformance.served import PATIENCE

from tvist_controller.about import geometry_of
from tvist_plant.description import load
from tvist_plant.model import FLANGE, rigid_model
from tvist_protocol.geometry import Capsule, Geometry, Mesh, World
from tvist_view.look import GeometryError, Look
from tvist_view.playback import playback
from tvist_view.stage import page
from tvist_view.track import Track

SEVEN = "tests/plant/urdf/seven.urdf"
ARMS = ("ur5e", SEVEN, "one-joint")
"""Arms of the page; the first one moves."""
UR5E = load("ur5e")
BODY = Capsule(name="x", link=5, start=(0, 0, 0), end=(0, 0, 1), radius=0.1)


def look_of(name):
    description = load(name)
    return Look(geometry_of(description), description.payload)


def standing(moved, look):
    """Return three states of an arm at rest that has as many joints as the look."""
    zeros = [0.0] * look.joints
    return [replace(state, actual_q=zeros, reference_q=zeros, target_qdd=zeros) for state in moved.states[:3]]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"version": 2}, "version 2"),
        ({"a": [0.1]}, "1 a, 2 d and 2 alpha"),
        ({"a": [], "d": [], "alpha": []}, "no joints"),
        ({"bending": [2]}, "link 2: must be 0 to 1"),
        ({"capsules": [BODY]}, "link 5: must be -1 to 1"),
    ],
)
def test_geometry_that_cannot_be_drawn_is_refused(changes, says):
    with pytest.raises(GeometryError, match=says):
        Look(Geometry(**{"a": [0.1, 0.2], "d": [0.0, 0.0], "alpha": [0.0, 0.0], **changes}), UR5E.payload)


def test_deflections_of_another_arm_are_refused(moved):
    look = look_of("one-joint")
    with pytest.raises(GeometryError, match="6 deflections where the robot's geometry has 2"):
        look.row(moved.states[0], moved.truths[0])


def test_arm_without_truth_is_stiff_and_old_truth_has_no_static_part(moved):
    look, state, truth = look_of("ur5e"), moved.states[100], moved.truths[100]
    assert look.row(state, None) == [*state.actual_q, *state.reference_q, *[0.0] * 20]
    old = look.row(state, replace(truth, static_gear_deflection=[], static_link_deflection=[]))
    assert old[12:18] == [0.0] * 6
    assert old[18:24] == truth.gear_deflection


def test_bodies_of_a_world_are_nan_while_unknown(moved):
    look, state, truth = look_of("ur5e"), moved.states[100], moved.truths[100]
    there = Look(replace(look.geometry, world=World(name="table", bodies=["box"], shapes=[])), look.payload)
    pose = [-0.4, 0.1, 0.2, 0.0, 0.0, 0.3]
    assert there.row(state, replace(truth, body_poses=pose)) == [*look.row(state, truth), *pose]
    for row in (there.row(state, None), there.row(state, truth)):
        assert len(row) == len(look.row(state, truth)) + 6
        assert np.isnan(row[-6:]).all()


def undrawn(chromium):
    """Return a small page that draws only when a test asks for it: drawing takes a processor."""
    page = chromium.new_page(viewport={"width": 200, "height": 200})
    page.set_default_timeout(PATIENCE * 1000.0)
    page.add_init_script("requestAnimationFrame = () => 0")
    return page


@pytest.fixture(scope="module")
def tab(chromium, moved, tmp_path_factory):
    """A page with all arms at the start of their motions."""
    first, *others = map(look_of, ARMS)
    tracks = [Track("moves", first, moved.states, moved.truths)]
    tracks += [Track("rests", look, standing(moved, look), []) for look in others]
    file = tmp_path_factory.mktemp("pages") / "arms.html"
    file.write_text(playback(tracks, "test", factor=100.0), encoding="utf-8")
    tab, failed = undrawn(chromium), []
    tab.on("pageerror", lambda error: failed.append(str(error)))
    tab.goto(file.as_uri())
    tab.evaluate("tvist.draw(0)")
    assert not failed
    return tab


def flanges(tab, angles, bends, track=0):
    """Return poses of the flange as the page computes them, shape (count, 4, 4)."""
    found = tab.evaluate(
        "([all, bends, track]) => { const { chain } = tvist.tracks[track].robot.arm;"
        " return all.map((q, i) => chain.frames(q, bends[i]).at(-1).elements); }",
        [angles.tolist(), bends.tolist(), track],
    )
    return np.array(found).reshape(-1, 4, 4).transpose(0, 2, 1)


def test_drawn_flange_of_seven_joints_matches_pinocchio(tab):
    """The next test compares the flange of the moving arm with its true pose."""
    description = load(SEVEN)
    model = rigid_model(description, description.payload)
    data, q = model.createData(), np.random.default_rng(0).uniform(-3.0, 3.0, (50, 7))
    for found, angles in zip(flanges(tab, q, np.zeros((50, 0)), 1), q, strict=True):
        pin.framesForwardKinematics(model, data, angles)
        np.testing.assert_allclose(found, data.oMf[model.getFrameId(FLANGE)].homogeneous, atol=1e-9)


def test_drawn_deflections_are_the_true_ones_times_the_factor(tab, moved):
    look = look_of("ur5e")
    truths = moved.truths[::100]
    rows = [look.row(moved.states[truth.tick - moved.states[0].tick], truth) for truth in truths]
    drawn = tab.evaluate(
        "([rows, looks]) => { const { drawn } = tvist.tracks[0].robot.constructor;"
        " return looks.map((look) => rows.map((row) => drawn(row, 6, 4, look))); }",
        [rows, [{"factor": k, "gravity": g} for k, g in ((1, False), (1, True), (100, False), (7.5, True))]],
    )
    for one in drawn[0], drawn[1]:
        q, bends = (np.array([entry[name] for entry in one]) for name in ("q", "bends"))
        for found, truth in zip(flanges(tab, q, bends), truths, strict=True):
            np.testing.assert_allclose(found[:3, 3], truth.flange_pose[:3], atol=1e-8)
            np.testing.assert_allclose(found[:3, :3], pin.exp3(np.array(truth.flange_pose[3:])), atol=1e-8)
    for entry, truth in zip(drawn[2], truths, strict=True):
        static = np.array(truth.static_gear_deflection)
        expected = static + 100.0 * (np.array(truth.gear_deflection) - static)
        np.testing.assert_allclose(np.array(entry["q"]) - truth.motor_q, expected, atol=1e-9)
    for entry, truth in zip(drawn[3], truths, strict=True):
        np.testing.assert_allclose(entry["bends"], 7.5 * np.array(truth.link_deflection), atol=1e-9)


def test_page_interpolates_between_two_rows(tab, moved):
    look = look_of("ur5e")
    for time in (0.0, 0.5, 0.504, 1e3):
        row = tab.evaluate("(time) => Array.from(tvist.tracks[0].row(time))", time)
        at = min(round(time / 0.002), len(moved.states) - 1)
        np.testing.assert_allclose(row, look.row(moved.states[at], moved.truths[at]), atol=5e-4)


@pytest.mark.parametrize("name", ARMS)
def test_every_arm_is_connected(tab, name):
    look = look_of(name)
    found = tab.evaluate(
        "(track) => { const { at, robot: { arm } } = tvist.tracks[track];"
        " const points = arm.outline().map((p) => p.toArray().map((value, k) => value - at[k]));"
        " return { points, parts: arm.frames.map((f) => f.children.length) }; }",
        ARMS.index(name),
    )
    points = np.array(found["points"])
    assert np.isfinite(points).all()
    assert np.linalg.norm(points, axis=1).max() < 1.8 * look.reach + 0.3
    assert points[:, 2].min() > -0.8 * look.reach
    assert sum(found["parts"]) >= 2 * look.joints


def test_arms_fill_the_picture(tab):
    """Two by themselves, and all together."""
    for shown in ([0], [1], [0, 1, 2]):
        seen = tab.evaluate(
            "(shown) => { const { scene } = tvist.stage;"
            " tvist.tracks.forEach(({ robot }, k) => (robot.arm.root.visible = shown.includes(k)));"
            " const arms = tvist.tracks.filter((_, k) => shown.includes(k)).map(({ robot }) => robot.arm);"
            " scene.keep(arms.flatMap((arm) => arm.outline()));"
            " scene.invalidate(); scene.draw(); return scene.filled(); }",
            shown,
        )
        assert max(np.diff(seen["x"])[0], np.diff(seen["y"])[0]) > 2 * 0.6
        assert all(-1.05 < edge < 1.05 for key in "xy" for edge in seen[key])


def test_meshes_of_a_urdf_replace_the_drawn_links(chromium, moved):
    corners = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0.3)]
    facet = struct.pack("<12fH", *(0, 0, 1), *(value for corner in corners for value in corner), 0)
    stl, placement = bytes(80) + struct.pack("<I", 1) + facet, (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    meshes = [Mesh(link=link, file="part.stl", placement=placement) for link in (-1, 2)]
    look = look_of("ur5e")
    look = Look(replace(look.geometry, meshes=meshes), look.payload)
    packed = Track("x", look, standing(moved, look), []).packed(0.0)
    packed["look"]["meshes"] = ["/mesh/0.stl", "/mesh/1.stl"]
    files = dict.fromkeys(packed["look"]["meshes"], stl)
    files["/"] = page({"kind": "playback", "title": "x", "factor": 1, "tracks": [packed]})
    tab = undrawn(chromium)
    tab.route("**/*", lambda route: route.fulfill(body=files[urlsplit(route.request.url).path]))
    tab.goto("http://tvist.test/")
    drawn = "tvist.tracks[0].robot.arm.frames.flatMap((f) => f.children)"
    tab.wait_for_function(f"tvist.tracks && {drawn}.filter((c) => c.userData.mesh).length === 2", polling=20)
    others = tab.evaluate(f"{drawn}.filter((c) => !c.userData.mesh).length")
    tab.close()
    assert others == 1  # the payload stays
