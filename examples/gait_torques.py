# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Drive a knee of the exoskeleton by its computed torque over a simulated gait cycle."""

from armid_ros.papers.exo.plant.gait_cycle import gait_cycle
from armid_ros.papers.exo.plant.torque_driven import check_cycle
from armid_ros.papers.exo.plant.walkers import walking_pair
import numpy as np

cycle = gait_cycle(walking_pair())
print(f'largest force on the right foot: {cycle.own.feet[:, 0, 1].max():.0f} N')
error = np.degrees(abs(check_cycle(cycle, 'exo_right_knee', 200.0).error).max())
print(f'largest error of the knee at 200 Hz: {error:.3f} deg')
