"""UR's own interfaces, connected to the same controller as Zenoh.

Each interface consists of a codec and a session without socket or clock; `interfaces` opens the sockets.
"""
