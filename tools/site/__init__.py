"""The documentation site: pages are collected from the repository and built by MkDocs."""
