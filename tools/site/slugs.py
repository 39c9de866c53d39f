"""Anchors of headings, as forges make them, so that one link works in both places."""

import re


def slug(heading: str, separator: str = "-") -> str:
    """Return a heading's anchor: lower case, without punctuation, `separator` for each space."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", separator)
