"""What clients are told: states, truths and stops."""
