"""How fast it is on this machine, and whether it stays so: each part alone, served robots, and hours of both."""
