"""The action for users' CI: its script runs here as a runner would run it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
ACTION = ROOT / "action"
PATIENCE = 600.0
TESTS = """
def test_passes(tvist_robot):
    assert tvist_robot.state().tick == 0

def test_fails(tvist_robot):
    assert tvist_robot.advance(5) == 6
"""

pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")


@pytest.fixture
def run(tmp_path):
    """Run a step in a folder of its own, without this process's environment."""

    def step(*arguments, python=sys.executable):
        kept = {name: os.environ[name] for name in ("PATH", "HOME", "LANG") if name in os.environ}
        pip = {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "UV_"))}
        given = {"PYTHON": python, "RUNNER_TEMP": str(tmp_path), "GITHUB_OUTPUT": str(tmp_path / "output")}
        command = ["bash", ACTION / "run.sh", *arguments]
        how = {"capture_output": True, "text": True, "timeout": PATIENCE}
        return subprocess.run(command, check=False, env={**kept, **pip, **given}, cwd=tmp_path, **how)

    return step


def outputs(folder):
    return dict(line.split("=", 1) for line in (folder / "output").read_text().splitlines())


def test_every_step_of_the_action_calls_its_script():
    action = yaml.safe_load((ACTION / "action.yml").read_text())
    called = [re.search(r"run\.sh\" (\w+)", step["run"])[1] for step in action["runs"]["steps"]]
    assert called == ["install", "serve", "test", "programs"]
    assert all(step["shell"] == "bash" for step in action["runs"]["steps"])
    known = {f"inputs.{name}" for name in action["inputs"]}
    used = set(re.findall(r"inputs\.\w+", (ACTION / "action.yml").read_text()))
    assert used == known


def test_test_step_runs_pytest_and_outputs_its_folder_of_recordings(run, tmp_path):
    ran = run("test", "test_it.py", "-q", python="echo")
    recordings = outputs(tmp_path)["recordings"]
    assert recordings == str(tmp_path / "tvist-recordings")
    assert ran.stdout.split() == ["-m", "pytest", "--tvist-recordings", recordings, "test_it.py", "-q"]


def test_invalid_step_is_refused_in_one_line(run):
    for arguments, said in (
        ((), "the first argument is missing: must be install, serve, test, programs or stop"),
        (("fly",), "the first argument is fly: must be install, serve, test, programs or stop"),
        (("install",), "install takes one argument: a checkout, a folder with wheels, or a requirement"),
        (("install", "/etc"), "/etc is neither a checkout of tvist nor a folder with wheels"),
        (("stop",), "no robot is served"),
    ):
        ran = run(*arguments)
        assert (ran.returncode, ran.stderr) == (1, f"tvist action: {said}\n")


def test_programs_step_runs_programs_and_outputs_results(run, tmp_path):
    for name, error in (("good", ""), ("bad", "  y = 1 / 0\n")):
        text = f"def {name}():\n  sleep(0.1)\n{error}end\n"
        (tmp_path / f"{name}.script").write_text(text, encoding="utf-8")
    ran = run("programs", "good.script", "bad.script", "--max-shake", "0.3")
    assert (ran.returncode, "1 of 2 programs failed: bad.script" in ran.stderr) == (1, True), ran.stderr
    assert 'tests="2" failures="1"' in Path(outputs(tmp_path)["junit"]).read_text(encoding="utf-8")


@pytest.mark.nightly
def test_action_installs_serves_and_tests_in_a_clean_environment(run, tmp_path):
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "clean"], check=True)
    python = tmp_path / "clean" / "bin" / "python"
    installed = run("install", ROOT, python=python)
    assert installed.returncode == 0, installed.stderr
    for package in ("scipy", "matplotlib", "mujoco"):
        looked = subprocess.run([python, "-c", f"import {package}"], capture_output=True, check=False)
        assert looked.returncode == 1
    refused = run("serve", "--payload", "500", python=python)
    assert (refused.returncode, "payload is 500" in refused.stderr) == (1, True)
    served = run("serve", "--clock", "lockstep", python=python)
    assert served.returncode == 0, served.stderr
    assert outputs(tmp_path)["endpoint"] == "tcp/127.0.0.1:7447"
    assert run("stop", python=python).returncode == 0
    (tmp_path / "test_it.py").write_text(TESTS)
    ran = run("test", "test_it.py", "-q", python=python)
    assert (ran.returncode, "1 failed, 1 passed" in ran.stdout) == (1, True), ran.stdout + ran.stderr
    recordings = Path(outputs(tmp_path)["recordings"])
    assert [path.name for path in recordings.rglob("*.mcap")] == ["ur5e.mcap"]
