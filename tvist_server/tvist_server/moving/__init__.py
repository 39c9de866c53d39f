"""A real UR robot that tvist moves: `follow.script` runs on it and follows set-points from RTDE registers."""
