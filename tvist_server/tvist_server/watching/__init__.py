"""A real UR robot that is only watched: its RTDE rows give the ticks, and it is only sent queries."""
