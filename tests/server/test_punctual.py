"""What the system counts of a thread that waits for a processor."""

import os
import subprocess
import sys
import threading

import pytest

from tvist_server import punctual

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="counted by Linux")


def test_a_thread_knows_how_long_it_has_waited_for_a_processor():
    def wait():
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:  # on the same processor
            while punctual.waited_us() < 1e4:
                pass
            busy.kill()

    thread = threading.Thread(target=wait)
    thread.start()
    thread.join()
