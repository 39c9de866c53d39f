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


def test_they_are_where_ur_has_them_but_one_can_be_moved_and_another_kept_shut():
    assert config().interfaces(0) == ("127.0.0.1", UrPorts().open())
    _, ports = config(ur_ports={"rtde": 31004, "dashboard": 0}).interfaces(0)
    expected = UrPorts().open() | {"rtde": 31004}
    del expected["dashboard"]
    assert ports == expected


def test_of_several_robots_each_has_the_next_address():
    addresses = [config(ur_address="127.0.0.254").interfaces(number)[0] for number in range(3)]
    assert addresses == ["127.0.0.254", "127.0.0.255", "127.0.1.0"]
    assert config(ur_address="::1").interfaces(0)[0] == "::1"


@pytest.mark.parametrize("address", ["robot", "127.0.0.300"])
def test_an_address_that_is_none_is_named(address):
    with pytest.raises(StartError, match=f"ur_address is '{address}'"):
        config(ur_address=address).interfaces(0)


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


def test_everywhere_is_no_address_for_several_and_what_is_no_port_or_door_is_named():
    with pytest.raises(StartError, match="one address each"):
        config(ur_address=EVERYWHERE).interfaces(1)
    for ports in ({"rtd": 30004}, {"rtde": 70000}, {"rtde": -1}, {"rtde": "x"}):
        with pytest.raises(StartError, match=next(iter(ports))):
            config(ur_ports=ports)


def test_nobody_else_reaches_them_unasked():
    guarded_interfaces("127.9.9.9", insecure=False)
    guarded_interfaces("::1", insecure=False)
    guarded_interfaces(EVERYWHERE, insecure=True)
    for address in (EVERYWHERE, "192.168.1.2", "::"):
        with pytest.raises(StartError, match="insecure"):
            guarded_interfaces(address, insecure=False)
