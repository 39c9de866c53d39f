"""Real-time data exchange, port 30004: clients subscribe to lists of variables at up to 500 Hz, and write others."""
