"""Addresses and ports of the interfaces, and configurations refused before a port opens."""

import re
from pathlib import Path

import pytest

from tvist_server.config import ServeConfig, from_mapping
from tvist_server.gateways.security import check_ur_address
from tvist_server.option_values import StartError
from tvist_server.ur_ports import WITHOUT_JOINTS, UrPorts

SEVEN = Path(__file__).parents[2] / "plant" / "urdf" / "seven.urdf"
EVERYWHERE = "0.0.0.0"  # noqa: S104  it is refused


def config(**values) -> ServeConfig:
    return from_mapping({"ur": True, **values}, "tvist.toml")


def test_ports_default_to_those_of_ur_and_can_be_changed_or_closed():
    assert config().interfaces(0) == ("127.0.0.1", UrPorts().open())
    _, ports = config(ur_ports={"rtde": 31004, "dashboard": 0}).interfaces(0)
    expected = UrPorts().open() | {"rtde": 31004}
    del expected["dashboard"]
    assert ports == expected


def test_each_further_robot_uses_the_next_address():
    addresses = [config(ur_address="127.0.0.254").interfaces(number)[0] for number in range(3)]
    assert addresses == ["127.0.0.254", "127.0.0.255", "127.0.1.0"]
    assert config(ur_address="::1").interfaces(0)[0] == "::1"


def test_interfaces_with_joint_values_refuse_an_arm_with_seven_joints():
    seven = {"robot": str(SEVEN), "calibration": "none"}
    with pytest.raises(StartError, match="the robot seven has 7 joints") as refused:
        config(**seven).setups()
    assert "without --ur" in str(refused.value)
    options = re.findall(r"--ur-port (\w+)=off", str(refused.value))
    assert config(**seven, ur_ports=dict.fromkeys(options, 0)).setups()[0].description.joints == 7
    assert set(UrPorts().open()) - set(options) == WITHOUT_JOINTS
    with pytest.raises(StartError, match="--ur-port rtde=off"):
        config(robots=f"ur5e,{SEVEN}", calibration="none").setups()
    assert from_mapping(seven, "tvist.toml").setups()[0].description.joints == 7


@pytest.mark.parametrize(
    ("values", "robot", "named"),
    [
        *(({"ur_address": address}, 0, f"ur_address is '{address}'") for address in ("robot", "127.0.0.300")),
        ({"ur_address": EVERYWHERE}, 1, "one address each"),
        ({"ur_ports": {"rtd": 30004}}, 0, "rtd"),
        *(({"ur_ports": {"rtde": port}}, 0, "rtde") for port in (70000, -1, "x")),
    ],
)
def test_an_invalid_address_or_port_is_refused(values, robot, named):
    with pytest.raises(StartError, match=named):
        config(**values).interfaces(robot)


def test_an_exposed_address_needs_insecure():
    check_ur_address("127.9.9.9", insecure=False)
    check_ur_address("::1", insecure=False)
    check_ur_address(EVERYWHERE, insecure=True)
    for address in (EVERYWHERE, "192.168.1.2", "::"):
        with pytest.raises(StartError, match="insecure"):
            check_ur_address(address, insecure=False)
