"""A world made in a process of its own: no file of a scene can end this one, take its memory or hold it up."""

import os
import pickle
import resource
import signal
import subprocess
import sys

import mujoco
import numpy as np

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import Hand
from tvist_plant.user_file import named, one_line
from tvist_plant.world.scene import World, build
from tvist_plant.world.scene_file import SceneError, SceneFile
from tvist_plant.world.second_opinion import SecondOpinion

LONGEST, MOST_MEMORY = 30, 768 << 20
"""Longest time [s] and largest memory [byte] that MuJoCo may take for a scene."""
HINT = "look for numbers, counts or files that are too large"


def build_apart(
    description: RobotDescription, payload: Payload, scene: SceneFile, timestep: float, hand: Hand | None
) -> World:
    """Put an arm into a scene as `build` does.

    Raises:
        SceneError: The file is no scene, no arm can stand in it, or MuJoCo fails with it.
    """
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-P", "-m", __name__],
        input=pickle.dumps((LONGEST, description, payload, scene, timestep, hand)),
        capture_output=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # the memory of others would be counted
    )
    if done.returncode == -signal.SIGALRM:
        found = f"MuJoCo takes more than {LONGEST} s for it: make it simpler"
    elif done.returncode != 0:
        found = f"MuJoCo ends with exit code {done.returncode}: {HINT}"
    else:
        found = pickle.loads(done.stdout)  # noqa: S301  it comes from the process above
    if isinstance(found, World):
        return found
    raise SceneError(f"world {scene.name}: {found}")


def _main() -> None:
    """Build the world that stdin describes, and put the arm at rest in it once; write it, or what is wrong."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # MuJoCo prints warnings, and writes a log of them where it is
    os.chdir("/")
    longest, description, *more = pickle.load(sys.stdin.buffer)  # noqa: S301  see above
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
    signal.alarm(longest)  # also ends what waits inside MuJoCo, and what nobody waits for any more
    try:
        world, still = build(description, *more), np.zeros(description.joints)
        SecondOpinion(description, more[0], more[2], world.model).reset(DriveCommand(still, still, still))
        found = pickle.dumps(world)
    except (ValueError, mujoco.FatalError) as error:  # among them SceneError
        found = pickle.dumps(one_line(str(error)))
    except Exception as error:  # noqa: BLE001  also of memory, and what MuJoCo does not know itself
        found = pickle.dumps(f"MuJoCo fails: {named(error)}: {HINT}")
    with answer:
        answer.write(found)


if __name__ == "__main__":
    _main()
