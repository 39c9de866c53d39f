"""Modes that may change abruptly are followed gradually, and exactly where the arm rests."""

import numpy as np

from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.filter import QUICKEST, TvistFilter

H = 0.002


class Jump(Estimator):
    """One mode, whose frequency and damping jump at q = 1."""

    abrupt = True
    modes, f_d_min, zeta_max = 1, 5.0, 0.5

    def estimate(self, q):
        far = q[0] >= 1.0
        return np.array([9.0 if far else 6.0]), np.array([0.1 if far else 0.3])


def played(tvist, q):
    tvist.reset(q[0])
    return np.array([(tvist.filter(sample)[0], tvist.f_d[0], tvist.zeta[0]) for sample in q])


def test_a_jump_of_the_modes_is_followed_at_a_limited_rate():
    q = np.linspace(0.0, 4.0, 700)[:, None]
    shaped, f_d, zeta = played(TvistFilter(shaper("zvd"), Jump(), joints=1), q).T
    assert 0.9 < np.abs(np.diff(f_d) / f_d[:-1]).max() / H / QUICKEST[0] <= 1.0 + 1e-6
    assert np.abs(np.diff(zeta)).max() / H <= QUICKEST[1] * (1.0 + 1e-6)
    begun = 150  # its start is abrupt by itself
    assert np.abs(np.diff(shaped[begun:], 2)).max() / H**2 < 20.0  # a jump would be hundreds
    assert f_d[-1] > 8.5


def test_where_the_arm_rests_the_modes_are_exact():
    q = np.concatenate((np.linspace(0.0, 1.2, 200), np.full(400, 1.2)))[:, None]
    tvist = TvistFilter(shaper("zv"), Jump(), joints=1)
    shaped, *_ = played(tvist, q).T
    assert (tvist.f_d[0], tvist.zeta[0]) == (9.0, 0.1)
    assert shaped[-1] == 1.2


def test_a_fork_continues_with_the_same_bits():
    q = np.linspace(0.0, 3.0, 400)[:, None]
    tvist = TvistFilter(shaper("zv"), Jump(), joints=1)
    played(tvist, q[:180])
    other = tvist.fork()
    rest = [np.array([one.filter(sample) for sample in q[180:]]) for one in (tvist, other)]
    assert (rest[0] == rest[1]).all()
