"""A UR robot that is moved: a program of ours runs on it and follows set-points that come in RTDE's registers."""
