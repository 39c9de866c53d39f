"""Speed of this machine: number of robots it can run, lateness of their ticks and processor time per tick."""
