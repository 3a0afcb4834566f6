"""Connected components and chains of a graph, such as the shells and outlines of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def connected_components(
    count: int, one: NDArray[np.integer], other: NDArray[np.integer]
) -> NDArray[np.int64]:
    """Return the number (count,), from 0, of the connected component that each node belongs to, by
    the numbers (k,) of the two nodes of each edge. A node without edges is a component of its own.
    """
    from scipy.sparse import coo_array, csgraph  # takes a tenth of a second to load

    edges = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(count, count))
    return np.asarray(csgraph.connected_components(edges, directed=False)[1], dtype=np.int64)


def chains(links: NDArray[np.integer]) -> list[list[int]]:
    """Join links (k, 2) between numbered points into chains, each a list of its points.

    Open chains come first. Closed ones repeat their first point at the end.
    """
    beside: dict[int, list[int]] = {}
    for one, other in links.tolist():
        beside.setdefault(one, []).append(other)
        beside.setdefault(other, []).append(one)
    starts = [point for point, others in beside.items() if len(others) == 1]
    found = []
    for start in [*sorted(starts), *sorted(beside)]:
        while beside[start]:
            chain = [start]
            while beside[chain[-1]]:
                here = chain[-1]
                there = beside[here].pop(0)
                beside[there].remove(here)
                chain.append(there)
            found.append(chain)
    return found
