"""Programs that the controller runs line by line within the tick."""
