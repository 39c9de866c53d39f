"""How many examples Hypothesis tries: what a test asks for in `make nightly`, fewer and always the same in CI."""

from hypothesis import settings

FULL, QUICK, FEWEST = 100, 20, 10

# No deadline: the first example may compile a kernel, and on a busy machine any example can take long.
settings.register_profile("full", max_examples=FULL, deadline=None)
# No commit fails for examples that were not drawn for the commit before it.
settings.register_profile("quick", max_examples=QUICK, deadline=None, derandomize=True)


def share(number):
    """This many examples in the profile "full"; in "quick" a fifth, but ten at least."""
    return max(min(FEWEST, number), number * settings.default.max_examples // FULL)


def examples(number):
    """Settings with the share of this many examples."""
    return settings(max_examples=share(number))
