"""Readers of log files, a module each; `@reader` registers them, and `read` imports all that are here."""
