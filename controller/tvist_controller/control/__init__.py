"""From shaped references to drive commands."""
