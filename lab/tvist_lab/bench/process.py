"""Resources used by another process."""

import psutil


def cpu_seconds(pid: int) -> float:
    """Processor time used by all threads of a process together [s]."""
    used = psutil.Process(pid).cpu_times()
    return float(used.user + used.system)


def rss_mb(pid: int) -> float:
    """Resident memory of a process [MB]."""
    return float(psutil.Process(pid).memory_info().rss) / 1e6
