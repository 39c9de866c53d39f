"""The library's face: what is exported is documented."""

import inspect

import tvist_shaping


def test_every_class_and_function_that_is_exported_has_a_docstring():
    for name in tvist_shaping.__all__:
        value = getattr(tvist_shaping, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, name
