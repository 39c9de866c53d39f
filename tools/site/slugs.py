"""Anchors of headings in the style of GitHub and similar sites, so that a link works there and on the site."""

import re


def slug(heading: str, separator: str = "-") -> str:
    """Return a heading's anchor: lower case, without punctuation, `separator` for each space."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", separator)
