"""Studies leave the tick thread alone: they run on other processors, and do not hold the interpreter's lock."""

import os
import sys
import threading
import time

import pytest

from tvist_controller.experience import payload_student
from tvist_controller.experience.motion_student import MotionStudent
from tvist_plant import flexible_arm
from tvist_plant.arm_tick import play
from tvist_plant.description import load
from tvist_server.studies import Studies


@pytest.mark.skipif(sys.platform != "linux", reason="asked of Linux")
def test_studies_do_not_inherit_what_the_tick_thread_has():
    studies, found = Studies(), []

    def tick():
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        ended = studies.later(lambda: found.append(os.sched_getaffinity(0)))
        while not ended():
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    thread.join()
    studies.close()
    assert found == [os.sched_getaffinity(0)]


def test_a_twin_moves_without_the_interpreters_lock():
    options = getattr(play, "targetoptions", {"nogil": True})  # none without numba
    assert options["nogil"]


@pytest.mark.parametrize(
    ("student", "module", "kernel"),
    [(MotionStudent, flexible_arm, "play"), (payload_student.PayloadStudent, payload_student, "along")],
)
def test_compiled_code_is_loaded_before_the_first_tick(monkeypatch, student, module, kernel):
    compiled, called = getattr(module, kernel), []
    monkeypatch.setattr(module, kernel, lambda *given: called.append(kernel) or compiled(*given))
    student(load("ur5e"))
    assert called
