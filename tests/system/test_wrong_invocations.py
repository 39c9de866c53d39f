"""Wrong command lines print one message with value and limit on stderr, and nothing on stdout.

The entry point of the program is called in this process.
"""

import re
from pathlib import Path

import pytest
from tests.conformance.served import free_endpoint

MSGSPEC = re.compile(
    r"Expected `|Object (missing|contains)|Invalid enum|at `\$|is malformed|Traceback|Errno|Unused"
)
NOWHERE = "tcp/127.0.0.1:1"  # where nobody listens: port 1 is the system's
OWN = str(Path(__file__).parents[1] / "own_arm.py:OwnArm")


def assert_said(ended, code, words):
    found, out, err = ended
    assert (found, out) == (code, ""), err
    assert err.startswith("tvist: ")
    assert err.count("\n") == 1, err
    assert not MSGSPEC.search(err), err
    assert all(word in err for word in words), err


MISUSE = [
    (("serve", "--robots", "ur5e*2", "--workers", "3"), ["workers is 3", "number of robots, 2"]),
    # fleets
    (("stop", "left", "--all"), ["either --all", "left"]),
    (("stop", "Hall/left"), ["namespace is 'Hall'", "a-z 0-9"]),
    (("router", "--rate", "0"), ["rate is '0'", "up to 500"]),
    (("router", "--rate", "10", "--robot", "ur5e*0"), ["robot is 'ur5e*0'", "1 to 10000"]),
    (("router", "--robot", "left"), ["--rate"]),
    (("router", "--listen", "tcp/0.0.0.0:7447"), ["--security", "--insecure"]),
    (("watch", "--states", "tvist/*/event"), ["must end in /state"]),
    (("watch", "--states", "tvist/*/state", "--name", "ur5e"), ["leave --name out"]),
    (("study", "moves", "--payload"), ["needs a value"]),
    (("study", "match", "--shapers", "zv", "zvd", "--baselines"), ["--baselines is not for match"]),
    (("identify", "--payload", "--figures", "maps"), ["figures is for a calibration"]),
    (("serve", "--namespace", "Hall 3"), ["namespace", "a-z 0-9"]),
    (("serve", "--connect", "hall"), ["connect is 'hall'"]),
    (("serve", "--connect", "tls/a:1", "--listen", "tls/b:1", "--security", "keys"), ["leave listen out"]),
    (("keys", "k", "--member", "a", "--uplink", "a"), ["cannot be both robot and router"]),
    # commands and options
    (("dance",), ["'dance'", "--help"]),
    (("mvoe", "Q1"), ["did you mean move?"]),
    (("log", "analize", "x.mcap"), ["did you mean analyze?", "tvist log --help"]),
    (("serve", "--compile", "--ur"), ["--compile serves nothing"]),
    (("shapers", "--output", "x.json"), ["--output are for --sensitivity"]),
    (("shapers", "--sensitivity", "--shaper", "x.py:X"), ["leave --shaper out"]),
    (("robots", "--vary", "50"), ["vary needs --measure"]),
    (("robots", "--measure", "--vary", "90"), ["vary is 90", "0 to 50 %"]),
    (("robots", "--measure", "--random", "0"), ["random is 0", "1 to 10000"]),
    (("",), ["''"]),
    (("check", "--colour"), ["tvist check has no option --colour"]),
    (("move", "Q1", "--velcity", "2"), ["--velcity", "did you mean --velocity?"]),
    (("move", "--", "-0.5,0", "--endpoint", NOWHERE), ["--endpoint comes after --", "give it before"]),
    (("move",), ["target is missing"]),
    (("serve", "--compile", "0"), ["compile is 0", "at least 1"]),
    (("move", "Q1", "Q2"), ["'Q2'"]),
    (("move", "Q1", "--velocity"), ["--velocity needs a value"]),
    (("move", "Q1", "--velocity", "1", "--velocity", "2"), ["--velocity", "twice"]),
    # numbers
    (("move", "Q1", "--velocity", "fast"), ["--velocity is 'fast'", "a number"]),
    (("move", "Q1", "--velocity", "nan"), ["--velocity is nan", "finite"]),
    (("shapers", "--zeta", "1"), ["zeta is 1", "less than 1"]),
    (("demo", "--runs", "0"), ["runs is 0", "at least 1"]),
    (("demo", "--robot", "ur5e"), ["--robot", "are for --runs"]),
    (("demo", "--runs", "1", "--view"), ["--view", "leave --runs out"]),
    (("demo", "--runs", "1", "--format", "pdf"), ["--format", "give --output DIR"]),
    (("bench", "--seconds", "-1"), ["seconds is -1", "at least 0"]),
    (("bench", "--shaper", "zzz"), ["no shaper is called 'zzz'", "um_zvd", "elastic"]),
    (("watch", "--seconds", "0"), ["seconds is 0", "more than 0"]),
    (("log", "record", "x.mcap", "--keep", "10"), ["keep is '10'", "90s, 10min or 2h"]),
    (("serve", "--record", "x.mcap", "--keep", "0s"), ["keep is '0s'", "from 1s"]),
    (("serve", "--keep", "10min"), ["keep is 10min", "nothing is recorded"]),
    (("log", "replay", "x.mcap", "--speed", "2"), ["--speed needs --publish"]),
    (("log", "replay", "x.mcap", "--loop"), ["--loop needs --publish"]),
    (("log", "replay", "x.mcap", "--publish", "--speed", "0"), ["speed is 0: must be 0.01 to 100"]),
    (("log", "replay", "x.mcap", "--publish", "--shaper", "a.py:b"), ["leave out --shaper"]),
    (("log", "replay", "x.mcap", "again.mcap", "--publish"), ["leave out the output"]),
    (("log", "export", "x.mcap", "--to", "xls"), ["to is 'xls'", "csv, parquet, foxglove"]),
    (("log", "export", "x.mcap"), ["--to is missing"]),
    (("log", "export", "x.mcap", "--to", "foxglove", "--imu", "i.csv"), ["--imu", "needs a recording"]),
    (("log", "analyze", "x.csv", "--imu-columns", "time=t"), ["--imu-columns is about --imu"]),
    (("log", "analyze", "x.csv", "--robot", "ur10e"), ["--robot is about --imu"]),
    (("log", "analyze"), ["one recording or log, or two", "not 0"]),
    (("log", "analyze", "x.csv", "y.csv", "--figures", "x"), ["--figures is for one file"]),
    (("log", "analyze", "x.csv", "y.csv", "--imu", "i.csv"), ["1 --imu for 2 logs", "one for each"]),
    (("study", "moves", "--modes", "9"), ["modes is 9", "1 to 6"]),
    (("study",), ["STUDY is missing"]),
    (("study", "sweep"), ["there is no study sweep", "moves, bench, robustness, match"]),
    (("study", "x.toml", "--seed", "1"), ["--seed is for moves, bench", "x.toml defines its own"]),
    (("study", "x.toml", "--processes", "0"), ["processes is 0", "1 to 1024"]),
    (("study", "x.toml", "--scheduler", "localhost"), ["scheduler is 'localhost'", "tcp://HOST:8786"]),
    (("study", "x.toml", "--processes", "2", "--scheduler", "x"), ["either --processes or --scheduler"]),
    (("shapers", "--sensitivity", "zzz"), ["shaper is 'zzz'", "zvd"]),
    (("shapers", "--sensitivity", "--errors", "5", "1"), ["errors is 5 1", "-90 to 900"]),
    (("shapers", "--format", "pdf"), ["--format is about figures", "--figures DIR"]),
    (("shapers", "--figures", "x", "--format", "gif"), ["--format is 'gif'", "png, pdf, svg"]),
    (("shapers", "--figures", "x", "--style", "paper", "--style", "slides"), ["style is paper and slides", "one"]),
    (("identify", "--payload", "5", "--payload", "6"), ["6"]),
    (("identify", "--payload", "20"), ["rating of 5 kg"]),
    (("identify", "x.mcap", "--payload", "0,5"), ["payload is several masses"]),
    (("identify", "x.mcap", "--twin", "--payload=-1"), ["payload is -1"]),
    (("identify", "--columns", "time=t"), ["columns is for logs"]),
    (("identify", NOWHERE, "x.mcap"), ["give one robot, or logs alone"]),
    (("identify", "ur://127.0.0.1:1"), ["give --yes"]),
    (("identify", "ur://", "--yes"), ["must be ur://ADDRESS"]),
    (("identify", "ur://127.0.0.1:1", "x.mcap", "--yes"), ["give one robot, or logs alone"]),
    (("identify", "ur://127.0.0.1:1", "--yes", "--robot", "none-such"), ["none-such"]),
    (("identify", "--yes"), ["yes is for a robot at ur://"]),
    (("identify", "--output", "nowhere/mine.json"), ["output"]),
    (("study", "moves", "--robot", "one-joint", "--moves", "1", "--wrists"), ["wrists"]),
    (("study", "moves", "--robot", "one-joint", "--moves", "1", "--shapers", "auto"), ["needs 4 modes"]),
    (("study", "moves", "--seed", "-1"), ["seed is -1"]),
    (("study", "moves", "--shapers", "auto", "--calibration", "ur5e_5kg"), ["auto", "modes"]),
    (("study", "moves", "--frequency-error", "-100"), ["frequency-error"]),
    (("study", "moves", "--disturbances", ""), ["''", "friction, gear, noise"]),
    (("study", "moves", "--disturbances", "gear", "--clean"), ["--clean", "--disturbances"]),
    (("study", "moves", "--moves", "nope.json", "--wrists"), ["--wrists is for random moves"]),
    (("study", "match", "--shapers", "zv", "auto", "--moves", "19"), ["moves is 19", "20 to 100000"]),
    (("study", "match", "--shapers", "zv", "zv"), ["must be two different ones"]),
    (("study", "match", "--shapers", "zv", "auto", "--payload", "3", "1"), ["payload is 3 1", "0 to 100 kg"]),
    (("study", "moves", "--moves", "1", "--plants", "zz"), ["plant is 'zz'", "stribeck"]),
    (("serve", "--hidden", "1", "--truth"), ["hidden is 1, but truth is on"]),
    (("study", "robustness", "--moves", "0"), ["moves is 0", "1 to 100000"]),
    (("study", "robustness", "--calibration", "ur5e_5kg"), ["ur5e_5kg", "modal"]),
    # poses
    (("move", ""), ["target is ''"]),
    (("move", "90°", "--degrees"), ["target is '90°'", "degrees"]),
    (("move", "--line", "Q1"), ["target is 'Q1'", "x,y,z in m"]),
    (("move", "--line", "0.5,0,0,1,2,x", "--degrees"), ["in m and degrees"]),
    (("move", "--line", "--by", "1,2,3,4,5,6"), ["a distance dx,dy,dz in m"]),
    (("move", "--line", "--by"), ["target is missing"]),
    (("move", "--by", "0,0,0.1"), ["--by needs --line"]),
    (("move", "Q1", "--jerk", "50", "--duration", "2"), ["--jerk and --duration exclude each other"]),
    # names and choices
    (("identify", "--declare"), ["declare is for --payload without a mass"]),
    (("identify", "--twin"), ["twin is for logs"]),
    (("serve", "--reserve-inputs", "speed"), ["reserve_inputs has 'speed'", "speed_slider_mask"]),
    (("identify", "--robot", "nope"), ["robot 'nope'", "ur5e"]),
    (("study", "bench", "--shapers", "zzz"), ["there is no method 'zzz'"]),
    (("demo", "--runs", "1", "--calibration", "nope"), ["calibration 'nope'"]),
    (("shapers", "--shaper", "other.py:mine"), ["other.py cannot be read: No such file or directory"]),
    (("study", "moves", "--moves", "1", "--shapers", "other.py:mine"), ["other.py cannot be read"]),
    (("log", "replay", "none.mcap", "--shaper", "zv"), ["must be FILE.py:NAME"]),
    (("serve", "--plant", "nobody"), ["plant is 'nobody': must be FILE.py:NAME, or one of calibrated, coulomb"]),
    (("serve", "--plant", OWN, "--clock", "lockstep"), ["clock is lockstep, but the plant"]),
    (("serve", "--plant", OWN, "--speed", "2"), ["speed is 2, but the plant"]),
    (("serve", "--plant", OWN, "--robots", "ur5e*2"), ["gives the tick, and there are 2 robots"]),
    (("serve", "--plant", "ur://"), ["ur://ADDRESS"]),
    (("serve", "--plant", "ur://robot:99999"), ["1 to 65535"]),
    (("serve", "--plant", "ur://127.0.0.1/path"), ["ur://ADDRESS"]),
    (("serve", "--enable-motion"), ["--plant ur://"]),
    (("serve", "--plant", "ur://127.0.0.1:1", "--enable-motion", "--speed-cap", "9"), ["speed_cap is 9"]),
    (("serve", "--ur-port", "rtdee=30004"), ["rtdee"]),
    (("view", "--compare", "none"), ["compare has 1 shapers: give two or three"]),
    (("view", "--compare", "none", "--compare", "nope"), ["nope"]),
    (("view", "--magnify", "0.5"), ["magnify is 0.5: must be 1 to 300"]),
    (("view", "--magnify", "nan"), ["magnify"]),
    (("view", "--html", "x.html"), ["needs a recording or --compare"]),
    (("serve", "--ur-address", "192.168.0.1"), ["--insecure"]),
    # files
    (("serve", "--config", "nope.toml"), ["nope.toml", "No such file"]),
    (("study", "bench", "--shapers", "nope.py"), ["nope.py"]),
]  # fmt: skip


STUDIES = {"study", "demo", "identify", "robots", "shapers", "bench", "view"}
"""Commands that import the laboratory."""
OF_STUDIES = [case for case in MISUSE if case[0][0] in STUDIES]
OF_ROBOTS = [case for case in MISUSE if case not in OF_STUDIES]


def name_of(value):
    return " ".join(value) or "empty" if isinstance(value, tuple) else ""


@pytest.mark.parametrize(("arguments", "words"), OF_ROBOTS, ids=name_of)
def test_misuse_of_robots_and_logs_prints_one_message_and_exits_with_code_2(called, arguments, words):
    assert_said(called(*arguments), 2, words)


@pytest.mark.parametrize(("arguments", "words"), OF_STUDIES, ids=name_of)
def test_misuse_of_studies_prints_one_message_and_exits_with_code_2(called, arguments, words):
    assert_said(called(*arguments), 2, words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("move", "-0.5,-3,0,0,0,0", "--endpoint", NOWHERE), ["no server answers", NOWHERE, "tvist serve"]),
        (("move", "q1", "--endpoint", "localhost"), ["'localhost'", "tcp/<host>:<port>"]),
        (("move", "Q1", "--endpoint", "tcp/127.0.0.1:99999"), ["1 to 65535"]),
        (("check", "tls/127.0.0.1:7447"), ["tls/127.0.0.1:7447 requires a certificate: give its folder"]),
        (("check", NOWHERE, "--security", "nope"), [NOWHERE, "tls/<host>:<port>"]),
        (("check", "tls/127.0.0.1:7447", "--security", "nope"), ["nope", "tvist keys"]),
        (("identify", NOWHERE), ["no server answers", NOWHERE]),
        (("log", "analyze", "nope.mcap"), ["nope.mcap", "No such file"]),
        (("study", "x.toml"), ["x.toml", "No such file"]),
        (("log", "analyze", "."), [".", "no MCAP file"]),
        (("serve", "--robot", "."), ["robot file .", "directory"]),
        (("serve", "--robot", "/dev/zero"), ["/dev/zero", "a device"]),
        (("serve", "--record", "."), [".", "exists"]),
        (("serve", "--record", __file__), ["exists already", "choose another file, or", "--keep 10min"]),
        (("serve", "--ur-address", "203.0.113.7", "--insecure"), ["does not have this address"]),
        (("serve", "--insecure", "--listen", "tcp/192.0.2.1:7447"), ["tcp/192.0.2.1:7447"]),
        (("identify", "--ring-downs", "3"), ["at least 4"]),
        (("identify", "--ring-downs", "5", "--payload", "0,1,2,3,4,5"), ["at least 6"]),
        (("identify", "--robot", "one-joint", "--payload"), ["no joint of a one-joint arm carries weight"]),
        (("serve", "--record", "nope/x.mcap"), ["nope/x.mcap", "No such file"]),
        (("shapers", "--figures", __file__), [__file__, "no folder", "another name"]),
        (("view", "missing.mcap"), ["missing.mcap"]),
        (("view", "--address", "0.0.0.0"), ["--insecure"]),  # noqa: S104
        (("view", "--port", "70000"), ["port is 70000: must be 0 to 65535"]),
        (("keys", __file__, "--robot", "ur5e", "--host", "x"), [__file__, "no folder", "another name"]),
    ],
    ids=name_of,
)
def test_a_failure_prints_one_message_and_exits_with_code_1(called, tmp_path, arguments, words):
    assert_said(called(*arguments), 1, words)
    assert list(tmp_path.iterdir()) == []


FILES = [
    ("--config", "x.toml", "payload = true", ["payload must be a number", "not a boolean"]),
    ("--config", "x.toml", "shapr = 'zv'", ["'shapr'", "did you mean 'shaper'?"]),
    ("--config", "x.toml", "payload =", ["not valid TOML", "end of document"]),
    ("--config", "x.toml", f"poses = {'[' * 100_000}", ["is nested too deeply"]),
    ("--config", "x.toml", "ur_ports = {rtde = 70000}", ["ur_ports.rtde is 70000", "65535"]),
    ("--state", "x.json", '{"q": [1, 2', ["not valid JSON", "line 1"]),
    ("--state", "x.toml", "payload = {mass = 1, com = [0, 0]}", ["com has 2 entries", "3"]),
    ("--robot", "x.toml", "[robot]\nname = 3", ["robot.name", "text"]),
    ("--robot", "x.toml", "colour = 'red'", ["colour is not a key"]),
    ("--robot", "x.toml", "[limits]\npayload = 5", ["missing"]),
    ("--calibration", "x.json", "[1]", ["must be a map", "not a list"]),
]  # fmt: skip


@pytest.mark.parametrize(("option", "name", "content", "words"), FILES)
def test_an_invalid_file_is_reported_with_key_value_and_limit(called, tmp_path, option, name, content, words):
    (tmp_path / name).write_text(content, encoding="utf-8")
    code = 1 if option == "--robot" or "deeply" in words[0] else 2  # these are no misuse of the options
    assert_said(called("serve", option, name), code, [name, *words])


SWEEP = "shapers = ['zv']\nmoves = 2\npayloads = [5]\n"
SWEEPS = [
    (SWEEP.replace("zv", "zvv"), ["shapers[0]", "'zvv'", "did you mean"]),
    (SWEEP + "robots = ['ur5']", ["robots[0]", "'ur5'", "one-joint, ur10e"]),
    (SWEEP + "robots = [{robot = 'ur5e', calibration = 'x'}]", ["shapers[0] with robots[0]", "calibration 'x'"]),
    (SWEEP + "robots = ['one-joint']\nwrists = true", ["wrists", "2 joints"]),
    (SWEEP.replace("zv", "mine.py:zv"), ["shapers[0]", "mine.py", "No such file"]),
]  # fmt: skip


@pytest.mark.parametrize(("content", "words"), SWEEPS)
def test_an_invalid_sweep_is_reported_with_file_and_line_or_key(called, tmp_path, content, words):
    (tmp_path / "x.toml").write_text(content, encoding="utf-8")
    assert_said(called("study", "x.toml"), 1, ["x.toml", *words])
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('anna = "king"', ["anna is 'king'", "'operator'"]),
        ("anna = 3", ["anna is 3: must be a string", "'NAME' = 'operator'".replace("'", '"')]),
        ("anna", ["not valid TOML"]),
    ],
)
def test_an_invalid_line_of_the_roles_is_reported(called, tmp_path, line, words):
    (tmp_path / "clients.toml").write_text(line, encoding="utf-8")
    ended = called("serve", "--security", ".", "--listen", f"tls/{free_endpoint().partition('/')[2]}")
    assert_said(ended, 2, ["clients.toml", *words])
