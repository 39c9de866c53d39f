"""A UR robot that is moved: `follow.script` runs on it and follows set-points that come in RTDE's registers."""
