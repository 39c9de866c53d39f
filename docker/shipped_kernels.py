"""Where numba finds the machine code that an image brings."""  # noqa: INP001  a module of the image, no package

from numba.core.caching import UserProvidedCacheLocator


class ShippedKernels(UserProvidedCacheLocator):
    """The cache in `NUMBA_CACHE_DIR`, to be read only.

    numba's own locators pass over a folder they cannot write in; in an image nobody can, and nobody has to.
    """

    def ensure_cache_path(self) -> None:
        """Nothing: the image was built with it."""
