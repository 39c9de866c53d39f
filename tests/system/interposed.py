"""A wall clock of a served process that is set.

A small library is compiled and loaded into the process before its own (LD_PRELOAD); a file that both sides map
says by how much it is wrong at present. Where there is no C compiler the test is skipped, and says so.
"""

import mmap
import os
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

SOURCE = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

struct wrong { volatile int64_t wall_s; };
static struct wrong none, *wrong = &none;

__attribute__((constructor)) static void look(void) {
    const char *path = getenv("INTERPOSED");
    int file = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file >= 0) {
        void *at = mmap(NULL, sizeof none, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (at != MAP_FAILED) wrong = at;
        close(file);
    }
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int code = real(clock, now);
    if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) now->tv_sec += wrong->wall_s;
    return code;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone) {
    struct timespec its;
    int code = clock_gettime(CLOCK_REALTIME, &its);
    now->tv_sec = its.tv_sec;
    now->tv_usec = its.tv_nsec / 1000;
    return code;
}

time_t time(time_t *where) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (where) *where = now.tv_sec;
    return now.tv_sec;
}

"""


class Interposed:
    """What is wrong with the system as a process sees it; `environment` is the process's."""

    def __init__(self, folder):
        compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
        if compiler is None:
            pytest.skip("no C compiler: the library that stands before the system's cannot be made")
        source, library, shared = folder / "interposed.c", folder / "interposed.so", folder / "wrong"
        source.write_text(SOURCE, encoding="ascii")
        subprocess.run([compiler, "-O1", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
        shared.write_bytes(bytes(8))
        with shared.open("r+b") as file:
            self._wrong = mmap.mmap(file.fileno(), 8)
        self.environment = {"LD_PRELOAD": str(library), "INTERPOSED": str(shared)}

    def set_wall_clock(self, seconds):
        """Set the wall clock this far from where it ought to be [s]."""
        self._wrong[0:8] = struct.pack("=q", seconds)

    def in_force(self, pid):
        """Whether a process has the library."""
        return self.environment["LD_PRELOAD"] in Path(f"/proc/{pid}/maps").read_text(encoding="utf-8")

    def wall_clock_of_a_process(self):
        """What a process of Python's with the library takes for the time [s]."""
        told = subprocess.run(
            ["python3", "-c", "import time; print(time.time())"],
            env={**os.environ, **self.environment},
            capture_output=True,
            check=True,
        )
        return float(told.stdout)
