"""The robot controller: messages in; replies, states and events out; no clock, socket, thread or log."""
