"""Speed of this machine: how many robots it runs, how late their ticks are, and how fast one is computed."""
