"""The live page: a robot in three dimensions, its plots and its controls, as one more client."""
