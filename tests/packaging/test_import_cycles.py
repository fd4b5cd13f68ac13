# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No module needs itself, not even for a type."""

import grimp
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

#: An effect acts on an arm, and an arm is made of effects: types of either name the other.
ARM_AND_EFFECTS = {'armid_ros.arm', 'armid_ros.effects'}


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


def test_the_arm_and_its_effects_are_the_only_circle():
    (circle,) = circles('armid_ros')
    assert {'.'.join(module.split('.')[:2]) for module in circle} == ARM_AND_EFFECTS
