# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a diagnosis leaves without a name: learned as a map, and the law that it looks like.

``learn_residual`` learns; what it returns is an arm with the map as an effect, how much of the
residual the map and the law predict, and a table for other programs.

"""

from armid_ros.residual.learn import (
    JointResidual,
    learn_residual,
    lookup_table,
    require_libraries,
    Residual,
    TABLE_FILE,
    WORTH_A_MAP,
)

__all__ = [
    'TABLE_FILE',
    'WORTH_A_MAP',
    'JointResidual',
    'Residual',
    'learn_residual',
    'lookup_table',
    'require_libraries',
]
