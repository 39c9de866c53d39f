"""The pages of the documentation with measured tables, made from what the commands print with `--json`."""
