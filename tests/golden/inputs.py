# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recordings that the commands are tried on: the arm of the examples in closed-form motion.

Monday, Tuesday: friction that the description lacks. Friday: 0.4 kg at the elbow as well. today_1,
today_2: a spring at the shoulder. log.csv: Monday in degrees and amperes. fleet: two arms with
four bags each, one of them damaged.

"""

from __future__ import annotations

from pathlib import Path
import shutil

import armid_ros as ar
import numpy as np

from benchmarks.multisine import multisine
from benchmarks.real_recordings import EMPS_URDF
from docsite.desk import ARM, FRICTION, LOAD, write_log
from tests.golden.simulated_fleet import generate

SPRING = 'joint_spring@shoulder:spring_stiffness=2'
DAYS = {
    'monday': FRICTION,
    'tuesday': FRICTION,
    'friday': (*FRICTION, LOAD),
    'today_1': (*FRICTION, SPRING),
    'today_2': (*FRICTION, SPRING),
}
_RATE = 200.0  # Hz
_DURATION = 16.0  # s
_NOISE = 0.05  # N m


def lay_out(folder: Path) -> None:
    """Write the description, the bags and the table into a folder."""
    urdf = folder / 'my_arm.urdf'
    shutil.copy(ARM, urdf)
    for seed, (day, effects) in enumerate(DAYS.items()):
        run = recorded(ar.ArmModel.of(urdf, effects=effects), seed)
        ar.write_recording(folder / day, run, robot_description=urdf.read_text())
        if day == 'monday':
            write_log(folder / 'log.csv', run)
    (folder / 'emps.urdf').write_text(EMPS_URDF, encoding='utf-8')
    generate(folder / 'fleet', arms=2, bags=4, changed=0, damaged=1, seconds=12.0)


def recorded(arm: ar.ArmModel, seed: int) -> ar.Recording:
    """Return what noisy sensors record of a motion in closed form."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(_RATE * _DURATION)) / _RATE
    motion = multisine(arm.robot.joints, t, rng, ((0.125, 0.9), (0.4375, 0.4), (0.9375, 0.08)))
    tau = arm.torque(motion) + _NOISE * rng.normal(size=motion.q.shape)
    return ar.Recording(
        joints=arm.robot.joints,
        t=t,
        q=motion.q,
        dq=motion.dq,
        tau=tau,
        start_ns=1_700_000_000 * 10**9,
    )
