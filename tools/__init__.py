"""Maintenance of the project, in no distribution: generated code, the documentation site, releases."""
