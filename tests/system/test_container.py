"""The image of docker/: its size, rights, start, end and recordings."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests.conformance.served import free_endpoint
from tests.conformance.wire import Q1, TICK, Wire
from tests.system.containers import ROOT, Contained, Engine, install

from tvist_client.check import check
from tvist_lab.recordings.mcap_file import read

pytestmark = [pytest.mark.nightly, pytest.mark.timeout(1500)]

MB = 1_000_000
NEVER_NEEDED = ("*.a", "*.h", "*.hpp", "*.stl", "*.dae", "*.obj", "tests", "include")
FOREIGN_MACHINE = """
import sys
import llvmlite.binding as llvm
llvm.get_host_cpu_name = lambda: "znver9"
llvm.get_host_cpu_features = lambda: llvm.FeatureMap(sse2=True)
from tvist_cli.main import main
sys.argv[0] = "tvist"
main()
"""
"""tvist on a processor that seems to have another name."""
SERVE = ("serve", "--listen", "tcp/0.0.0.0:7447", "--insecure")


@pytest.fixture(scope="module")
def engine(tmp_path_factory):
    """Podman, and the image `tvist` in it."""
    engine = Engine(tmp_path_factory.mktemp("containers"))
    try:
        engine.base("base")
        engine.build("localhost/base", "tvist")
        engine("network", "create", "tests")
        yield engine
    finally:
        engine.close()


@pytest.fixture(scope="module")
def robot(engine):
    with Contained(engine) as robot:
        yield robot


def status(engine, name):
    """Return the kernel's status of a container's first process."""
    pid = engine.inspect(name)["State"]["Pid"]
    lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    return {key: value.split() for key, _, value in (line.partition(":") for line in lines)}


def drive(endpoint):
    """Move in every way, with each shaper."""
    with Wire(endpoint) as wire, wire.control() as token:

        def do(type, **fields):  # noqa: A002  the wire's name
            answer = wire.command(type, token=token, **fields)
            assert answer["type"] in {"accepted", "done"}, answer
            return answer

        wire.listen("state", "event")
        for shaper in ("none", "zv", "zvd", "mzv", "ei", "ei2", "ei3"):
            do("set_shaper", name=shaper)
        do("set_estimator", name="fixed", f_d=[7.0], zeta=[0.02])
        id = do("move_j", q=[0.2, *Q1[1:]])["id"]  # noqa: A001  the wire's name
        wire.wait("event", lambda event: event["id"] == id and event["kind"] == "motion_done")
        do("servo_start", period=TICK)
        for sequence in range(50):
            wire.setpoint(token=token, sequence=sequence, q=[0.2, *Q1[1:]])
            wire.state()
        do("servo_stop")
        do("move_j", q=[1.0, *Q1[1:]])
        wire.next("state", lambda state: state["target_qd"][0] > 0.1)
        do("stop")
        wire.next("state", lambda state: state["target_qd"][0] == 0.0)


def test_image_has_at_most_700_mb_and_no_files_for_development(engine, measured):
    layers = engine.inspect("tvist", "image")["Size"]
    image = Path(engine("image", "mount", "tvist"))
    du = engine.run("du", "--summarize", "--block-size=1", "--one-file-system", image)
    on_disk = int(du.stdout.split()[0])
    measured("sum of the layers, and on the disk [MB]", (round(layers / MB), round(on_disk / MB)))
    assert max(layers, on_disk) <= 700 * MB
    assert (image / "opt/tvist/bin/tvist").exists()
    assert not [path for pattern in NEVER_NEEDED for path in (image / "opt").rglob(pattern)]
    assert not [path for path in (image / "project", image / "build") if path.exists()]
    engine("image", "unmount", "tvist")


def test_process_has_no_rights_and_a_read_only_file_system(engine, robot):
    configured = engine.inspect("tvist", "image")["Config"]
    assert configured["User"] == "10001:10001"
    seen = status(engine, robot.name)
    assert seen["NSpid"][-1] == "1"
    assert set(seen["Uid"]) == set(seen["Gid"]) == {"10001"}
    assert seen["NoNewPrivs"] == ["1"]
    assert {int(seen[name][0], 16) for name in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb")} == {0}
    for folder in ("/", "/tmp", "/recordings", "/opt/kernels"):  # noqa: S108  of the container
        touched = engine.run("podman", "exec", robot.name, "touch", f"{folder}/here", check=False)
        assert "Read-only file system" in touched.stderr


def test_health_check_is_liveness_and_passes_for_a_stopped_robot(engine):
    assert engine.inspect("tvist", "image")["Healthcheck"]["Test"] == ["CMD", "tvist", "check", "--alive"]
    with Contained(engine) as robot:
        with Wire(robot.endpoint) as wire, wire.control() as token:
            wire.command("simulation.inject", token=token, fault="protective_stop")
        assert engine.run("podman", "healthcheck", "run", robot.name).returncode == 0
        ready = engine.run("podman", "exec", robot.name, "tvist", "check", check=False)
        assert (ready.returncode, "PROTECTIVE_STOP" in ready.stderr) == (1, True)
        assert "ready to be moved" in engine("exec", robot.name, "tvist", "unlock")
        ready = engine.run("podman", "exec", robot.name, "tvist", "check", check=False)
        assert "ok  ready    robot_mode RUNNING, safety_mode NORMAL" in ready.stdout


@pytest.mark.parametrize(
    ("options", "command"),
    [((), ()), (("--entrypoint=python",), ("-c", FOREIGN_MACHINE, *SERVE))],
    ids=["as it comes", "another machine"],
)
def test_nothing_is_compiled_on_a_processor_of_another_name(engine, options, command):
    """numba stores machine code by processor and features; it reports what it loads and saves."""
    talk = ("--env=NUMBA_DEBUG_CACHE=1", "--env=PYTHONUNBUFFERED=1")
    with Contained(engine, *talk, *options, command=command) as robot:
        drive(robot.endpoint)
        cache = engine("logs", robot.name)
        code = robot.end()
    assert code == 0
    assert "data loaded" in cache
    assert "saved" not in cache
    assert "compiling" not in robot.said


def test_robot_with_mounted_keys_answers_clients_with_a_key_only(engine, tmp_path):
    """The health check has a viewer's key, and the authority's key stays outside, as docker/README.md advises."""
    keys = tmp_path / "keys"
    host = ("--robot", "ur5e", "--host", "127.0.0.1")
    engine.run(sys.executable, "-m", "tvist_cli", "keys", keys, *host, "--viewer", "health")
    (keys / "authority.key").unlink()
    for path in (keys, *keys.rglob("*")):
        os.chown(path, 10001, 10001)
    health = "--health-cmd=tvist check --alive tls/127.0.0.1:7447 --security /security/health"
    options = (f"--volume={keys}:/security:ro", health)
    command = ("serve", "--listen", "tls/0.0.0.0:7447", "--security", "/security")
    with Contained(engine, *options, command=command) as robot:
        assert engine.run("podman", "healthcheck", "run", robot.name).returncode == 0
        assert not check(robot.endpoint).ok
        assert check(robot.endpoint.replace("tcp/", "tls/"), security=keys / "health").ok


def test_compose_file_starts_a_robot_that_records_into_a_volume(engine):
    if shutil.which("podman-compose") is None:
        install("podman-compose")
    port = free_endpoint().rpartition(":")[2]
    environment = {"PORT": port, "RECORDING": "first", "COMPOSE_PROFILES": "recorded"}

    def compose(*command):
        words = ("podman-compose", "--file", ROOT / "docker/compose.yaml", "--project-name", "composed")
        engine.run(*words, *command, **environment)

    try:
        compose("up", "--detach", "recorded")
        composed = "--filter=label=io.podman.compose.project=composed"
        (name,) = engine("ps", "--format={{.Names}}", composed).split()
        wait_until_listening(engine, name)
        assert engine.inspect(name)["HostConfig"]["ReadonlyRootfs"]
        assert int(status(engine, name)["CapBnd"][0], 16) == 0
        with Wire(f"tcp/127.0.0.1:{port}") as wire:
            last = wire.until(wire.state()["tick"] + 100)["tick"]
        engine("stop", name)
        assert engine.inspect(name)["State"]["ExitCode"] == 0
        compose("down")
        volume = Path(engine("volume", "inspect", "--format={{.Mountpoint}}", "composed_recordings"))
        content = read(volume / "first.mcap")
        assert content.complete
        assert content.states[-1].tick >= last
    finally:
        compose("down", "--volumes")


def wait_until_listening(engine, name):
    """Wait until a robot that runs in the background says that it listens."""
    with subprocess.Popen(
        ["podman", "logs", "--follow", name],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=engine.environment,
    ) as logs:  # fmt: skip
        try:
            assert any("listens on" in line for line in logs.stderr)
        finally:
            logs.kill()
