"""A real UR robot that is only watched: each of its RTDE rows starts a tick; tvist sends it only queries."""
