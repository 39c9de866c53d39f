"""Shapers from files: loaded, chosen by their names, recorded, and stopped when they fail."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from tests.controller.robots import PAPER, Q2, Q3, H, Robot, calibration, setup
from tests.server.test_own_plants import moved

from tvist_controller.about import info_of
from tvist_controller.dispatch.planner import Planner
from tvist_controller.sources.own_files import OwnFileError
from tvist_controller.sources.own_shapers import OwnShaper, load_own
from tvist_lab.replay import ReplayError, replay_file
from tvist_protocol import commands as c
from tvist_protocol.modes import SafetyMode
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationReset
from tvist_server.config import from_mapping
from tvist_server.option_values import StartError
from tvist_shaping import Impulses, Shaper, zv

MINE = '''
import numpy as np
from dataclasses import dataclass
from tvist_shaping import FirShaper, Impulses, Shaper, custom, zv

def mine(f_d, zeta):
    """Zero vibration."""
    return zv(f_d, zeta)

@dataclass
class Thirds:
    share: float
    def __call__(self, f_d, zeta):
        return Impulses([self.share] * 3, [0.0, 1 / 3 / f_d, 2 / 3 / f_d])

thirds = Thirds(1 / 3)
MEAN = FirShaper("mean", "the mean of 40 ms", lambda f_d, zeta: np.full(20, 0.05), taps=20)
zvd = custom("zvd", [0.5, 0.5], [0.0, 0.5])
LONG = custom("long", [0.5, 0.5], [0.0, 9.0])
NUMBER = 3
class Step:
    def step(self, q_ref, info): return q_ref
def raises(f_d, zeta): raise RuntimeError("not today")
TABLE = [[0.5, 0.5]] * 20
def table(f_d, zeta): return Impulses(TABLE[int(f_d)], [0.0, 0.5 / f_d])
def negative(f_d, zeta): return Impulses([1.5, -0.5], [0.0, 0.5 / f_d])
NEGATIVE = Shaper("negative", "", negative, 0.5)
FIR = FirShaper("fir", "", lambda f_d, zeta: [2.0, -1.0], taps=2)
def lists(f_d, zeta): return [0.5, 0.5], [0.0, 0.5 / f_d]
def early(f_d, zeta): return Impulses([0.5, 0.5], [-0.1, 0.5 / f_d])
def unsummed(f_d, zeta):
    return Impulses([0.5, 0.4], [0.0, 0.5 / f_d])
def damped(f_d, zeta): return zv(f_d, zeta) if zeta < 0.2 else None
def low(f_d, zeta): return zv(f_d, zeta) if 5.0 < f_d < 30.0 else 1 / 0
'''
WRONG_NAMES = {
    "nobody": "mine.py does not contain nobody; it contains mine, thirds, MEAN",
    "NUMBER": "NUMBER is of type int; it must be a function (f_d, zeta) -> Impulses",
    "Step": "Step is a class",
    "raises": "mine.py:raises raises RuntimeError: not today in line 23 of mine.py for f_d = 10 Hz and ζ = 0.1",
    "NEGATIVE": "has a peak of 2, more than the declared 1: give peak=2 to Shaper",
    "FIR": "has a peak of 3, more than the declared 1: give peak=3 to FirShaper",
    "lists": "returns tuple instead of Impulses(A, tau) of tvist_shaping",
    "early": "must ascend from 0 (sort the impulses by time, and subtract the first) in line 30 of mine.py",
    "unsummed": "must be 1 within 1e-9 (divide A by its sum) in line 32 of mine.py",
    "zvd": "name is 'zvd': must be a name that no other shaper has",
    "": "the name of the shaper is missing",
}
WRONG_FILES = {
    "1 / 0\n": "raises ZeroDivisionError: division by zero in line 1",
    "\n\ndef f(:\n": "raises SyntaxError: invalid syntax in line 3",
    "import nothing_of_that_name\n": "raises ModuleNotFoundError: No module named 'nothing_of_that_name' in line 1",
    "raise SystemExit(2)\n": "raises SystemExit: 2",
    "": "does not contain mine; it contains no shaper",
}
WRONG = [(MINE, name, said) for name, said in WRONG_NAMES.items()]
WRONG += [(content, "mine", said) for content, said in WRONG_FILES.items()]


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MINE, encoding="utf-8")
    return path


def test_a_shaper_is_named_after_its_function_object_or_filter(file):
    for name, called in (("mine", "mine"), ("thirds", "thirds"), ("MEAN", "mean")):
        own = load_own(f"{file}:{name}")
        assert (own.name, own.file, own.attribute) == (called, str(file), name)


def test_an_invalid_shaper_is_refused_with_file_and_line(file):
    for content, name, said in WRONG:
        file.write_text(content, encoding="utf-8")
        with pytest.raises(OwnFileError, match=r"^shaper ") as error:
            load_own(f"{file}:{name}")
        assert said in str(error.value)
        assert str(file) in str(error.value)
        assert "\n" not in str(error.value)


def test_a_missing_shaper_file_is_refused(tmp_path):
    with pytest.raises(OwnFileError, match=r"no\.py cannot be read: No such file"):
        load_own(f"{tmp_path}/no.py:mine")
    with pytest.raises(OwnFileError, match=r"FILE\.py:NAME"):
        load_own("zv")


@pytest.mark.parametrize(
    ("name", "robot", "said"),
    [
        ("table", "ur5e", "raises IndexError: list index out of range in line 25 of mine.py for f_d = 2"),
        ("damped", "ur5e", "returns NoneType instead of Impulses"),
        ("low", "ur5e", None),
        ("damped", "one-joint", None),
    ],
)
def test_a_shaper_must_support_the_modes_of_the_arm(file, name, robot, said):
    config = from_mapping({"shaper": f"{file}:{name}", "robot": robot}, "configuration")
    if said is None:
        made = config.setup()
        assert made.shaper == made.registry.names()[-1] == name
        return
    must = "must support the modes of this arm, .* Hz with ζ = .*clip"
    with pytest.raises(StartError, match=must) as error:
        config.setup()
    assert said in str(error.value)


def test_a_state_file_can_add_a_shaper_with_another_name(file, tmp_path):
    path = tmp_path / "state.toml"
    path.write_text(f'shaper = "{file}:MEAN"\n')
    config = from_mapping({"shaper": f"{file}:mine", "state": str(path)}, "configuration")
    made = config.setup()
    assert (made.shaper, [own.name for own in made.own_shapers]) == ("mean", ["mine", "mean"])
    (tmp_path / "other.py").write_text(MINE + "# other\n")
    path.write_text(f'shaper = "{tmp_path}/other.py:mine"\n')
    with pytest.raises(StartError, match="must be a name that no other shaper has"):
        config.setup()


def test_a_shaper_longer_than_the_largest_delay_is_refused(file):
    with pytest.raises(ValueError, match=r"at most max_delay = 1 s; shaper 'long' lasts 9 periods"):
        Robot(calibration=calibration(), shaper="long", own_shapers=(load_own(f"{file}:LONG"),))


def robot(shaper):
    given = OwnShaper("mine.py", "mine", "0" * 64, shaper)
    return Robot(calibration=calibration(), shaper=given.name, own_shapers=(given,))


def test_an_own_zv_shaper_gives_the_states_of_the_built_in_one():
    mine, built_in = robot(Shaper("mine", "as zv", zv, 0.5)), Robot(calibration=calibration(), shaper="zv")
    for one in (mine, built_in):
        one.send(c.MoveJ, q=tuple(Q2))
        one.until_rest()
    assert mine.states == built_in.states
    assert info_of(mine.controller).shaper == "mine"


def test_clients_choose_an_own_shaper_by_name_and_never_by_file(file):
    place = f"{file}:thirds"
    one = Robot(calibration=calibration(), own_shapers=(load_own(place),))
    assert info_of(one.controller).shapers[-1] == "thirds"
    assert one.send(c.SetShaper, name="thirds") == Done()
    for name in (f"{file}:mine"[-64:], "mine"):
        for refused in (one.send(c.SetShaper, name=name), one.send(SimulationReset, shaper=name)):
            assert refused.code == "unknown_shaper"
    assert one.send(SimulationReset, shaper="thirds") == Done(tick=0)


FAILING = {
    "raises": (lambda _f_d, _zeta: 1 / 0, "raises ZeroDivisionError"),
    "exits": (lambda _f_d, _zeta: sys.exit(1), "raises SystemExit"),
    "NaN": (lambda _f_d, _zeta: Impulses(np.array([np.nan]), np.array([0.0])), "must be finite"),
    "nothing": (lambda _f_d, _zeta: None, "returns NoneType"),
    "sum": (lambda _f_d, _zeta: Impulses(np.array([2.0]), np.array([0.0])), "must be 1 within"),
    "too long": (lambda f_d, zeta: zv(1e-3 * f_d, zeta), "beyond"),
}


@pytest.fixture(params=list(FAILING))
def failing(request):
    """A robot whose shaper fails once `failing` is set, the switch, and words of the error."""
    wrong, words = FAILING[request.param]
    turning = SimpleNamespace(failing=False)

    def weights(f_d, zeta):
        return (wrong if turning.failing else zv)(f_d, zeta)

    return robot(Shaper("mine", "", weights, 0.5)), turning, words


ACTIVITIES = ("move", "stream", "fade", "rest")
EACH = [(name, ACTIVITIES[number % 4]) for number, name in enumerate(FAILING)]
"""Every failure in some activity, and every activity."""


@pytest.mark.parametrize(("failing", "activity"), EACH, indirect=["failing"])
def test_a_failing_shaper_causes_a_protective_stop(failing, activity):
    one, turning, words = failing
    if activity == "stream":
        one.stream(150)
    elif activity != "rest":
        one.send(c.MoveJ, q=tuple(Q3))
    one.tick(0 if activity == "stream" else 100)
    if activity == "fade":
        assert one.send(c.SetShaper, name="ei") == Done()
        one.tick(100)
    before = len(one.states)
    turning.failing = True
    one.tick(1)
    (event,) = [event for event in one.events if event.kind == "protective_stop"]
    assert event.tick == before + 1
    assert event.why.startswith("shaper mine ")
    assert words in event.why
    assert "Hz and ζ = " in event.why
    one.until_rest()
    assert one.tick().safety_mode == SafetyMode.PROTECTIVE_STOP
    assert np.abs(one.column("target_qdd")).max() < 50.0  # a stop at the torque limits, and no jump
    assert np.abs(np.diff(one.column("target_q"), axis=0)).max() < 1.1 * PAPER.velocity * H
    if activity != "fade":  # without another shaper it stops again
        assert one.send(c.UnlockProtectiveStop) == Done()
        assert one.tick().safety_mode == SafetyMode.PROTECTIVE_STOP
        one.until_rest()
    assert one.send(c.SetShaper, name="ei") == Done()
    assert one.send(c.UnlockProtectiveStop) == Done()
    one.send(c.MoveJ, q=tuple(Q2))
    one.until_rest()
    assert one.kinds()[-1] == "motion_done"


def test_a_failing_shaper_is_refused_also_by_the_planner(failing):
    one, turning, words = failing
    assert one.send(c.SetShaper, name="zv") == Done()
    turning.failing = True
    refused = one.send(c.SetShaper, name="mine")
    assert (refused.code, refused.where) == ("out_of_range", "name")
    assert words in refused.why or "last" in refused.why
    command = c.SetShaper(token=one.token, name="mine")
    plan = Planner(one.controller.setup).plan(command, one.controller.snapshot())
    assert words in plan.found.reply.why


@pytest.fixture
def recorded(file, tmp_path):
    own = (load_own(f"{file}:mine"),)
    return moved(setup(calibration=calibration(), shaper="mine", own_shapers=own), tmp_path / "run.mcap")


def test_a_replay_with_the_shaper_file_is_equal_and_notes_changes(recorded, file, tmp_path):
    (said,) = recorded.start["own_shapers"]
    own = load_own(f"{file}:mine")
    assert said == {"name": "mine", "file": str(file), "attribute": "mine", "sha256": own.sha256}
    elsewhere = file.rename(tmp_path / "moved.py")
    done = replay_file(recorded, None, [load_own(f"{elsewhere}:mine")])
    assert (done.first_difference, done.notes) == (None, [])
    elsewhere.write_text(MINE + "# a comment\n")
    done = replay_file(recorded, None, [load_own(f"{elsewhere}:mine")])
    assert done.first_difference is None
    assert "moved.py has changed since" in done.notes[0]


def test_a_replay_without_the_shaper_file_is_refused(recorded, file):
    with pytest.raises(ReplayError, match="without the shaper mean"):
        replay_file(recorded, None, [load_own(f"{file}:{name}") for name in ("mine", "MEAN")])
    file.write_text("raise SystemExit('it was run')")
    with pytest.raises(ReplayError, match=r"shaper mine of .*mine\.py:mine, .*give --shaper"):
        replay_file(recorded)


def test_an_invalid_list_of_shapers_in_a_recording_is_refused(recorded):
    for said in (3, [3], [{"name": "mine"}], None):
        recorded.start["own_shapers"] = said
        with pytest.raises(ReplayError, match="own_shapers"):
            replay_file(recorded)
