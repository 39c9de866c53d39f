"""A robot controller of ours in front of a hidden robot, with a link between them that delays, jitters and loses."""
