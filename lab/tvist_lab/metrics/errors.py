"""Error for recordings from which a metric cannot be computed."""


class NotMeasurableError(ValueError):
    """A metric cannot be computed from this recording; the message gives the reason."""
