"""Command handling: senders' rights, plans, and the parts of a robot that commands act on."""
