"""Groups of things that are linked with each other, such as faces that share edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def linked_groups(
    count: int, one: NDArray[np.integer], other: NDArray[np.integer]
) -> NDArray[np.int64]:
    """Return the number of the group, from 0, that each of `count` things belongs to.

    Args:
        count: number of things (n).
        one, other: (k,) numbers of the two things of each link, in either order.

    Returns:
        (n,) int64; things without links are groups of their own.
    """
    from scipy.sparse import coo_array  # takes a tenth of a second to load
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
