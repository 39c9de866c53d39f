"""The controller's functions in programs, by subject: each module has their signatures and a class that runs them."""
