"""Calls of other projects' Python clients, each unmodified in an environment of its own:

    pytest tests/acceptance/clients.py

needs a package registry, and a machine that has nothing else to do. calls/NAME.txt has the calls of a client.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from tests.acceptance import report
from tests.conformance.served import Served
from tests.places import own_address

pytestmark = [pytest.mark.acceptance, pytest.mark.timeout(1800)]
CALLS = Path(__file__).parent / "calls"
TORQUE = "needs a controller of version 5.23, and this one reports 5.22"
KNOWN = {
    "getForwardKinematics": "without a tool the client sends none, so that old register values are used",
    "setExternalForceTorque": "the client sends four bytes too few",
    **dict.fromkeys(("getMassMatrix", "getJacobian", "getJacobianTimeDerivative", "directTorque",
                     "getCoriolisAndCentrifugalTorques", "getTargetJointAccelerations"), TORQUE),
}  # fmt: skip
CLIENTS = {
    "ur_rtde": (["ur-rtde==1.6.5"], ["--world", "table"], KNOWN),
    "urkit": (["urkit==0.6.0"], ["--cell", str(CALLS / "cell.toml")], {}),
    "airo_robots": (["airo-robots==2026.10.1", "ur-rtde==1.6.5"], ["--cell", str(CALLS / "cell.toml")], {}),
    "universal_robots_clients": (["universal-robots-clients==0.4.0", "ur-rtde==1.6.5"], [], {}),
}
"""What is installed, options of `tvist serve`, and calls that are known not to work, with the reason."""


@pytest.mark.parametrize("name", CLIENTS)
def test_the_calls_of_a_client_work_but_those_that_are_known_not_to(name, tmp_path, monkeypatch):
    packages, options, known = CLIENTS[name]
    python = Path(tempfile.gettempdir()) / "tvist-acceptance" / name / "bin/python"
    subprocess.run([sys.executable, "-m", "venv", python.parents[1]], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *packages], check=True)
    monkeypatch.chdir(tmp_path)
    address = own_address(7)
    with Served("--ur", "--ur-address", address, *options):
        command = [python, CALLS / "run.py", CALLS / f"{name}.txt", address]
        said = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False).stdout
    outcomes = dict(line.split("\t") for line in said.splitlines())
    report.note(name, ", ".join(packages), outcomes, known)
    assert {call for call, came in outcomes.items() if came != report.PASSED} == set(known)
