"""Run the same work on many tasks: in processes of this machine, or on a cluster.

`Runner` is the interface, and `Processes` the runner for work of seconds. The runner for work of minutes and more is
`tvist_lab.runners.cluster.Cluster`, which is imported where it is needed.
"""

from tvist_lab.runners.interface import Failed, Outcome, Runner, TaskError, in_order
from tvist_lab.runners.processes import Processes

__all__ = ["Failed", "Outcome", "Processes", "Runner", "TaskError", "in_order"]
