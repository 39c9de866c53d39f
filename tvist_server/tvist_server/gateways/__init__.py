"""Gateways: Zenoh, UR's interfaces and the console."""
