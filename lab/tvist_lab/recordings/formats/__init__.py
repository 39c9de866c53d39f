"""Readers of log files, one per module; `@reader` registers them, and `read` imports all modules here."""
