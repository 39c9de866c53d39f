"""A failed test leaves recording, log and seed, which its report and JUnit name; other tests leave nothing."""

import os
import select
import xml.etree.ElementTree as ET
from pathlib import Path
from types import SimpleNamespace

import pytest

from tvist_kernels.cache import own_folder
from tvist_lab.recordings import mcap_file, read
from tvist_lab.replay import replay_file
from tvist_testing.markers import ROBOTS
from tvist_testing.plugin import pytest_runtest_makereport

pytest_plugins = ["pytester"]

KERNELS = str(own_folder())

ABSENT = ("scipy", "matplotlib", "mujoco", "polars", "marimo", "distributed", "tvist_lab", "tvist_view")
"""Packages that the extra `testing` does not install."""
HIDDEN = f"import sys; sys.modules.update(dict.fromkeys({ABSENT!r}))"
OUTCOMES = """
import pytest
from tvist_testing import assert_settles_within

pytestmark = pytest.mark.tvist_seed(5)

@pytest.fixture
def fails_at_the_end(tvist_robot):
    yield
    raise OSError("too late")

def test_passes(tvist_robot):
    tvist_robot.advance(5)

@pytest.mark.tvist_shaper("none")
def test_fails(tvist_robot):
    with tvist_robot.control("me") as arm:
        arm.move_j([0.2, -3.1, 0.2, -1.6, 0.0, 0.0])
    assert_settles_within(tvist_robot, 0.001)

def test_fails_at_the_end(fails_at_the_end):
    pass

@pytest.mark.xfail
def test_fails_as_expected(tvist_robot):
    assert not tvist_robot.advance(5)

def test_fails_without_a_robot():
    assert not 1

def test_two_fail(tvist_robots):
    assert not tvist_robots(2)
"""
MISUSES = [
    ("payload(500.0)", "payload is 500.0: must be at most 100"),
    ("payload('heavy')", "tvist_payload has 'heavy': must be a mass in kg"),
    (
        "payload(1.0, 2.0)",
        "tvist_payload has wrong arguments, too many positional arguments: it takes kilograms",
    ),
    ("shaper('nosuch')", "shaper"),
    ("robot('nosuch')", "nosuch"),
    ("state()", "tvist_state has no argument"),
    ("state('nosuch.toml')", "state nosuch.toml: No such file or directory"),
    ("state(mode='ASLEEP')", "mode"),
    ("faults('nosuch')", "tvist_faults has the fault 'nosuch': must be one of protective_stop, reduced"),
    ("faults('torque')", "torque"),
    ("faults('reduced', after=-1.0)", "tvist_faults has after=-1: must be at least 0 s"),
    ("program('def go(:\\n')", "line:1"),
    ("program('nosuch.script')", "tvist_program has the file nosuch.script: No such file or directory"),
    ("seed('one')", "tvist_seed has 'one': must be a whole number"),
]
"""Markers with invalid arguments, and what the test's error says."""


def outcomes(path):
    return {case.get("name"): case for case in ET.parse(path).iter("testcase")}  # noqa: S314  our own file


def properties(case):
    return {one.get("name"): one.get("value") for one in case.iter("property")}


@pytest.fixture(autouse=True)
def _kernels(monkeypatch):
    """Let tests in another home directory find the machine code of this one, rather than compile for a minute."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", KERNELS)


@pytest.mark.parametrize(
    ("failed", "keep_all", "end"), [(True, False, "keep"), (False, False, "discard"), (False, True, "keep")]
)
def test_robots_of_failed_tests_are_kept(failed, keep_all, end):
    """The hook is run as pytest runs it, for a test and its end; the robot records what it is asked."""
    asked = []
    robot = SimpleNamespace(
        keep=lambda: asked.append("keep"), discard=lambda: asked.append("discard"),
        recording=Path("ur5e.mcap"), described=lambda: "its recording", properties=list,
    )  # fmt: skip
    stash = pytest.Stash()
    stash[ROBOTS] = [robot]
    config = SimpleNamespace(getoption=lambda _: keep_all)
    item = SimpleNamespace(stash=stash, config=config, user_properties=[])
    for when, fails in (("call", failed), ("teardown", False)):
        assert not asked
        report = SimpleNamespace(when=when, failed=fails, longrepr=None, sections=[], user_properties=[])
        hook = pytest_runtest_makereport(item, SimpleNamespace(excinfo=None))
        next(hook)
        with pytest.raises(StopIteration):
            hook.send(report)
    assert asked == [end]


@pytest.mark.nightly
def test_recordings_are_kept_only_for_failed_tests(pytester, monkeypatch):
    """The tests cannot import what the extra `testing` does not install."""
    hidden = pytester.mkdir("hidden")
    (hidden / "sitecustomize.py").write_text(HIDDEN)
    monkeypatch.setenv("PYTHONPATH", str(hidden))
    pytester.makepyfile(test_it=OUTCOMES)
    ran = pytester.runpytest_subprocess("--junitxml=report.xml", "-p", "no:cacheprovider")
    ran.assert_outcomes(passed=2, failed=3, errors=1, xfailed=1)
    cases = outcomes("report.xml")
    assert properties(cases["test_passes"]) == properties(cases["test_fails_as_expected"]) == {}
    assert sorted(path.name for path in Path("tvist-recordings").iterdir()) == [
        "test_it.py-test_fails",
        "test_it.py-test_fails_at_the_end",
        "test_it.py-test_two_fail",
    ]
    named = properties(cases["test_fails"])
    recording = Path(named["tvist_recording"])
    assert recording == Path.cwd() / "tvist-recordings" / "test_it.py-test_fails" / "ur5e.mcap"
    assert (named["tvist_seed"], Path(named["tvist_log"]).is_file()) == ("5", True)
    told = "*does not settle within 0.001 s", "*settling time*", f"recording: {recording}", "seed: * 5"
    ran.stdout.fnmatch_lines([*told, f"next: * tvist log analyze {recording}; tvist log replay {recording}"])
    assert len(read(recording)) > 100
    assert replay_file(mcap_file.read(recording)).first_difference is None
    assert properties(cases["test_fails_at_the_end"])["tvist_seed"] == "5"
    two = [one.get("value") for one in cases["test_two_fail"].iter("property")]
    names = " ".join(Path(value).name for value in two)
    assert names == "ur5e-1.mcap ur5e-1.log 5 ur5e-2.mcap ur5e-2.log 6"


@pytest.mark.nightly
def test_markers_with_invalid_arguments_fail_with_one_line(pytester):
    marks = [f"pytest.mark.tvist_{mark}" for mark, _ in MISUSES]
    params = [f"pytest.param({number}, marks={mark})" for number, mark in enumerate(marks)]
    pytester.makepyfile(f"""
        import pytest
        @pytest.mark.parametrize("number", [{", ".join(params)}])
        def test_it(tvist_robot, number):
            raise AssertionError("it began")
    """)
    ran = pytester.runpytest_subprocess("--junitxml=report.xml", "--strict-markers")
    ran.assert_outcomes(errors=len(MISUSES))
    for number, (_, said) in enumerate(MISUSES):
        error = outcomes("report.xml")[f"test_it[{number}]"].find("error")
        text = error.text.strip()
        assert said in text
        assert text.startswith("the robot of this test cannot be made: ")
        assert text.count("\n") == 0, text


@pytest.mark.nightly
def test_parallel_workers_have_separate_robots(pytester):
    pytester.makepyfile("""
        import pytest
        @pytest.mark.parametrize("number", range(4))
        def test_it(tvist_robots, number, record_property):
            first, second = tvist_robots(2)
            record_property("robots", f"{first.endpoint} {second.endpoint}")
            for robot in (first, second):
                assert robot.state().tick == 0
                with robot.control("me") as arm:
                    arm.move_j([0.1, -3.1, 0.2, -1.6, 0.0, 0.0])
    """)
    ran = pytester.runpytest_subprocess(
        "-n", "2", "--tvist-keep-all", "--tvist-recordings=kept", "--junitxml=report.xml"
    )
    ran.assert_outcomes(passed=4)
    kept = sorted(path.relative_to("kept") for path in Path("kept").rglob("*.mcap"))
    assert len(kept) == 8
    cases = outcomes("report.xml").values()
    endpoints = [endpoint for case in cases for endpoint in properties(case)["robots"].split()]
    assert len(endpoints) == 8
    assert all("tvist_seed" in properties(case) for case in cases)


@pytest.mark.nightly
@pytest.mark.realtime
def test_open_ur_rtde_clients_do_not_abort_the_tests(pytester):
    """A robot continues until its clients are gone, even if a failed test, a fixture or a global keeps them."""
    pytest.importorskip("rtde_io")
    pytester.makepyfile("""
        import pytest, rtde_io
        opened = []
        @pytest.fixture
        def client(tvist_ur):
            return rtde_io.RTDEIOInterface(tvist_ur.host)
        def test_fails(tvist_ur):
            client = rtde_io.RTDEIOInterface(tvist_ur.host)
            assert not client
        def test_passes(client):
            assert client.setStandardDigitalOut(1, True)
        def test_keeps_it(tvist_ur):
            opened.append(rtde_io.RTDEIOInterface(tvist_ur.host))
            assert not opened
        def test_goes_on(tvist_ur):
            tvist_ur.advance(100)
            assert opened[0].setStandardDigitalOut(1, True)
    """)
    ran = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    ran.assert_outcomes(passed=2, failed=2)
    assert ran.ret == 1
    kept = list(Path("tvist-recordings").rglob("*.mcap"))
    assert len(kept) == 2
    assert all(mcap_file.read(path).complete for path in kept)


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="needs Linux")
def test_robots_end_with_the_process_of_the_tests(pytester):
    """Here that process ends at once, without any clean-up."""
    pytester.makepyfile("""
        import os
        def test_it(tvist_robot):
            with open("pid", "w") as file:
                file.write(str(tvist_robot.pid))
            os._exit(9)
    """)
    assert pytester.runpytest_subprocess().ret == 9
    try:
        process = os.pidfd_open(int(Path("pid").read_text()))
    except ProcessLookupError:
        return
    ended, _, _ = select.select([process], [], [], 60.0)
    os.close(process)
    assert ended


def test_loading_the_plugin_imports_only_pytest(pytester):
    """pytest loads the plugin in every project in which the client is installed."""
    pytester.makepyfile(f"""
        import sys
        def test_it():
            loaded = {{name.partition(".")[0] for name in sys.modules}}
            heavy = {{"numpy", "zenoh", "msgspec", "tvist_client", "tvist_protocol", "tvist_server", *{ABSENT!r}}}
            assert not loaded & heavy
    """)
    pytester.runpytest_subprocess("-p", "no:hypothesispytest").assert_outcomes(passed=1)
