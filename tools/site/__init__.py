"""The documentation as a site: pages are collected from the repository as they stand, and built by MkDocs."""
