"""The `tvist` program."""
