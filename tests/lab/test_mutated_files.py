"""Damaged files of every kind that is read: each is read, or refused in one sentence, in bounded time and memory.

A child process reads them under limits of its processor time and memory, so that a file that hangs a reader, or takes
memory without end, ends the child and not the tests. The file at fault remains in the child's folder.
"""

import gzip
import io
import json
import os
import re
import resource
import signal
import struct
import sys
import warnings
from contextlib import redirect_stdout, suppress
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from tests import forked

SECONDS = 20  # longest processor time for one file; hostile ones take up to 6 s on slow machines [s]
MEMORY = 1 << 30  # largest memory that reading may add to what the good files took [bytes]
TREE = Path(__file__).parents[2]

NUMBERS = (
    b"1e308", b"-1e308", b"1e999", b"nan", b"-inf", b"null", b"-1", b"0", b"2.5", b"9" * 20, b"-" + b"9" * 400,
    b"9" * 5000, b"1e-320", b"99999999", b"[]", b'"x"', b"1,5", b"true", b"0x7f", b"\xff", b"",
    b"1e300", b"-1e160", b"10000000", b"1e18",
)  # fmt: skip
WHOLE = (
    0, 1, 0x7F, 0xFF, 0xFFFF, 10**6, 10**9, 2**31 - 1, 2**31, 2**32 - 1, 10**13, 2**40, 2**63 - 1, 2**64 - 1,
)  # fmt: skip
FLOATS = (1e300, -1e160, 1e18, 1e7, 0.0, -1.0, 5e-324, float("nan"), float("-inf"))
BEGINNINGS = (b"[", b"{", b"<a>", b'"', b"\0", b"\xff\xfe", b"#", b"\n", b",", b"\x1b]0;x\x07", b"(", b"a.")


def mutated(data: bytes, random: np.random.Generator, most: int = 3) -> bytes:
    """Change a file in one to so many ways."""
    for _ in range(int(random.integers(1, most + 1))):
        data = bytes(one_of(MUTATIONS, random)(bytearray(data), place_in(data, random), random))
    return data


def one_of(choices, random):
    return choices[int(random.integers(len(choices)))]


def place_in(data, random):
    """A place, often near the beginning or the end where headers are."""
    near = int(random.integers(min(len(data), 600) + 1))
    return one_of((near, len(data) - near, int(random.integers(len(data) + 1))), random)


def flipped(data, _, random):
    for _ in range(int(random.integers(1, 9))):
        if data:
            data[place_in(data, random) - 1] ^= 1 << int(random.integers(8))
    return data


def cut(data, place, random):
    return data[:place] if random.random() < 0.8 else data[place:]


def replaced(data, place, random):
    """Remove a piece, repeat it, overwrite it, or put something in its place."""
    past = min(len(data), place + int(random.integers(1, one_of((40, 3000), random))))
    repeated = data[place:past] * int(random.integers(2, 30))
    filled = one_of((b"\0", b"\xff", b"9", b" "), random) * (past - place)
    begun = one_of(BEGINNINGS, random) * int(random.choice([1, 2, 50, 5000]))
    data[place:past] = one_of((b"", repeated, filled, begun, random.bytes(past - place)), random)
    return data


def renumbered(data, place, random):
    """Replace a number that stands as text."""
    while place < len(data) and not 48 <= data[place] <= 57:
        place += 1
    past = place
    while past < len(data) and (48 <= data[past] <= 57 or data[past] in b".e-+"):
        past += 1
    data[place:past] = one_of(NUMBERS, random)
    return data


def resized(data, place, random):
    """Overwrite a field that could be a length, a count or a float."""
    width, order = int(random.choice([1, 2, 4, 8])), "little" if random.random() < 0.7 else "big"
    if random.random() < 0.3:
        place, width = place - place % 4, 8
        made = struct.pack("<d" if order == "little" else ">d", one_of(FLOATS, random))
    else:
        made = (one_of(WHOLE, random) % 256**width).to_bytes(width, order)
    data[place : place + width] = made
    return data


def shuffled(data, _, random):
    """Exchange, repeat or drop lines."""
    lines = bytes(data).splitlines(keepends=True)
    for _ in range(int(random.integers(1, 6)) if len(lines) > 1 else 0):
        first, other = (int(place) for place in random.integers(len(lines), size=2))
        if random.random() < 0.5:
            lines[first], lines[other] = lines[other], lines[first]
        else:
            lines[first] = lines[other] * int(random.integers(3))
    return b"".join(lines)


MUTATIONS = (flipped, cut, replaced, replaced, replaced, renumbered, resized, resized, shuffled)


def _log():
    from tests.lab.made_logs import SyntheticLog

    return SyntheticLog(motions=1, rest=0.3, rate=60.0)


def _csv(folder):
    found = [_log().csv(folder / "a.csv"), _log().csv(folder / "b.csv", " "), folder / "c.csv.gz"]
    found[2].write_bytes(gzip.compress(found[0].read_bytes()))
    return found


def _repacked(whole, folder, compression):
    """Copy an MCAP file; without compression, a changed byte changes a value."""
    from mcap.writer import CompressionType, Writer

    from tvist_lab.recordings.mcap_records import records

    path = folder / f"{compression}.mcap"
    with whole.open("rb") as source, path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType[compression], enable_crcs=False)
        writer.start()
        for one in records(source):
            match type(one).__name__:
                case "Schema":
                    writer.register_schema(one.name, one.encoding, one.data)
                case "Channel":
                    writer.register_channel(one.topic, one.message_encoding, one.schema_id)
                case "Message":
                    writer.add_message(one.channel_id, one.log_time, one.data, one.publish_time)
                case "Metadata":
                    writer.add_metadata(one.name, one.metadata)
        writer.finish()
    return path


def _rosbag(folder):
    whole = _log().rosbag(folder / "bag") / "bag.mcap"
    return [whole, _repacked(whole, folder / "bag", "NONE")]


def _mcap(folder):
    from tests.lab.golden import TRUTH, changed, record, states

    from tvist_protocol import Event

    truths = [changed(TRUTH, tick=tick) for tick in range(1, 9)]
    event = Event(tick=9, kind="motion_started", id=1)
    whole = record(folder / "zstd.mcap", [*states(30), *truths, event])
    return [whole, _repacked(whole, folder, "LZ4"), _repacked(whole, folder, "NONE")]


def _logs(folder):
    (folder / "run").mkdir()
    run = _repacked(TREE / "tests" / "journals" / "live_lost_lease.mcap", folder / "run", "NONE")
    return [*_csv(folder), _log().dump(folder / "dump"), *_rosbag(folder), *_mcap(folder), run]


def _parquet(folder):
    import polars as pl
    from tests.lab.made_logs import table
    from tests.lab.test_export import recording

    from tvist_lab.recordings.export import export

    ours, plain = folder / "run.parquet", folder / "plain.parquet"
    export(recording(), ours, "parquet")
    names, values = table(_log().columns)
    pl.DataFrame(values, schema=names).write_parquet(plain, compression="uncompressed", row_group_size=40)
    return [ours, plain]


def _npz(folder):
    path = folder / "plain.npz"
    np.savez(path, **_log().columns)
    return [path]


def _program(folder):
    from tests.server.polyscope_files import expression, move, saved, waypoint

    assigned = f"<Assignment><variable name='x'/>{expression('[1, 2.5]')}</Assignment>"
    tree = saved(assigned, move(waypoint("A", (0, -1.5, 1, 0, 0, 0))), repeats=True).encode()
    return _written("a.urp", "def pick():\n  sync()\nend\n", tree, gzip.compress(tree))(folder)


def _written(name, *contents):
    """Write files of these contents: a text, bytes, or a path to copy."""

    def write(folder):
        found = [folder / f"{number}{name}" for number in range(len(contents))]
        for path, content in zip(found, contents, strict=True):
            made = content.read_bytes() if hasattr(content, "read_bytes") else content
            path.write_bytes(made.encode() if isinstance(made, str) else made)
        return found

    return write


def _run_commands(path):
    """What a user does with a log: each command ends well or refuses in one line, whatever the others do."""
    from tvist_cli.commands.log import analyze, export, replay
    from tvist_cli.failure import Failure, failing_on

    to = {"to": "csv", "output": path.with_name("written.csv")}
    commands = {analyze.analyze: {"json": True}, export.export: to, replay.replay: {}}
    refused = []
    for command, options in commands.items():
        _limit_time()
        with redirect_stdout(io.StringIO()), suppress(SystemExit):
            try:
                with failing_on(OSError):
                    command(path, **options)
            except Failure as failure:
                refused.append(str(failure))
    assert all(said.isprintable() and len(said) < 1000 for said in refused), refused
    if len(refused) == len(commands):
        raise Failure(refused[0])


def _readers():
    """The reader of each kind of file, and the errors by which it refuses."""
    from tvist_cli.failure import Failure
    from tvist_controller.sources import calibrations
    from tvist_lab.recordings import RecordingError, read
    from tvist_lab.studies.sweep import read_spec
    from tvist_lab.study.moves import MovesError, read_moves
    from tvist_plant import description
    from tvist_plant.user_file import UserFileError
    from tvist_protocol.calibration import CalibrationError
    from tvist_server.config import from_mapping
    from tvist_server.option_values import StartError, read_start_file
    from tvist_server.program_folder import ProgramFolder
    from tvist_server.start_files import InitialState

    def config(path):
        return from_mapping(read_start_file(path, "configuration", dict), f"configuration {path}")

    arm, start = description.load("ur5e"), (StartError, UserFileError)
    return {
        "commands": (_run_commands, Failure),
        "robot": (description.load, UserFileError),
        "calibration": (calibrations.load, (CalibrationError, UserFileError)),
        "moves": (lambda path: read_moves(path, arm, lambda: 1.0), (MovesError, UserFileError)),
        "config": (config, start),
        "state": (lambda path: read_start_file(path, "state", InitialState), start),
        "sweep": (read_spec, UserFileError),
        "program": (lambda path: ProgramFolder(path.parent).read(path.name), UserFileError),
        "recording": (read, RecordingError),
    }


STATE = "q = [0.1, -1.2, 1.5, -1.8, -1.5, 0.0]\nseed = 7\nmode = 'IDLE'\n[payload]\nmass = 2.0\ncom = [0.0, 0.0, 0.1]\n"
STATE += "inertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\n"
MOVES = (
    '[{"start": [0, -1.2, 1.5, -1.8, -1.5, 0], "target": [0.3, -1.0, 1.5, -1.8, -1.5, 0.2], "payload": 2.5}]'
)
SWEEP = """shapers = ["zv", "auto"]
moves = 8
payloads = [0.0, 2.5, "uniform"]
robots = ["ur5e", {robot = "ur3e", calibration = "ur3e-modal"}]
seed = 3
errors = [{payload = 10.0}, {frequency = -20.0}]
"""
CONFIG = 'robot = "ur5e"\nname = "arm"\nlisten = ["tcp/127.0.0.1:7447"]\nkeep = "5 min"\nrecord = "a.mcap"\n'

SHIPPED = resources.files("tvist_controller") / "sources"
ROBOTS = resources.files("tvist_plant") / "robots"

KINDS = {
    "csv": (_csv, "recording"),
    "dump": (lambda folder: [_log().dump(folder / "dump")], "recording"),
    "rosbag": (_rosbag, "recording"),
    "mcap": (_mcap, "recording"),
    "parquet": (_parquet, "recording"),
    "npz": (_npz, "recording"),
    "commands": (_logs, "commands"),
    "toml": (_written("robot.toml", ROBOTS / "ur5e.toml"), "robot"),
    "urdf": (_written("robot.urdf", TREE / "tests" / "plant" / "urdf" / "seven.urdf"), "robot"),
    "calibration": (
        _written("known.json", SHIPPED / "ur5e_5kg.json", SHIPPED / "ur5e_modal.json"),
        "calibration",
    ),
    "moves": (_written("moves.json", MOVES), "moves"),
    "config": (_written("config.toml", CONFIG), "config"),
    "state": (_written("state.toml", STATE), "state"),
    "sweep": (_written("sweep.toml", SWEEP), "sweep"),
    "program": (_program, "program"),
}  # for each kind of file, what writes good ones, and its reader


def _header(shape):
    """An npz of one array that has this shape and no content."""

    def write(folder):
        import zipfile

        from numpy.lib import format as npy

        with zipfile.ZipFile(folder / "a.npz", "w") as file, file.open("timestamp.npy", "w") as part:
            npy.write_array_header_1_0(part, {"descr": "<f8", "fortran_order": False, "shape": shape})
        return [folder / "a.npz"]

    return write


def _rows(*more):
    names = ["timestamp", *(f"actual_q_{joint}" for joint in range(6)), *more]
    rows = [",".join([f"{0.002 * row}"] + ["0"] * (len(names) - 1)) for row in range(9)]
    return "\n".join([",".join(names), *rows, ""])


def _links(count, form):
    """A URDF of many links that are fixed to each other: in a chain, or all to one."""
    joint = (
        '<joint name="j{0}" type="fixed"><parent link="l{1}"/><child link="l{0}"/></joint><link name="l{0}"/>'
    )
    tree = "".join(joint.format(link, link - 1 if form == "chain" else 0) for link in range(1, count))
    return f'<robot name="r"><link name="l0"/>{tree}</robot>'


LAUGHS = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 30))
HOSTILE = {
    "a column of an index beyond all": ("csv", _written(".csv", _rows("actual_q_" + "9" * 20))),
    "a column of a large index": ("csv", _written(".csv", _rows("x_999999", *(f"y{n}_99999999" for n in range(999))))),
    "10,000 columns": ("csv", _written(".csv", _rows(*(f"x_{column}" for column in range(10_000))))),
    "10,000 vectors that lack entries": ("csv", _written(".csv", _rows(*(f"x{name}_9999" for name in range(10_000))))),
    "arrays of no rows and a billion columns": ("npz", _header((0, 10**9))),
    "more numbers than there is memory": ("npz", _header((10**13,))),
    "more numbers than there are": ("npz", _header((2**62, 2**62))),
    "100,000 nested elements": ("urdf", _written(".urdf", "<robot>" + "<link>" * 10**5)),
    "a chain of 5,000 links": ("urdf", _written(".urdf", _links(5_000, "chain"))),
    "5,000 links on one": ("urdf", _written(".urdf", _links(5_000, "star"))),
    "entities of entities": ("urdf", _written(".urdf", f"<!DOCTYPE a [<!ENTITY l0 'l'>{LAUGHS}]><robot>&l29;</robot>")),
    "a sweep of 100,000 payloads": (
        "sweep",
        _written(".toml", f"shapers=['zv']\nmoves=1\npayloads=[{','.join(f'{n}e-5' for n in range(100_000))}]"),
    ),
    "a number of 5,000 digits": ("moves", _written(".json", f"[{{'start': [{'1' * 5000}]}}]".replace("'", '"'))),
}  # fmt: skip
"""Files made to hang a reader or to take its memory, each with its kind."""

FEWER = {"parquet": 4, "commands": 2}  # how many times fewer files are tried of kinds that take long


def _limit_time() -> None:
    used = resource.getrusage(resource.RUSAGE_SELF)
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime) + SECONDS, hard))


def main(folder: Path, count: int, kinds: list[str]) -> None:
    """Read mutated files; whatever ends this function is a fault, and the last file is the one that has it."""
    warnings.simplefilter("error", RuntimeWarning)
    readers = _readers()
    for kind in kinds:
        print(kind, end=": ", flush=True)  # noqa: T201  the test tells it
        hostile = HOSTILE.get(kind)
        write, reader = KINDS[kind if hostile is None else hostile[0]]
        (place := folder / kind).mkdir()
        tried = max(1, count // FEWER.get(kind, 1))
        _read_bad(kind, tried, write(place), *readers[reader], None if hostile is None else hostile[1])


def _read_bad(kind, count, good, read, refusal, write):
    for path in good:
        read(path)
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY, resource.RLIM_INFINITY))
    was_read = 0
    for number in range(count):
        random = np.random.default_rng((0, number))
        path = good[number * len(good) // count] if count < len(good) else good[number % len(good)]
        bad = path.with_name(f"bad-{path.name}")
        if write is None:
            bad.write_bytes(mutated(path.read_bytes(), random, 1 if kind == "commands" else 3))
        else:
            (bad,) = write(path.parent)
        _limit_time()
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        try:
            read(bad)
            was_read += 1
        except refusal as error:
            said = str(error)
            if "\n" in said or str(bad) not in said or len(said) > 1000:
                raise AssertionError(f"no sentence: {said}") from error
        assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < SECONDS
    print(f"{was_read} of {count} were read")  # noqa: T201  likewise


def test_malicious_file_does_not_hang_its_reader(tmp_path, measured):
    _try(HOSTILE, 1, tmp_path, measured)


@pytest.mark.parametrize("count", [4, pytest.param(400, marks=pytest.mark.nightly)])
def test_damaged_file_is_read_or_refused(count, tmp_path, measured):
    _try(KINDS, count, tmp_path, measured)


def _try(kinds, count, tmp_path, measured):
    child = forked.run(
        [sys.executable, "-m", "tests.lab.test_mutated_files", tmp_path, str(count), *kinds],
        cwd=TREE, env=os.environ | {"POLARS_MAX_THREADS": "1", "PYTHONPATH": str(TREE)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    name = signal.Signals(-child.returncode).name if child.returncode < 0 else f"exit {child.returncode}"
    assert child.returncode == 0, f"{name} in {tmp_path} at\n{child.stdout}\n{child.stderr[-3000:]}"
    measured("files read", child.stdout.strip())


HARMFUL = "\x1b]0;owned\x07\x1b[2J\x9b31m\r\u202e[red]"


def test_text_of_a_file_has_no_terminal_commands(capsys, monkeypatch):
    from tvist_cli.failure import Failure
    from tvist_cli.main import main
    from tvist_cli.output import out, print_json, say, table, words

    out.print(HARMFUL)
    say(HARMFUL)
    table(HARMFUL, (HARMFUL, "b"), [(HARMFUL, HARMFUL)])
    words({HARMFUL: HARMFUL})
    print_json({"text": HARMFUL})

    def refuse():
        raise Failure(HARMFUL)

    monkeypatch.setattr("tvist_cli.main.application", lambda *_: lambda *_args, **_kwargs: refuse())
    monkeypatch.setattr(sys, "argv", ["tvist", "info"])
    with pytest.raises(SystemExit):
        main()
    said = "".join(capsys.readouterr())
    assert not set(said) & set("\x1b\x07\x9b\r\u202e")
    assert said.count("[red]") >= 5


@pytest.mark.parametrize("name", [HARMFUL, "n" * 101])
@pytest.mark.parametrize("key", ["name", "model", "joints"])
def test_robot_with_an_unprintable_name_is_refused(key, name, tmp_path):
    from tvist_plant.description import load
    from tvist_plant.user_file import UserFileError

    begin = re.compile(rf'^{key}\s*= *(\[\s*)?".*?"', re.MULTILINE)
    new = f"{key} = {'[' * (key == 'joints')}{json.dumps(name)}"
    text, count = begin.subn(lambda _: new, (ROBOTS / "ur5e.toml").read_text(), count=1)
    assert count
    bad = tmp_path / "bad.toml"
    bad.write_text(text)
    with pytest.raises(UserFileError, match=f"robot.{key} has the name .*at most 100 printable") as refused:
        load(bad)
    assert str(refused.value).isprintable()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
