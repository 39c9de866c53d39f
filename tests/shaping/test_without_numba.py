"""numba is a convenience: without it the same source gives the same numbers."""

import json
import subprocess
import sys

import numpy as np

SCRIPT = """
import json, sys
if sys.argv[1] == "without":
    sys.modules["numba"] = None
import numpy as np
from tvist_shaping import Fade, Polynomial, TvistFilter, shaper
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal
modes = Polynomial(joints=(0, 1), degree=1, f_d_coefficients=[10, 1, 2, 1, 1],
    zeta_coefficients=[0.2, 0.05, 0, 0.05, 0], f_d_range=(6, 15), zeta_range=(0.05, 0.4))
drivetrain = Drivetrain((9e3, 8e3, 5e4), (0.3, 0.2, 0.0), (150.0, 120.0, 0.0), (15.0, 15.0, 0.0), (1.0, 1.0, 5.0))
def mass(q):
    c, d = np.cos(q)
    return np.array([[4 + 2 * c, 1 + c, 0.2], [1 + c, 1.5, 0.1 * d], [0.2, 0.1 * d, 0.6]])
t = 0.002 * np.arange(400)
way = np.array([np.sin(3 * t) * t, np.cos(np.sin(3 * t) * t)]).T
one, all_at_once = (TvistFilter(shaper("ei2"), modes.fork(), joints=2) for _ in range(2))
fade = Fade(one.fork(), TvistFilter(shaper("zv"), modes, joints=2), velocity=3.0, acceleration=9.0, jerk=500.0)
modal = Modal(mass, drivetrain, modes=3)
print(json.dumps({
    "filter": [one.filter(q).tolist() for q in way],
    "run": all_at_once.filter_all(way).tolist(),
    "fade": [fade.filter(q).tolist() for q in way],
    "modal": [np.ravel(modal.estimate(q)).tolist() for q in way],
}))
"""


def test_results_without_numba_are_the_same():
    with_numba, without = (
        json.loads(
            subprocess.run([sys.executable, "-c", SCRIPT, how], check=True, capture_output=True).stdout
        )
        for how in ("with", "without")
    )
    for name, rtol, atol in (("filter", 0, 1e-14), ("run", 0, 1e-14), ("fade", 0, 1e-9), ("modal", 1e-9, 0)):
        np.testing.assert_allclose(without[name], with_numba[name], rtol=rtol, atol=atol, err_msg=name)
    np.testing.assert_array_equal(with_numba["run"], with_numba["filter"])
