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
from tvist_shaping import Polynomial, TvistFilter, shaper
modes = Polynomial(joints=(0, 1), degree=1, f_d_coefficients=[10, 1, 2, 1, 1],
    zeta_coefficients=[0.2, 0.05, 0, 0.05, 0], f_d_range=(6, 15), zeta_range=(0.05, 0.4))
tvist = TvistFilter(shaper("ei2"), modes, joints=2)
t = 0.002 * np.arange(500)
print(json.dumps([tvist.filter([x, np.cos(x)]).tolist() for x in np.sin(3 * t) * t]))
"""


def test_without_numba_the_filter_gives_the_same():
    with_numba, without = (
        np.array(
            json.loads(
                subprocess.run([sys.executable, "-c", SCRIPT, how], check=True, capture_output=True).stdout
            )
        )
        for how in ("with", "without")
    )
    np.testing.assert_allclose(without, with_numba, rtol=0, atol=1e-14)
