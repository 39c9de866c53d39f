"""The controller: trajectories, TVIST filter, control, session, and the server around them."""
