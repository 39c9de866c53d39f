"""What the gateway puts on the wire, beside what ROS 2 puts there (see data/README.md) and beside rosbags."""

import json
import random
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from tests.examples import examples

from tvist_ros2.cdr import HEADER, LARGEST, CdrError, decode, encode
from tvist_ros2.messages import FEEDBACK, FIELDS, JAZZY_FEEDBACK, TYPES, ros
from tvist_ros2.names import Qos, Tokens, key

DATA = Path(__file__).with_name("data")
CAPTURED = [
    (name.rpartition("/")[2], bytes.fromhex(data))
    for name, data in json.loads((DATA / "cdr.json").read_text())
]
ACTION = "/scaled_joint_trajectory_controller/follow_joint_trajectory/_action"
NUMBERS = {
    "bool": bool, "int8": np.int8, "uint8": np.uint8, "uint16": np.uint16, "int32": np.int32, "uint32": np.uint32,
    "float64": np.float64,
}  # fmt: skip
STORE = get_typestore(Stores.ROS2_JAZZY)
IN_STORE = {name.rpartition("/")[2]: name for name in reversed(STORE.types) if "/msg/" in name}


def known_to_rosbags(name):
    """Return rosbags' name of a message; define the message if rosbags has none, as of services and actions."""
    if name not in IN_STORE:
        lines = []
        for kind, field in FIELDS[name]:
            inner, bracket, size = kind.partition("[")
            inner = inner if inner in {*NUMBERS, "string"} else known_to_rosbags(inner)
            lines.append(f"{inner}{bracket}{size} {field}")
        IN_STORE[name] = f"tvist/msg/{name.replace('_', '')}"
        STORE.register(get_types_from_msg("\n".join(lines), IN_STORE[name]))
    return IN_STORE[name]


def drawn(kind, rng):
    """Return a random value of a type for our codec, and the same for rosbags."""
    inner, bracket, size = kind.rstrip("]").partition("[")
    if bracket:
        pairs = [drawn(inner, rng) for _ in range(int(size) if size else rng.randint(0, 3))]
        ours, theirs = [one for one, _ in pairs], [other for _, other in pairs]
        if inner in NUMBERS:
            return bytes(ours) if inner == "uint8" else ours, np.array(theirs, dtype=NUMBERS[inner])
        return ours, theirs
    if inner == "string":
        text = "".join(rng.choices("ab_/ äΩ🤖", k=rng.randint(0, 6)))
        return text, text
    if inner in NUMBERS:
        limits = np.iinfo(NUMBERS[inner]) if inner not in {"bool", "float64"} else None
        value = (
            rng.randint(int(limits.min), int(limits.max)) if limits else rng.choice([0, 1, rng.gauss(0, 1e6)])
        )
        return (bool(value > 0),) * 2 if inner == "bool" else (value, value)
    name = known_to_rosbags(inner)
    pairs = {field: drawn(field_kind, rng) for field_kind, field in FIELDS[inner]}
    ours = getattr(ros, inner)(*(one for one, _ in pairs.values()))
    return ours, STORE.types[name](**{field: other for field, (_, other) in pairs.items()})


@given(name=st.sampled_from(sorted({name for name, _ in CAPTURED})), seed=st.integers(0, 2**32))
@examples(400)
def test_random_messages_are_those_of_rosbags_both_ways(name, seed):
    ours, theirs = drawn(name, random.Random(seed))
    data = encode(ours)
    assert data == bytes(STORE.serialize_cdr(theirs, known_to_rosbags(name)))
    again = STORE.deserialize_cdr(data, known_to_rosbags(name))
    assert encode(decode(type(ours), bytes(STORE.serialize_cdr(again, known_to_rosbags(name))))) == data


@pytest.mark.parametrize("name", sorted({name for name, _ in CAPTURED}))
def test_messages_are_those_that_rclpy_encoded(name):
    """Padding is not: rclpy leaves there what the memory held. It also appends bytes that nobody reads."""
    for data in [data for one, data in CAPTURED if one == name]:
        kind = getattr(ros, name)
        ours = encode(decode(kind, data))
        assert decode(kind, ours) == decode(kind, data)
        assert len(ours) <= len(data)
        different = [own for own, other in zip(ours, data, strict=False) if own != other]
        assert not any(different)


@given(st.data())
@examples(100)
def test_damaged_messages_are_refused(data):
    name, whole = data.draw(st.sampled_from(CAPTURED))
    damaged = bytearray(whole[: data.draw(st.integers(0, len(whole)))])
    for _ in range(data.draw(st.integers(0, 3))):
        if damaged:
            damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    with suppress(CdrError):
        decode(getattr(ros, name), bytes(damaged))


def test_length_beyond_the_message_costs_no_memory():
    with pytest.raises(CdrError, match="more than the message has"):
        decode(ros.String, HEADER + b"\xff\xff\xff\xff" + b"a")


def test_large_message_is_refused_before_it_is_decoded():
    with pytest.raises(CdrError, match=rf"must have at most {LARGEST}"):
        decode(ros.String, HEADER + bytes(LARGEST))


def test_hashes_are_those_of_rosidl_and_follow_from_the_definitions():
    for hashes in json.loads((DATA / "type_hashes.json").read_text()).values():
        for name, known in hashes.items():
            assert known == f"RIHS01_{TYPES[name].hash}"
    for of in (FEEDBACK, JAZZY_FEEDBACK):
        store = get_typestore(Stores.ROS2_JAZZY)
        feedback = of.name.replace("Message", "")
        inside = {field: kind for kind, field in FIELDS[of.request.__name__]}["feedback"]
        lines = [f"{_package(kind)}{kind} {field}" for kind, field in FIELDS[inside]]
        store.register(get_types_from_msg("\n".join(lines), feedback))
        store.register(
            get_types_from_msg(f"unique_identifier_msgs/UUID goal_id\n{feedback} feedback", of.name)
        )
        assert store.hash_rihs01(of.name) == f"RIHS01_{of.hash}"


def _package(kind):
    packages = {"Header": "std_msgs/", "JointTrajectoryPoint": "trajectory_msgs/"}
    return packages.get(kind, "trajectory_msgs/" if kind.startswith("Multi") else "")


def test_tokens_and_keys_are_those_of_rmw_zenoh():
    """But for the session's identifier and the entities' numbers."""
    captured = (DATA / "tokens.txt").read_text().split()
    session = captured[0].split("/")[2]
    tokens = Tokens(0, session, "", "tvist_ur5e")
    ours = [
        tokens.node(),
        tokens.entity("MP", "/joint_states", TYPES["sensor_msgs/msg/JointState"]),
        tokens.entity(
            "MP", "/imu_sensor_broadcaster/imu", TYPES["sensor_msgs/msg/Imu"], Qos(5, reliable=False)
        ),
        tokens.entity("MP", "/clock", TYPES["rosgraph_msgs/msg/Clock"], Qos(1, reliable=False)),
        tokens.entity("MP", "/robot_description", TYPES["std_msgs/msg/String"], Qos(1, latched=True)),
        tokens.entity("MS", "/forward_position_controller/commands", TYPES["std_msgs/msg/Float64MultiArray"]),
        tokens.entity("SS", "/dashboard_client/stop", TYPES["std_srvs/srv/Trigger"]),
        tokens.entity("SS", f"{ACTION}/cancel_goal", TYPES["action_msgs/srv/CancelGoal"]),
        tokens.entity("MP", f"{ACTION}/feedback", FEEDBACK),
        tokens.entity(
            "MP", f"{ACTION}/status", TYPES["action_msgs/msg/GoalStatusArray"], Qos(1, latched=True)
        ),
    ]
    for part in ("SendGoal", "GetResult"):
        name = {"SendGoal": "send_goal", "GetResult": "get_result"}[part]
        of = TYPES[f"control_msgs/action/FollowJointTrajectory_{part}"]
        ours.append(tokens.entity("SS", f"{ACTION}/{name}", of))

    def unnumbered(token):
        return token.split("/")[:4] + token.split("/")[5:]

    assert all(unnumbered(token) in [unnumbered(one) for one in captured] for token in ours)
    assert len({token.split("/")[4] for token in ours}) == len(ours)
    within = Tokens(7, session, "/left/arm", "tvist_ur5e")
    assert within.node() == f"@ros2_lv/7/{session}/0/0/NN/%/%left%arm/tvist_ur5e"
    assert key(7, "/left/joint_states", JAZZY_FEEDBACK).startswith(
        "7/left/joint_states/control_msgs::action::dds_::"
    )
