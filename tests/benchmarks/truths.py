# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is true of a case that nobody made."""

import numpy as np

from benchmarks.lived_scoring import LivedTruth

EARTH = np.array([0.0, 0.0, -9.81])


def truth(**changes):
    """Return 2 N m of dry friction in the elbow of a UR5, or something else."""
    facts = {
        'key': 'development/1',
        'cause': 'coulomb',
        'size': 'clear',
        'style': 'dwells',
        'arm': 'ur5',
        'name': 'coulomb_friction',
        'joints': ('elbow',),
        'parameters': (('coulomb_torque', 'elbow', 2.0),),
        'in_catalogue': True,
        'gap': 5.0,
        'share_of_power': 0.7,
        'share_of_excess': 0.8,
        'gravity': EARTH,
        'described': EARTH,
    }
    return LivedTruth(**(facts | changes))
