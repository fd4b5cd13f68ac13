# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No module needs itself, not even for a type."""

import grimp
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def circles(package):
    """Return the sets of modules that import each other, imports for types included."""
    graph = grimp.build_graph(package)
    modules = sorted(graph.modules)
    place = {module: k for k, module in enumerate(modules)}
    pairs = [
        (place[module], place[other])
        for module in modules
        for other in graph.find_modules_directly_imported_by(module)
    ]
    rows, columns = np.array(pairs).T
    matrix = coo_matrix((np.ones(len(pairs)), (rows, columns)), shape=(len(modules),) * 2)
    _, label = connected_components(matrix, directed=True, connection='strong')
    found = [{m for m, own in zip(modules, label, strict=True) if own == k} for k in set(label)]
    return [sorted(circle) for circle in found if len(circle) > 1]


def test_no_module_needs_itself():
    assert circles('armid_ros') == []
