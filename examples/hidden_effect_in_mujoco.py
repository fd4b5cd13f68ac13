# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""MuJoCo hides a spring in the elbow; the diagnosis has to name it from the torques alone."""

from pathlib import Path

import armid_ros as ar
import mujoco
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')

model = mujoco.MjModel.from_xml_path(str(URDF))
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
model.jnt_stiffness[2] = 3.0  # N m/rad, at rest at q = 0.4
model.qpos_spring[2] = 0.4
model.dof_damping[:] = 0.3
data = mujoco.MjData(model)


def record(plan, seed):
    """Return what an ideal servo needs to follow a plan in MuJoCo, with noise."""
    motion, tau = plan.motion(200.0), []
    for q, dq, ddq in zip(motion.q, motion.dq, motion.ddq, strict=True):
        data.qpos, data.qvel, data.qacc = q, dq, ddq
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse.copy())
    noise = np.random.default_rng(seed).normal(0.0, 0.03, motion.q.shape)
    return ar.Recording(
        joints=motion.joints, t=motion.t, q=motion.q, tau=np.array(tau) + noise, source='mujoco'
    )


known = ar.ArmModel.of(URDF, effects='viscous_friction:viscous_coefficient=0.3')
plans = [
    ar.design_excitation(known, duration=12.0, starts=1, iterations=10, rng=k) for k in (0, 1)
]
found = ar.diagnose(known, record(plans[0], 1), validate=record(plans[1], 2))
print(found)
