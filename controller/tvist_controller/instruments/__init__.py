"""Measured and reported values: states, terminals, and variables of UR's interfaces, without clock or I/O."""
