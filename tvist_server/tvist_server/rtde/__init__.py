"""RTDE packages: size including header (uint16), type (uint8), payload; big-endian. And the client's end."""
