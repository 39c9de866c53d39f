"""How soon an arm can come to rest without vibration, and how far shapers are from it."""
