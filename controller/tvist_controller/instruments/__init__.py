"""What UR's interfaces tell of a robot beyond its state: computed from it, believable, without clock or I/O."""
