"""RTDE packages: size with header (uint16), type (uint8), payload; big-endian. Also the client's side."""
