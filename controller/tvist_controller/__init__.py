"""The robot controller: messages in, replies, states and events out. It has no clock, socket, thread or log."""
