"""UR's own interfaces: doors beside Zenoh's, to the same controller.

Each is a codec and a session without socket or clock; `doors` opens them.
"""
