"""UR's own interfaces to the controller that Zenoh's clients use, too.

Each is a codec and a session without socket or clock; `interfaces` opens them.
"""
