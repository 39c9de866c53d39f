"""Names of the parts of `tvist bench`, which the command line needs before it imports anything else."""

from typing import Literal

PartName = Literal["line", "motion", "programs", "start", "served", "ur", "observers", "memory", "robots"]
