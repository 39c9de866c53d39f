"""Build a MuJoCo world in a separate process, so that no scene file can crash, block or bloat this one."""

import os
import pickle
import resource
import signal
import subprocess
import sys

import mujoco
import numpy as np

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.surroundings import Hand
from tvist_plant.user_file import named, one_line
from tvist_plant.world.arm_form import settle
from tvist_plant.world.scene import World, build
from tvist_plant.world.scene_file import SceneError, SceneFile

LONGEST, MOST_MEMORY = 30, 768 << 20  # longest time [s] and largest memory [byte] for building a scene
Asked = tuple[RobotDescription, Payload, SceneFile, float, Hand | None]  # arguments of `build`


def build_apart(asked: Asked) -> World:
    """Put an arm into a scene as `build` does, in another process; raise SceneError also if MuJoCo fails."""
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-P", "-m", __name__],
        input=pickle.dumps((LONGEST, asked)),
        capture_output=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # other threads' memory would count
    )
    found = f"MuJoCo ends with exit code {done.returncode}: a scene may take {LONGEST} s and {MOST_MEMORY >> 20} MiB"
    if done.returncode == 0 and isinstance(found := pickle.loads(done.stdout), World):  # noqa: S301  from above
        return found
    raise SceneError(f"world {asked[2].name}: {found}")


def _main() -> None:
    """Build the world described on stdin, settle the arm once, and write the world or an error message."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # MuJoCo prints warnings, and logs them to its directory
    os.chdir("/")
    longest, asked = pickle.load(sys.stdin.buffer)  # noqa: S301  from above
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
    signal.alarm(longest)  # also ends a process that hangs in MuJoCo or was abandoned
    found: World | str
    try:
        description, found = asked[0], build(*asked)
        settle(description, found.model, mujoco.MjData(found.model), np.zeros(description.joints))
    except Exception as error:  # noqa: BLE001  of all kinds, also of memory
        found = one_line(str(error)) if isinstance(error, SceneError) else f"MuJoCo fails: {named(error)}"
    with answer:
        pickle.dump(found, answer)


if __name__ == "__main__":
    _main()
