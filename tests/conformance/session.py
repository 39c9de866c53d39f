"""A Zenoh session that knows nothing of our packages."""

import json

import zenoh


def plain_session(endpoint, settings=()):
    """A client's session.

    Args:
        endpoint: Endpoint of a server or router.
        settings: Further settings of Zenoh, by path.
    """
    config = zenoh.Config()
    for path, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "listen/endpoints": [],  # a router would take Zenoh's usual port, which belongs to no test
        "scouting/multicast/enabled": False,
        **dict(settings),
    }.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)
