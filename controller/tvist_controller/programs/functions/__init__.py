"""The controller's functions for programs by subject: the public methods of each module's class."""
