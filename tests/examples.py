"""How many examples Hypothesis tries: what a test asks for in `make test-all`, fewer in `make test`."""

from hypothesis import settings

FULL, HALF, QUICK, FEWEST = 100, 50, 20, 10

# No deadline: the first example may compile a kernel, and on a busy machine any example can take long.
settings.register_profile("full", max_examples=FULL, deadline=None)
settings.register_profile("half", max_examples=HALF, deadline=None)
settings.register_profile("quick", max_examples=QUICK, deadline=None)


def share(number):
    """This many examples in the profile "full"; in "half" half of them, in "quick" a fifth, but ten at least."""
    return max(min(FEWEST, number), number * settings.default.max_examples // FULL)


def examples(number):
    """Settings with the share of this many examples."""
    return settings(max_examples=share(number))
