"""Processors and waiting times of threads; background threads do not inherit those of the tick thread."""

import os
import subprocess
import sys
import threading

import pytest

from tvist_controller.kinematics import arm
from tvist_controller.safety import payload_learning
from tvist_plant.description import load
from tvist_server import punctual

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="asked of Linux")


def in_a_thread(job):
    """Run a job on the first processor alone."""

    def run():
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        job()

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()


def test_the_time_that_a_thread_waits_for_a_processor_is_measured():
    def wait():
        with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:  # on the same processor
            while punctual.waited_us() < 1e4:
                pass
            busy.kill()

    in_a_thread(wait)


def test_background_threads_do_not_inherit_the_tick_threads_processor():
    thread, found = punctual.background("slow"), []
    in_a_thread(lambda: found.append(thread.submit(os.sched_getaffinity, 0).result()))
    thread.shutdown()
    assert found == [os.sched_getaffinity(0)]


def test_the_payload_estimator_loads_its_kernel_before_ticks_start(monkeypatch):
    compiled, called = arm.torques_of, []
    monkeypatch.setattr(arm, "torques_of", lambda *given: called.append(given) or compiled(*given))
    payload_learning.PayloadEstimator(load("ur5e"))
    assert called
