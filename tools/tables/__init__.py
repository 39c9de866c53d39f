"""Documentation pages with measured tables, generated from the `--json` output of commands."""
