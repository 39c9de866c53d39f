"""The arm in a world: what it touches pushes back as the scene says, and a gripper holds by friction."""

import os

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from msgspec.structs import replace

from tvist_plant.description import Payload, load
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import GRAVITY, Plant, PlantError
from tvist_plant.surroundings import Hand
from tvist_plant.world import apart, mujoco_arm
from tvist_plant.world.mujoco_arm import MujocoArm
from tvist_plant.world.scene import build
from tvist_plant.world.scene_file import SceneError, find_scene, scenes

from .arms import rested


def around(content):
    """A scene with this in its world."""
    return f"<mujoco><worldbody>{content}</worldbody></mujoco>"


EMPTY = around('<geom size="0.1" pos="3 3 3"/>')
DOWN = np.array([0.4, -1.8, -1.8, -1.1, 1.57, 0.0])
"""The tool of a UR5e points down."""


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    """Build scenes without a process for each; MuJoCo writes a log of its warnings where it is."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mujoco_arm, "build_apart", lambda asked: build(*asked))


@pytest.fixture
def _apart(_here, monkeypatch):
    """Build them as users do."""
    monkeypatch.setattr(mujoco_arm, "build_apart", apart.build_apart)


def world(tmp_path, text, arm="ur5e", payload=None, **sensors):
    """An arm in a scene, with sensors without noise and offset unless others are given."""
    description = load(arm)
    silent = {"force_noise": 0.0, "torque_noise": 0.0, "force_offset": 0.0, "torque_offset": 0.0}
    description = replace(
        description, sensors=replace(description.sensors, accelerometer_noise=0.0, **{**silent, **sensors})
    )
    file = tmp_path / "scene.xml"
    file.write_text(text)
    return MujocoArm(description, description.payload if payload is None else payload, find_scene(str(file)))


def still(q):
    return DriveCommand(np.array(q, dtype=float), np.zeros(len(q)), np.zeros(len(q)))


def moving(q, ticks):
    """A smooth motion of all joints and back."""
    time = np.arange(ticks) / ticks
    way = 0.2 * (1.0 - np.cos(2.0 * np.pi * time))
    speed = np.gradient(way, 0.002)
    return [
        DriveCommand(q + one, np.full(6, rate), np.zeros(6)) for one, rate in zip(way, speed, strict=True)
    ]


@pytest.mark.usefixtures("_apart")
def test_arm_in_an_empty_scene_moves_like_the_arm_alone(tmp_path, ur5e):
    silent = replace(ur5e, sensors=replace(ur5e.sensors, accelerometer_noise=0.0))
    arms = world(tmp_path, EMPTY), MujocoArm(silent, silent.payload)
    for arm in arms:
        arm.reset(still(DOWN))
    for command in moving(DOWN, 200):
        here, alone = (arm.step(command) for arm in arms)
        for name in ("q", "qd", "moment", "accelerometer"):
            np.testing.assert_allclose(getattr(here, name), getattr(alone, name), rtol=1e-9, atol=1e-9)


def test_flange_sensor_measures_weight_and_inertia_of_the_payload(tmp_path):
    payload = Payload(mass=2.0, com=(0.02, -0.01, 0.05), inertia=(1e-9, 0.0, 0.0, 1e-9, 0.0, 1e-9))
    arm = world(tmp_path, EMPTY, payload=payload)
    measured = arm.reset(still(DOWN))
    rotation = arm.truth().flange_rotation
    weight = rotation.T @ [0.0, 0.0, -2.0 * GRAVITY]
    np.testing.assert_allclose(measured.wrench[:3], weight, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(measured.wrench[3:], np.cross(payload.com, weight), rtol=0.0, atol=1e-6)
    at_origin = Payload(mass=2.0, inertia=(1e-9, 0.0, 0.0, 1e-9, 0.0, 1e-9))
    arm.load(at_origin)
    for command in moving(DOWN, 100):
        measured = arm.step(command)
        specific = arm.truth().specific_force
        np.testing.assert_allclose(measured.wrench[:3], -2.0 * specific, rtol=0.0, atol=1e-6)


def test_sensor_noise_and_offset_follow_the_file_and_the_seed(tmp_path):
    given = {"force_noise": 0.5, "torque_noise": 0.02, "force_offset": 4.0, "torque_offset": 0.3}
    arm, silent = world(tmp_path, EMPTY, **given), world(tmp_path, EMPTY)
    true = silent.reset(still(DOWN)).wrench
    rows = []
    for seed in (1, 1, 2):
        arm.reset(still(DOWN), seed=seed)
        rows.append(np.array([arm.step(still(DOWN)).wrench for _ in range(400)]) - true)
    np.testing.assert_array_equal(rows[0], rows[1])
    offset = rows[0].mean(axis=0)
    assert (np.abs(offset) <= [4.1] * 3 + [0.31] * 3).all()
    assert np.abs(offset - rows[2].mean(axis=0)).max() > 0.1
    np.testing.assert_allclose(rows[0].std(axis=0), [0.5] * 3 + [0.02] * 3, rtol=0.2)


@pytest.mark.parametrize(("stiffness", "loaded"), [(1e3, 5.0), (1e5, None), (1e5, 0.0)])
def test_contact_stiffness_does_not_depend_on_the_payload(tmp_path, stiffness, loaded):
    arm = world(tmp_path, EMPTY)
    arm.reset(still(DOWN))
    x, y, z = arm.truth().flange_position
    tool = '<body name="tool"><geom type="sphere" size="0.01" pos="0 0 0.1"/></body>'
    box = f'<geom type="box" size="0.2 0.2 0.1" pos="{x} {y} {z - 0.2105}" solref="-{stiffness} -50"/>'
    arm = world(tmp_path, around(tool + box))
    arm.reset(still(DOWN))
    if loaded is not None:  # at its centre, where that has no moment
        arm.load(Payload(mass=loaded, com=(0.0, 0.0, 0.05)))
    free = rested(arm, still(DOWN), 1).wrench
    q = DOWN - [0.0, 0.0, 0.006, 0.0, 0.0, 0.0]  # some millimetres down
    measured = rested(arm, still(q), 800)
    depth = 0.0005 - (arm.truth().flange_position[2] - z)
    force = arm.contact()
    assert force[2] > 1.0
    sphere = arm._world.model.geom("tool shape 0").id
    (touch,) = [one for one in arm._data.contact[: arm._data.ncon] if sphere in one.geom]
    assert force[2] == pytest.approx(-stiffness * touch.dist, rel=0.02), depth
    upward = arm.truth().flange_rotation @ (measured.wrench - free)[:3]
    assert upward[2] == pytest.approx(force[2], rel=0.02)


@pytest.mark.parametrize(("shape", "turned"), [
    ('euler="90 0 0" pos="0 0 0.1"', True), ('axisangle="1 0 0 90" pos="0 0 0.1"', True),
    ('xyaxes="1 0 0 0 0 1" pos="0 0 0.1"', True), ('zaxis="0 1 0" pos="0 0 0.1"', True),
    ('fromto="0 -0.05 0.1 0 0.05 0.1"', True), ('pos="0 0 0.1"', False),
])  # fmt: skip
def test_tool_has_the_pose_of_the_scene(tmp_path, shape, turned):
    """A capsule across the flange is as wide as it is long, in its own frame and in that of its body."""
    tool = f'<geom type="capsule" size="0.01 0.05" {shape}/>'
    for body in (f'<body name="tool">{tool}</body>', f'<body name="tool"><frame>{tool}</frame></body>'):
        arm = world(tmp_path, around(body))
        (found,) = arm.things().shapes
        assert found.size[:2] == pytest.approx((0.01, 0.05))
        assert found.pose[:3] == pytest.approx((0.0, 0.0, 0.1))
        axis = pin.exp3(np.array(found.pose[3:]))[:, 2]
        np.testing.assert_allclose(np.abs(axis), [0.0, 1.0, 0.0] if turned else [0.0, 0.0, 1.0], atol=1e-9)


@pytest.mark.parametrize(("tool", "surface", "touches"), [
    ("", "", True), ('contype="0" conaffinity="0"', "", False), ("", 'contype="2" conaffinity="2"', False),
    ('contype="2" conaffinity="0"', 'contype="0" conaffinity="2"', True),
    ('contype="4" conaffinity="4"', 'contype="2" conaffinity="2"', False),
])  # fmt: skip
def test_contact_masks_of_the_tool_are_respected(tmp_path, tool, surface, touches):
    tip = f'<body name="tool"><geom name="tip" size="0.02" {tool}/></body>'
    ground = f'<geom name="ground" type="plane" size="1 1 1" pos="0 0 -1" {surface}/>'
    model = world(tmp_path, around(tip + ground))._world.model
    both = zip(model.pair_geom1, model.pair_geom2, strict=True)
    pairs = {frozenset(model.geom(one).name for one in pair) for pair in both}
    assert (frozenset(("tip", "world/ground")) in pairs) == touches
    assert frozenset(("arm forearm", "world/ground")) in pairs


def test_obstacle_at_a_reset_is_predicted_without_side_effects(tmp_path, ur5e):
    clear, low = np.array([[-2.7, -1.8, -1.8, -1.1, 1.57, 0.0], [-2.7, -2.2, -1.8, -0.7, 1.57, 0.0]])
    for payload in (None, Payload(mass=5.0, com=(0.0, 0.0, 0.05))):
        asked, other = (MujocoArm(ur5e, ur5e.payload, find_scene("table")) for _ in range(2))
        for arm in (asked, other):
            arm.reset(still(clear))
            rested(arm, still(clear), 5)
        assert asked.obstacle(clear, payload) is None
        met = asked.obstacle(low, payload)
        assert met is not None
        assert "stands" in met
        assert "inside" in met
        after = [arm.step(still(clear)) for arm in (asked, other)]
        for name in ("q", "qd", "moment", "accelerometer", "wrench"):
            np.testing.assert_array_equal(*(getattr(measured, name) for measured in after))
        np.testing.assert_array_equal(asked.places(), other.places())


@pytest.mark.parametrize("off", [0.0, 1e-3])
def test_contact_of_a_pivoted_body_has_the_given_stiffness(tmp_path, off):
    """A beam is turned against a post with a constant force."""
    force, lever, k = 20.0, 0.12, 5e4
    text = around(
        f'<body name="beam" pos="2 2 2"><joint name="hinge" pos="{off} 0 0" damping="1"/>'
        '<geom type="box" size="0.2 0.01 0.01" mass="2"/></body>'
        f'<geom size="0.02" pos="{2 + off + lever} 2.03 2" solref="-{k} -100"/>'
    )
    arm = world(tmp_path, text)
    arm.reset(still(DOWN))
    model, data = arm._world.model, arm._data
    data.qfrc_applied[model.joint("world/hinge").dofadr[0]] = force * lever
    rested(arm, still(DOWN), 400)
    (touch,) = data.contact
    assert -touch.dist == pytest.approx(force / k, rel=0.01)


@pytest.mark.parametrize("phase", [0.0, 0.7])
def test_elastic_impact_has_the_peak_force_v_sqrt_k_m_and_gains_no_energy(tmp_path, phase, measured):
    """The one-joint arm without damping, friction and drives that yield, stretched out, against a wall."""
    k, v, reach, radius = 1e5, 0.2, 0.55, 0.04
    gap = 4e-4 + phase * v * 0.00025
    text = around(
        f'<body name="tool"><geom size="{radius}" pos="0 0 0.0125" friction="0 0 0"/></body>'
        f'<geom type="box" size="0.5 0.1 0.3" pos="0.97 {radius + gap + 0.1} 0.2" friction="0 0 0" solref="-{k} 0"/>'
    )
    arm = world(tmp_path, text, "one-joint")
    clean = arm._description.clean()
    description = replace(clean, drives=replace(clean.drives, gear_damping=(0.0, 0.0)))
    arm = MujocoArm(description, description.payload, find_scene(str(tmp_path / "scene.xml")))
    arm.reset(still([0.0, 0.0]))
    model, data = arm._world.model, arm._data
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data.qvel[0] = v / reach
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    peak = before = after = speed = 0.0
    while not after:
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        force, energy = np.linalg.norm(arm.contact()), data.energy.sum()
        if force:
            peak = max(peak, force)
        elif peak:
            after = energy
        else:
            before, speed = energy, data.qvel[0] * reach
    expected = speed * np.sqrt(k * inertia[0, 0] / reach**2)
    measured("peak over v sqrt(k m), share of energy gained", (peak / expected, after / before - 1.0))
    assert peak == pytest.approx(expected, rel=0.05)
    assert after / before - 1.0 < 1e-3


def test_fingers_hold_a_box_only_with_enough_force(tmp_path):
    hand = Hand(0.085, np.array([0.0, 0.0, 0.163]), np.eye(3))
    arm = world(tmp_path, EMPTY, payload=Payload(mass=0.9, com=(0.0, 0.0, 0.06)))
    arm.reset(still(DOWN))
    truth = arm.truth()
    x, y, z = truth.flange_position + truth.flange_rotation @ hand.position
    turn = np.degrees(np.arctan2(truth.flange_rotation[1, 1], truth.flange_rotation[0, 1]))
    shape = '<freejoint/><geom type="box" size="0.025 0.03 0.03" mass="0.5"/>'
    text = around(f'<body name="box" pos="{x} {y} {z}" euler="0 0 {turn}">{shape}</body>')
    for force, stays in ((60.0, True), (1.5, False)):
        arm = world(tmp_path, text, payload=Payload(mass=0.9, com=(0.0, 0.0, 0.06)))
        arm.mount(hand)
        arm.reset(still(DOWN))
        # The box is put between the fingers when they have closed on it, so that it need not fall until then.
        start = arm._data.qpos[-7:].copy()
        arm.grip(0.0, 60.0)
        for _ in range(150):
            arm._data.qpos[-7:], arm._data.qvel[-6:] = start, 0.0
            arm.step(still(DOWN))
        arm.grip(0.0, force)
        box = arm.things().bodies.index("box")
        first = arm.places()[box, :3]
        rested(arm, still(DOWN), 400)
        assert (np.linalg.norm(arm.places()[box, :3] - first) < 5e-4) == stays
        if stays:
            assert arm.opening() == pytest.approx(0.05, abs=0.002)
            assert np.linalg.norm(arm.contact()) == pytest.approx(0.5 * GRAVITY, rel=0.02)


@pytest.mark.usefixtures("_apart")
def test_equal_runs_are_equal_bit_for_bit_after_a_reset(tmp_path, ur5e):
    arm = MujocoArm(ur5e, ur5e.payload, find_scene("table"))
    assert arm.can(Plant.grip)
    runs = []
    for _ in range(2):
        arm.reset(still(DOWN), seed=3)
        at = arm.places()
        measured = [arm.step(command) for command in moving(DOWN, 60)]
        runs.append((at, [one.wrench for one in measured], [one.q for one in measured], arm.places()))
    for first, second in zip(*runs, strict=True):
        np.testing.assert_array_equal(first, second)


def test_push_moves_the_arm_and_nan_raises_until_a_reset(tmp_path):
    arm = world(tmp_path, EMPTY)
    rest = arm.reset(still(DOWN)).q
    arm.push(np.array([0.0, 50.0, 0.0, 0.0, 0.0, 0.0]))
    assert rested(arm, still(DOWN), 50).q[1] > rest[1] + 1e-4
    arm.make_nan()
    with pytest.raises(PlantError, match="finite"):
        arm.step(still(DOWN))
    np.testing.assert_array_equal(arm.reset(still(DOWN)).q, rest)


@pytest.mark.parametrize("name", scenes())
def test_scenes_stand_still_and_do_not_touch_the_arm(name, ur5e):
    arm = MujocoArm(ur5e, Payload(), find_scene(name))
    ursim = [-1.6, -1.727, -2.203, -0.808, 1.595, -0.031]
    arm.reset(still(ursim))
    begun = arm.places()
    rested(arm, still(ursim), 100)
    loose = [number for number, body in enumerate(arm.things().bodies) if body.startswith("box")]
    np.testing.assert_allclose(arm.places()[loose], begun[loose], rtol=0.0, atol=2e-4)
    assert np.linalg.norm(arm.contact()) == 0.0


BOX = '<body name="{0}" pos="-0.5 0 0.2"><freejoint/><geom type="box" size="{1} {1} {1}" mass="{2}"/></body>'
HEIGHTS = '<mujoco><asset><hfield name="h" nrow="{0}" ncol="{0}" size="1 1 1 1"/></asset></mujoco>'
FILES = "<asset>" + "".join(f'<mesh file="{number}.stl"/>' for number in range(20_001)) + "</asset>"
MANY = "".join(BOX.format(number, 0.1, 1) for number in range(51))
PEA, EVIL = BOX.format("pea", 0.005, 1e-4), BOX.format("&#x9b;2J" + 9999 * "a", 1, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hello", "scene.xml: it is not valid XML"),
        ("<robot/>", "begins with <robot>: must be a file in MuJoCo's format"),
        (around(f'<geom type="plane" size="1 1 1"/>{PEA}'), "pea of 0.0001 kg is too light .* the mass"),
        (around('<body name="tool"><joint/><geom size="0.1"/></body>'), "shapes only"),
        (around('<geom type="box" size="1 1 1"/>'), "stands .* mm inside"),
        (around(MANY), "51 of its bodies move, too many for real time: must be at most 50"),
        (around('<geom size="0.1" solref="-inf nan"/>'), "has a solref that is"),
        ('<mujoco><include file="pipe"/></mujoco>', "file .*pipe is a pipe, not a file"),
        ('<mujoco><compiler meshdir="/dev"/><asset><mesh file="null"/></asset></mujoco>', "null is a device"),
        ('<mujoco><asset><mesh file="large.stl"/></asset></mujoco>', "more than 256 MiB"),
        pytest.param(f"<mujoco>{FILES}</mujoco>", "it names too many files", id="many files"),
    ],
)
def test_invalid_scene_is_refused_in_one_line(tmp_path, text, said):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large.stl").open("wb") as large:
        large.truncate(1 << 29)
    check_refusal(tmp_path, text, said)


def check_refusal(tmp_path, text, said):
    with pytest.raises((SceneError, PlantError), match=said) as raised:
        world(tmp_path, text).reset(still(DOWN))
    assert str(raised.value).isprintable()
    assert len(str(raised.value)) < 1000


@pytest.mark.usefixtures("_apart")
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (around("<geom/>"), "scene.xml: .*size"),
        (HEIGHTS.format(65536), "MuJoCo ends with exit code -11: a scene may take 30 s and 768 MiB"),
        (HEIGHTS.format(20000), "MuJoCo fails: "),
        (around(EVIL + EVIL), "repeated name.*\ufffd2Ja"),
    ],
    ids=["without a size", "crash", "too large", "long name"],
)
def test_scene_that_mujoco_cannot_read_is_refused_in_one_line(tmp_path, text, said):
    check_refusal(tmp_path, text, said)


@pytest.mark.usefixtures("_apart")
def test_scene_that_takes_too_long_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "LONGEST", 1)
    with pytest.raises(SceneError, match="exit code -14: a scene may take 1 s"):
        world(tmp_path, around(45_000 * '<geom size="0.1" pos="3 3 3"/>'))


def test_missing_scene_lists_those_of_the_package():
    with pytest.raises(SceneError, match="must be one of pallet, peg, table, wall, or a file"):
        find_scene("nowhere")


def test_hash_of_a_scene_covers_all_files_that_it_names(tmp_path):
    (tmp_path / "meshes").mkdir()
    corners = "v 0 0 0\nv {0} 0 0\nv 0 {0} 0\nv 0 0 {0}\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    part = '<mujoco><worldbody><geom name="floor" size="0.{}" pos="3 3 3"/></worldbody></mujoco>'
    files = {
        "scene.xml": (
            '<mujoco><compiler meshdir="meshes"/><include file="part.xml"/><asset><mesh name="m" file="m.obj"/></asset>'
            '<worldbody><geom type="mesh" mesh="m" pos="3 0 3"/></worldbody></mujoco>'
        ),
        "part.xml": part.format(1),
        "meshes/m.obj": corners.format(1),
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    place = str(tmp_path / "scene.xml")
    found = {find_scene(place).sha256}
    world(tmp_path, files["scene.xml"])
    for name, text in (("part.xml", part.format(2)), ("meshes/m.obj", corners.format(2))):
        (tmp_path / name).write_text(text)
        found.add(find_scene(place).sha256)
    (tmp_path / "part.xml").unlink()
    found.add(find_scene(place).sha256)
    assert len(found) == 4
    with pytest.raises(ValueError, match=r"part\.xml"):
        world(tmp_path, files["scene.xml"])
