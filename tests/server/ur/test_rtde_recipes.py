"""RTDE variables: names, types, values and packages."""

import struct
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.controller.robots import UR5E, cut
from tests.examples import examples

from tvist_server.gateways.ur.rtde.package_encoder import PackageEncoder
from tvist_server.gateways.ur.rtde.recipes import InputRecipe, OutputRecipe, split
from tvist_server.gateways.ur.rtde.table import page
from tvist_server.gateways.ur.rtde.variables import INPUTS, OUTPUTS, PARTS
from tvist_server.rtde.wire import WireType

from . import rtde_client as client

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "generated" / "rtde-variables.md"
names_of_outputs = st.lists(st.sampled_from(sorted(client.OUTPUT_TYPES)), min_size=1, max_size=60)
NUMBERS = {
    "BOOL": st.booleans(),
    "UINT8": st.integers(0, 255),
    "UINT32": st.integers(0, 2**32 - 1),
    "INT32": st.integers(-(2**31), 2**31 - 1),
    "DOUBLE": st.floats(allow_nan=False),
    "VECTOR6D": st.tuples(*[st.floats(allow_nan=False)] * 6),
}

BANKS = {
    f"{side}_{kind}_register": NUMBERS[word]
    for side in ("input", "output")
    for kind, word in (("bit", "UINT32"), ("int", "INT32"), ("double", "DOUBLE"))
}


def alone(names, snapshot, head=b"\x01"):
    """Return the package for a client that is alone."""
    board, recipe = PackageEncoder(), OutputRecipe(tuple(names))
    board.begin("client", recipe)
    return board.package(recipe, snapshot, head)


@pytest.fixture(scope="module")
def ur5e_at_rest(ur5e):
    return ur5e()


@st.composite
def sent_inputs(draw):
    """Names of a recipe without repetition, and a value for each."""
    names = draw(st.lists(st.sampled_from(sorted(client.INPUT_TYPES)), min_size=1, max_size=40, unique=True))
    return names, [draw(NUMBERS[client.INPUT_TYPES[name]]) for name in names]


def test_variables_have_their_published_types():
    assert {name: wire.name for name, wire in OUTPUTS.items()} == client.OUTPUT_TYPES | client.OWN
    assert {name: wire.name for name, wire in INPUTS.items()} == client.INPUT_TYPES
    for wire in WireType:
        word = client.WORD[wire.name]
        assert (wire.size, wire.length) == (struct.calcsize(">" + word), len(word))


@examples(40)
@given(names_of_outputs)
@example(names=sorted(client.OUTPUT_TYPES))
def test_a_package_has_the_values_of_the_snapshot(snapshots, names):
    """The example has all variables, whose names exceed UR's documented 2048 bytes."""
    snapshot = snapshots[17]
    recipe = OutputRecipe(tuple(names))
    assert recipe.valid
    assert recipe.words == [client.OUTPUT_TYPES[name] for name in names]
    found = client.decoded(alone(names, snapshot), names)
    for name, value in found.items():
        assert value == getattr(snapshot, name), name
    assert client.decoded(alone(names, snapshot, b""), names, version=1) == found


@examples(40)
@given(st.lists(st.tuples(st.integers(0, 3), st.none() | names_of_outputs), min_size=1, max_size=12))
def test_recipes_of_other_clients_change_nothing(snapshots, changes):
    board, recipes = PackageEncoder(), {}
    for snapshot, (number, names) in zip(snapshots, changes, strict=False):
        if names is None:
            board.end(number)
            recipes.pop(number, None)
        else:
            recipes[number] = OutputRecipe(tuple(names))
            board.begin(number, recipes[number])
        for recipe in recipes.values():
            assert board.package(recipe, snapshot, b"\x01") == alone(recipe.names, snapshot)


def test_a_failing_variable_affects_only_its_readers(ur5e, monkeypatch):
    robot, board = ur5e(), PackageEncoder()
    sound, faulty = OutputRecipe(("actual_q", "timestamp")), OutputRecipe(("actual_momentum",))
    board.begin("one", sound)
    board.package(sound, robot.tick(), b"\x01")
    board.begin("other", faulty)
    monkeypatch.setattr(type(robot.instruments._rigid), "momentum", lambda *_: 1 / 0)
    for _ in range(2):
        now = robot.tick()
        assert board.package(sound, now, b"\x01") == alone(sound.names, now)
        with pytest.raises(ZeroDivisionError):
            board.package(faulty, now, b"\x01")
    board.end("other")
    now = robot.tick()
    assert board.package(sound, now, b"\x01") == alone(sound.names, now)


def test_values_cached_by_io_depend_only_on_io(snapshots):
    early, late = snapshots[3], snapshots[90]
    assert early.io is late.io
    for name, (part, _) in PARTS.items():
        assert not part.of_io or part.read(early) == part.read(late), name


@examples(40)
@given(st.lists(st.dictionaries(st.sampled_from(sorted(BANKS)), st.integers(0, 47)), max_size=6), st.data())
def test_registers_are_those_of_the_tick(ur5e_at_rest, changes, data):
    robot, registers = ur5e_at_rest, [name for name in client.OUTPUT_TYPES if "_register" in name]
    names = data.draw(st.lists(st.sampled_from(registers), min_size=1, max_size=20))
    present = {name: getattr(robot.io, name) for name in robot.io.__struct_fields__}
    for change in changes:
        for bank, place in change.items():
            values = list(present[bank])
            values[place % len(values)] = data.draw(BANKS[bank])
            present[bank] = values
        robot.io = type(robot.io)(**present)
        snapshot = robot.tick()
        found = client.decoded(alone(names, snapshot), names)
        assert found == {name: getattr(snapshot, name) for name in names}


@pytest.mark.parametrize("joints", [1, 6])
def test_vectors_have_six_entries_for_any_number_of_joints(ur5e, joints):
    arm = UR5E if joints == 6 else cut(joints)
    snapshot = ur5e(arm, q=arm.poses["Q3"]).tick()
    names = ["joint_mode", "actual_q", "elbow_position", "timestamp"]
    found = client.decoded(alone(names, snapshot), names)
    assert found["actual_q"] == (snapshot.actual_q + [0.0] * 6)[:6]
    assert found["joint_mode"] == ([253] * joints + [0] * 6)[:6]
    assert (found["elbow_position"], found["timestamp"]) == (snapshot.elbow_position, snapshot.timestamp)


def test_a_recipe_beyond_the_largest_package_is_not_valid():
    assert OutputRecipe(("actual_q",) * 1365).valid
    assert not OutputRecipe(("actual_q",) * 1366).valid


@examples(40)
@given(sent_inputs(), st.integers(0, 400), st.binary(max_size=60))
def test_inputs_are_decoded_as_far_as_the_package_goes(sent, kept, extra):
    names, values = sent
    ((_, payload),) = client.packages(client.data(1, names, values))
    recipe = InputRecipe(tuple(names))
    assert recipe.values(payload[1:]) == dict(zip(names, values, strict=True))
    assert recipe.values(payload[1:] + extra) == recipe.values(payload[1:])
    left, whole = kept, {}
    for name, value in zip(names, values, strict=True):
        left -= struct.calcsize(">" + client.WORD[client.INPUT_TYPES[name]])
        if left < 0:
            break
        whole[name] = value
    assert recipe.values(payload[1 : 1 + kept]) == whole


@examples(40)
@given(st.lists(st.text(st.characters(codec="ascii", exclude_characters=","), min_size=1), max_size=20))
def test_names_are_split_at_commas(names):
    text = ",".join(names).encode()
    assert split(text) == tuple(name.strip() for name in names)
    if names:
        assert split(text + b",") == split(text)


def test_the_reference_page_of_variables_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page(), (
        f"python -m tvist_server.gateways.ur.rtde.table > {PAGE}"
    )
