# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find a spring of the real elbow that a MuJoCo model lacks."""

from pathlib import Path

import armid_ros as ar
import mujoco
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')

model = mujoco.MjModel.from_xml_path(str(URDF))
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
model.dof_damping[:] = 0.3
data = mujoco.MjData(model)


def record(plan, source, noise, seed):
    """Return a recording of the torques that make the MuJoCo model follow a plan exactly."""
    motion, tau = plan.motion(200.0), []
    for q, dq, ddq in zip(motion.q, motion.dq, motion.ddq, strict=True):
        data.qpos, data.qvel, data.qacc = q, dq, ddq
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse.copy())
    tau = np.array(tau) + np.random.default_rng(seed).normal(0.0, noise, motion.q.shape)
    return ar.Recording(joints=motion.joints, t=motion.t, q=motion.q, tau=tau, source=source)


plans = [ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10, rng=k) for k in (0, 1)]
simulated = [record(plan, f'simulated {k}', 0.0, k) for k, plan in enumerate(plans)]
model.jnt_stiffness[2] = 3.0  # N m/rad, at rest at q = 0.4
model.qpos_spring[2] = 0.4
real = [record(plan, f'real {k}', 0.03, k) for k, plan in enumerate(plans)]
print(ar.diagnose(URDF, real[0], validate=real[1], against=simulated))
