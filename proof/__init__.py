"""What proves the project's own claims, and no user runs: `python -m proof` from a checkout."""
