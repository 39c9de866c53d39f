"""Makes a robot a ROS 2 robot: topics, services and an action, with or without an installed ROS 2."""
