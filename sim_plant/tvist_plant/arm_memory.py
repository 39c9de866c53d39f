"""The kernels' memory of a simulated arm: one array with named views.

Numba checks the type of each argument at every call; passing a dozen arrays would cost more than some kernels.
"""

from typing import NamedTuple

import numpy as np

from tvist_kernels.compiling import compiled
from tvist_plant.chain import SCRATCH, WIDTH
from tvist_plant.drives import JointParameters
from tvist_plant.model import Floats

ROWS = len(JointParameters._fields)
LAST, NOW = 0, 1  # indices of the commands and dynamics of the last and the current tick
LINKS, JOINTS, PERIOD, SUBSTEPS, GRAVITY, ENCODER_STEP, HEAD = range(7)
"""Indices of the scalars at the front of the memory, and their number."""


class ArmMemory(NamedTuple):
    """Views of the memory of an arm with N links and n motors."""

    state: Floats  # see `integrator.rows`, shape (6, N+n)
    commands: Floats  # rows q_r, q̇_r, τ_ff of the last command and of this one, shape (2, 3, n)
    dynamics: Floats
    """Upper triangle of M [kg m^2] over a row with the bias [N m]: Coriolis, centrifugal and gravity torques
    minus external ones; last tick and this one, shape (2, N+1, N)."""
    springs: Floats
    """Diagonal of stiffness [N m/rad] and damping [N m s/rad] of each link and motor, shape (2, N+n)."""
    joints: Floats  # rows of `JointParameters`, shape (23, n)
    chain: Floats  # parameters of the links, see `chain_of`, shape (N+1, 22)
    bodies: Floats  # scratch of `sweep`, with the flange in the last row, shape (N+1, 28)
    pushed: Floats  # external torques, shape (N,) [N m]
    qdd: Floats  # accelerations of the links, shape (N,) [rad/s^2]
    readings: Floats  # last encoder readings, NaN before the first, shape (n,) [rad]
    factor: Floats  # scratch for a factorised matrix, shape (N, N)
    force: Floats  # scratch for the torques that do not depend on the state, shape (N+n,) [N m]


def shapes(N: int, n: int) -> ArmMemory:
    """Return the shape of each part of the memory."""
    sizes = (
        (6, N + n), (2, 3, n), (2, N + 1, N), (2, N + n), (ROWS, n), (N + 1, WIDTH), (N + 1, SCRATCH),
        (N,), (N,), (n,), (N, N), (N + n,),
    )  # fmt: skip
    return ArmMemory(*sizes)  # type: ignore[arg-type]


def memory_for(N: int, n: int) -> Floats:
    """Return zeroed memory for an arm with N links and n motors."""
    memory = np.zeros(HEAD + sum(int(np.prod(shape)) for shape in shapes(N, n)))
    memory[LINKS], memory[JOINTS] = N, n
    return memory


@compiled
def parts(memory: Floats) -> ArmMemory:
    """Return the parts of a memory by name, as views."""
    N, n = int(memory[LINKS]), int(memory[JOINTS])
    a = HEAD + 6 * (N + n)
    b = a + 6 * n
    c = b + 2 * (N + 1) * N
    d = c + 2 * (N + n)
    e = d + ROWS * n
    f = e + (N + 1) * WIDTH
    g = f + (N + 1) * SCRATCH
    h = g + 2 * N + n
    return ArmMemory(
        memory[HEAD:a].reshape(6, N + n),
        memory[a:b].reshape(2, 3, n),
        memory[b:c].reshape(2, N + 1, N),
        memory[c:d].reshape(2, N + n),
        memory[d:e].reshape(ROWS, n),
        memory[e:f].reshape(N + 1, WIDTH),
        memory[f:g].reshape(N + 1, SCRATCH),
        memory[g : g + N],
        memory[g + N : g + 2 * N],
        memory[g + 2 * N : h],
        memory[h : h + N * N].reshape(N, N),
        memory[h + N * N :],
    )


@compiled
def of_joint(parameters: Floats, j: int) -> JointParameters[float]:
    """Return the parameters of joint j from the rows of `ArmMemory.joints`."""
    return JointParameters(
        parameters[0, j], parameters[1, j], parameters[2, j], parameters[3, j],
        parameters[4, j], parameters[5, j], parameters[6, j], parameters[7, j],
        parameters[8, j], parameters[9, j], parameters[10, j], parameters[11, j],
        parameters[12, j], parameters[13, j], parameters[14, j], parameters[15, j],
        parameters[16, j], parameters[17, j], parameters[18, j], parameters[19, j],
        parameters[20, j], parameters[21, j], parameters[22, j],
    )  # fmt: skip
