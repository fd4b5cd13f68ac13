# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The residual of a diagnosis: learned as a map, and approximated by a law of few terms.

``learn_residual`` returns an arm with the maps as an effect, and the shares of the residual that
maps and laws predict. ``lookup_table`` returns the maps as a table for other programs.

"""

from armid_ros.residual.learn import (
    learn_residual,
    lookup_table,
    require_libraries,
    Residual,
)
from armid_ros.residual.section import JointResidual

__all__ = [
    'JointResidual',
    'Residual',
    'learn_residual',
    'lookup_table',
    'require_libraries',
]
