"""Values that UR's interfaces report beyond the robot's state, computed plausibly from it, without clock or I/O."""
