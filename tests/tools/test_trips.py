"""The tool that counts modules on the way: each trip goes where it should, and kernels count as one."""

import pytest
from tools.trips import COMPILED, TRIPS

WAY = {
    "set-point to state": (
        "dispatch/admission.py",
        "dispatch/setpoints.py",
        "line/cycle.py",
        "reporting/report.py",
    ),
    "empty tick": ("host.py", "line/cycle.py"),
    "RTDE package to servoj": ("programs/player.py", "trajectory/servo.py", "line/cycle.py"),
    "URScript movel to motion": (
        "programs/compiling.py",
        "planning/path_planner.py",
        "motion/running_move.py",
    ),
}


@pytest.mark.parametrize("name", TRIPS)
def test_a_trip_goes_through_the_rooms_in_order(name):
    trip = TRIPS[name]()
    modules = list(trip.modules)
    places = [modules.index(f"controller/tvist_controller/{file}") for file in WAY[name]]
    assert places == sorted(places)
    assert COMPILED in modules
    assert trip.calls >= len(trip.functions) >= len(modules) - 1
