"""The commands of `tvist log`, one a module: recordings, and other robots' logs."""
