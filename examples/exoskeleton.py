# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify springs between an exoskeleton and its wearer, from joint angles and motor torques."""

import armid_ros as ar
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction
from armid_ros.papers.exo.plant.leg_pair import leg_pair, pair_torques, stepping
import numpy as np

pair, rng = leg_pair(), np.random.default_rng(1)
t = np.arange(0.0, 10.0, 0.001)
machine, wearer = stepping(pair, t)
tau = pair_torques(pair, machine, wearer).tau


def measured(motion, tau=None):
    """Return a recording with encoder noise of 0.05 degrees and torque noise of 0.5 N m."""
    q = motion.q + np.radians(0.05) * rng.normal(size=motion.q.shape)
    noisy = None if tau is None else tau + 0.5 * rng.normal(size=tau.shape)
    return ar.Recording(joints=motion.joints, t=t, q=q, tau=noisy, start_ns=10**9)


problem = recorded_interaction_problem(pair, measured(machine, tau), measured(wearer))
found = identify_interaction(problem)
print(f'{found.stiffness[0]:.0f} ± {found.std[0]:.0f} N/m, true {pair.stiffness[0]:.0f} N/m')
