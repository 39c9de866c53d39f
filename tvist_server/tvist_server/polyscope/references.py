"""References between the elements of a file saved by PolyScope."""

import re
from collections import Counter
from xml.etree.ElementTree import Element

_STEP = re.compile(r"(\w[\w.]*)(?:\[(\d{1,6})\])?")
_MOST = 100  # longest chain of references; a file may contain endless ones
_LONGEST = 1000  # longest reference [characters]: enough for the deepest element that a file may have


class References:
    """Follows references like `../../Assignment[2]/variable` that PolyScope writes for repeated elements."""

    def __init__(self, root: Element) -> None:
        self._parents: dict[Element, Element] = {}
        self._places: dict[tuple[Element, str, int], Element] = {}
        for parent in root.iter():
            count = Counter[str]()
            for child in parent:
                count[child.tag] += 1
                self._parents[child], self._places[parent, child.tag, count[child.tag]] = parent, child
        self._known: dict[Element, Element | None] = {}

    def target(self, element: Element | None) -> Element | None:
        """Return the end of an element's references (itself if it has none); None if one leads nowhere."""
        passed, found = list[Element](), element
        while found is not None and (reference := found.get("reference")) is not None:
            if found in self._known or len(passed) == _MOST:
                found = self._known.get(found)
                break
            passed.append(found)
            found = self._step(found, reference)
        self._known.update(dict.fromkeys(passed, found))
        return found

    def _step(self, element: Element, reference: str) -> Element | None:
        found: Element | None = element if len(reference) <= _LONGEST else None
        for step in reference.split("/"):
            if found is None:
                return None
            if step == "..":
                found = self._parents.get(found)
                continue
            words = _STEP.fullmatch(step)
            found = None if words is None else self._places.get((found, words[1], int(words[2] or 1)))
        return found
