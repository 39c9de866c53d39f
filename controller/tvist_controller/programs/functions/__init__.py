"""The controller's functions in programs, by subject: scripts call the public methods of each module's class."""
