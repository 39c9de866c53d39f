"""What the system gives and counts of threads, and what the tick thread does not give to others."""

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


def test_a_thread_knows_how_long_it_has_waited_for_a_processor():
    def wait():
        with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:  # on the same processor
            while punctual.waited_us() < 1e4:
                pass
            busy.kill()

    in_a_thread(wait)


def test_slow_work_runs_on_other_processors_than_the_tick_thread():
    thread, found = punctual.background("slow"), []
    in_a_thread(lambda: found.append(thread.submit(os.sched_getaffinity, 0).result()))
    thread.shutdown()
    assert found == [os.sched_getaffinity(0)]


def test_compiled_code_is_loaded_before_the_first_tick(monkeypatch):
    compiled, called = arm.torques_of, []
    monkeypatch.setattr(arm, "torques_of", lambda *given: called.append(given) or compiled(*given))
    payload_learning.PayloadEstimator(load("ur5e"))
    assert called
