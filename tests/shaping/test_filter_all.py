"""Many samples at once are what the same samples one by one are, to the last bit, for every filter."""

import numpy as np
import pytest

from tvist_shaping import filter as module
from tvist_shaping.catalogue import SHAPERS
from tvist_shaping.errors import ShapingError
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.estimators.polynomial import Polynomial
from tvist_shaping.filter import TvistFilter
from tvist_shaping.named import make_filter


def estimator():
    random = np.random.default_rng(3)
    return Polynomial(
        joints=(1, 2), degree=2,
        f_d_coefficients=[9.0, *random.uniform(-0.6, 0.6, 12)],
        zeta_coefficients=[0.1, *random.uniform(-0.02, 0.02, 12)],
        f_d_range=(5.0, 15.0), zeta_range=(0.01, 0.18),
    )  # fmt: skip


def walk(ticks, seed=1, joints=4):
    """A smooth walk with a rest in the middle and at the end."""
    steps = np.random.default_rng(seed).uniform(-1e-3, 1e-3, (ticks, joints))
    steps[ticks // 3 : ticks // 2] = 0.0
    steps[-ticks // 4 :] = 0.0
    return np.cumsum(np.cumsum(steps, axis=0) * np.linspace(1.0, 0.0, ticks)[:, None] ** 2, axis=0)


def assert_equal(one, other):
    for name in ("f_d", "zeta", "clipped", "fault", "delay", "mean_delay", "settled"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.window(), other.window())
    assert one._line.still == other._line.still


@pytest.mark.parametrize("name", SHAPERS)
@pytest.mark.parametrize("modes", [1, 2])
def test_every_shaper(name, modes):
    shaper = SHAPERS[name]
    made = estimator() if modes == 1 else Fixed([7.0, 15.0], [0.1, 0.15])
    one, other = (TvistFilter(shaper, made.fork(), joints=4) for _ in range(2))
    samples = walk(900)
    at = 0
    for length in (1, 2, 300, 5, 400, 192):
        part = samples[at : at + length]
        at += length
        found = one.filter_all(part)
        np.testing.assert_array_equal(found, np.array([other.filter(sample) for sample in part]))
        assert_equal(one, other)


@pytest.mark.parametrize(("name", "modes"), [("auto", 4), ("elastic", 1)])
def test_other_filters(name, modes):
    known = Fixed([7.0, 15.0, 21.0, 33.0][:modes], [0.1] * modes)
    one, other = (make_filter(name, known, joints=4) for _ in range(2))
    samples = walk(300)
    np.testing.assert_array_equal(one.filter_all(samples), [other.filter(sample) for sample in samples])


def test_along_a_path():
    one, other = (TvistFilter(SHAPERS["zv"], estimator(), joints=4) for _ in range(2))
    for tvist in (one, other):
        tvist.reset(np.zeros(1), lambda s: np.array([s[0], s[0] ** 2, 0.5 * s[0], 0.0]))
    samples = walk(200, joints=1)
    np.testing.assert_array_equal(one.filter_all(samples), [other.filter(sample) for sample in samples])


def test_nothing_and_wrong_shapes():
    tvist = TvistFilter(SHAPERS["zv"], estimator(), joints=4)
    assert tvist.filter_all(np.empty((0, 4))).shape == (0, 4)
    with pytest.raises(ShapingError, match="shape"):
        tvist.filter_all(np.zeros(4))
    with pytest.raises(ShapingError, match="shape"):
        tvist.filter_all(np.zeros((3, 5)))


def test_the_compiled_run_is_its_python_source(monkeypatch):
    samples = walk(60)
    compiled = TvistFilter(SHAPERS["ei"], estimator(), joints=4).filter_all(samples)
    for name, function in vars(module).copy().items():
        if hasattr(function, "py_func"):
            monkeypatch.setattr(module, name, function.py_func)
    plain = TvistFilter(SHAPERS["ei"], estimator(), joints=4).filter_all(samples)
    np.testing.assert_allclose(compiled, plain, rtol=0.0, atol=1e-14)


def test_where_the_compiled_run_cannot_go_on_the_filter_does(monkeypatch):
    """A mode that a kernel refuses is the business of the function of the shaper, at that sample only."""
    tvist, plain = (TvistFilter(SHAPERS["zv"], estimator(), joints=4) for _ in range(2))
    samples, whole = walk(200), module.shape_all

    def stops_early(given, *rest):
        return whole(given[:70], *rest)

    monkeypatch.setattr(module, "shape_all", stops_early)
    np.testing.assert_array_equal(tvist.filter_all(samples), [plain.filter(sample) for sample in samples])
    assert_equal(tvist, plain)
