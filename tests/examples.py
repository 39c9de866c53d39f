"""Numbers of Hypothesis' examples: in `make nightly` those of each test, in CI fewer and always the same ones."""

from hypothesis import settings

FULL, QUICK, FEWEST = 100, 20, 10

# No deadline: the first example may compile a kernel, and on a busy machine any example can take long.
settings.register_profile("full", max_examples=FULL, deadline=None)
# Fixed examples: a commit cannot fail because of new ones.
settings.register_profile("quick", max_examples=QUICK, deadline=None, derandomize=True)


def share(number):
    """Return the number itself in the profile "full", and a fifth of it in "quick", at least ten."""
    return max(min(FEWEST, number), number * settings.default.max_examples // FULL)


def examples(number):
    """Return settings with the profile's share of this number of examples."""
    return settings(max_examples=share(number))
