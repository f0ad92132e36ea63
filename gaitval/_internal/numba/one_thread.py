"""One thread of linear algebra, where matrices are small."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread of linear algebra in the block, or in a function that this decorates. Several
    threads round sums differently: a reference, and all that follows from it, would depend on the
    number of processors by 1e-8 rad, which a walk of 20 gait cycles makes 2 cm. And they wait for
    each other at full load: with small matrices, on a busy machine, that took ten to twenty times
    the processor's time of one thread.
    """
    import scipy.linalg  # noqa: F401  a library that is loaded later would not be limited
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    with threadpool_limits(1, "blas"):
        yield
