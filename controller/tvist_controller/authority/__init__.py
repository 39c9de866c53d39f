"""Who may do what: control by lease, the clock, and who is there."""
