"""Motion of the robot: activities, numbered motions, streams, guided motions, and their state."""
