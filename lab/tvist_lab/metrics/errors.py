"""What a metric says when there is nothing to measure."""


class NotMeasurableError(ValueError):
    """A figure cannot be taken from this recording; the message is the reason, in words for a person."""
