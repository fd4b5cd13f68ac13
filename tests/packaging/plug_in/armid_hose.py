# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An effect that the catalogue lacks, in a package of its own."""

import armid_ros as ar
from armid_ros.effects import joint_columns


class Hose(ar.Effect):
    """
    A hose along a joint that stiffens as it bends, tau = k q^3.

    Confounded with joint_spring over a small range of positions.

    """

    name = 'hose'
    summary = 'hose that stiffens as it bends'
    quantities = (ar.Quantity('hose_stiffness', 'N m/rad^3', lower=0.0, typical=(0.1, 10.0)),)
    smooth = True

    def columns(self, motion, arm):
        """Return the derivative of the torque by k, dtau/dk = q^3."""
        return joint_columns(self, motion, motion.q**3)
