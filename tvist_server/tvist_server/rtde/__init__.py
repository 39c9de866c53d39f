"""RTDE packages: size including header (uint16), type (uint8), payload; big-endian. Also the client's side."""
