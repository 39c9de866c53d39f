"""A UR robot that is watched: its RTDE rows give the ticks, and nothing but questions is sent to it."""
