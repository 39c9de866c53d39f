"""Where modes, shapers and plants come from."""
