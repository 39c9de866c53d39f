"""The ways in and out: Zenoh, and in process."""
