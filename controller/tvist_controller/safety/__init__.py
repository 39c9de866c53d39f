"""Safety: the safety system, monitors, faults, and detection and learning of the payload."""
