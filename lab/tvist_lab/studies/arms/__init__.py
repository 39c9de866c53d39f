"""The available arms: what is known of each, and how well its vibration can be suppressed."""
