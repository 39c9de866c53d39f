"""Where the interfaces are: addresses, ports, and what is refused before anything is opened."""

import re
from pathlib import Path

import pytest

from tvist_server.config import ServeConfig, from_mapping
from tvist_server.gateways.exposure import guarded_interfaces
from tvist_server.option_values import StartError
from tvist_server.ur_ports import WITHOUT_JOINTS, UrPorts

SEVEN = Path(__file__).parents[2] / "plant" / "urdf" / "seven.urdf"
EVERYWHERE = "0.0.0.0"  # noqa: S104  it is refused


def config(**values) -> ServeConfig:
    return from_mapping({"ur": True, **values}, "tvist.toml")


def test_they_are_where_ur_has_them():
    assert config().interfaces(0) == ("127.0.0.1", UrPorts().open())


def test_one_can_be_moved_and_another_kept_shut():
    _, ports = config(ur_ports={"rtde": 31004, "dashboard": 0}).interfaces(0)
    assert ports == {
        **{interface: port for interface, port in UrPorts().open().items() if interface != "dashboard"},
        "rtde": 31004,
    }


def test_of_several_robots_each_has_the_next_address():
    addresses = [config(ur_address="127.0.0.254").interfaces(number)[0] for number in range(3)]
    assert addresses == ["127.0.0.254", "127.0.0.255", "127.0.1.0"]
    assert config(ur_address="::1").interfaces(0)[0] == "::1"


@pytest.mark.parametrize(
    ("values", "named"),
    [({"ur_address": "robot"}, "ur_address is 'robot'"), ({"ur_address": "127.0.0.300"}, "ur_address")],
)
def test_an_address_that_is_none_is_named(values, named):
    with pytest.raises(StartError, match=named):
        config(**values).interfaces(0)


def test_an_arm_with_seven_joints_is_refused_since_the_last_would_be_missing():
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


def test_everywhere_is_no_address_for_several():
    with pytest.raises(StartError, match="one address each"):
        config(ur_address=EVERYWHERE).interfaces(1)


@pytest.mark.parametrize(
    ("ports", "named"),
    [({"rtd": 30004}, "rtd"), ({"rtde": 70000}, "rtde"), ({"rtde": -1}, "rtde"), ({"rtde": "x"}, "rtde")],
)
def test_a_port_or_door_that_is_none_is_named(ports, named):
    with pytest.raises(StartError, match=named):
        config(ur_ports=ports)


def test_nobody_else_reaches_them_unasked():
    guarded_interfaces("127.9.9.9", insecure=False)
    guarded_interfaces("::1", insecure=False)
    guarded_interfaces(EVERYWHERE, insecure=True)
    for address in (EVERYWHERE, "192.168.1.2", "::"):
        with pytest.raises(StartError, match="insecure"):
            guarded_interfaces(address, insecure=False)
