"""UR's own interfaces to the controller: codecs, and sessions without socket or clock; `interfaces` opens sockets."""
