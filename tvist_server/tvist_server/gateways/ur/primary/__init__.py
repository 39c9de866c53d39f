"""UR's primary and secondary interface: robot state ten times a second, robot messages, and some script commands."""
