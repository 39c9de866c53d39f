"""The library's face: what is exported is listed, documented and told on the reference page."""

import inspect

import tvist_shaping
from tvist_shaping import reference


def test_the_page_is_what_the_docstrings_say():
    assert reference.PAGE.read_text(encoding="utf-8") == reference.page()


def test_every_name_that_is_exported_stands_on_the_page_once():
    told = [name for names in reference.PARTS.values() for name in names]
    assert sorted(told) == sorted(tvist_shaping.__all__)


def test_every_name_that_is_exported_has_a_docstring():
    for name in tvist_shaping.__all__:
        value = getattr(tvist_shaping, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, name
        else:
            assert name in reference.VALUES
