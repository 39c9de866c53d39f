"""Studies leave the tick thread alone: they run on other processors, and do not hold the interpreter's lock."""

import os
import sys
import threading
import time

import pytest

from tvist_controller.kinematics import arm
from tvist_controller.safety import payload_student
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


def test_compiled_code_is_loaded_before_the_first_tick(monkeypatch):
    compiled, called = arm.torques_of, []
    monkeypatch.setattr(arm, "torques_of", lambda *given: called.append(given) or compiled(*given))
    payload_student.PayloadStudent(load("ur5e"))
    assert called
