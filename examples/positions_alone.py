# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Write two tables of commanded and measured positions of a simulated position-controlled arm."""

from pathlib import Path

import armid_ros as ar
from armid_ros.positions.loop import CommandedMotion, LoopModel, Window
import numpy as np

#: True values: delay of the commands [s]; gains, rotor inertia and friction of each joint.
DELAY, KP, KD, ROTOR, VISCOUS, COULOMB = 0.008, 400.0, 40.0, 0.1, 2.0, 0.5
#: Mass of the tool on each day [kg], its centre and radius [m].
TOOL = {'monday': 0.0, 'friday': 0.4}
CENTER, RADIUS = (0.0, 0.0, 0.1), 0.02

robot = ar.load_robot(Path(__file__).with_name('arm.urdf'))
model, rng = LoopModel(robot), np.random.default_rng(1)
t = np.arange(0.0, 24.0, 0.01)
for day, mass in TOOL.items():
    rates = 2.0 * np.pi * rng.uniform(0.1, 0.6, (4, 1, 3))
    waves = np.sin(rates * t[:, np.newaxis] + rng.uniform(0.0, 6.0, (4, 1, 3)))
    commands = CommandedMotion(t, 0.35 * waves.sum(axis=0), np.zeros((len(t), 3)))
    joints = [np.full(3, value) for value in (KP, KD, ROTOR, VISCOUS, COULOMB)]
    state = np.array([commands.q[0], np.zeros(3), np.zeros(3)])
    window = Window(commands, 0.0, state, t[1:], commands.q[1:])
    parameters = np.concatenate([[DELAY], *joints, [mass, *CENTER, RADIUS]])
    (q,) = model.simulated(parameters, [window])
    noisy = q + 2e-5 * rng.normal(size=q.shape)
    np.savez(f'{day}_positions.npz', t=t[1:], q=noisy, q_des=commands.q[1:])
    print(f'{day}_positions.npz: {len(q)} samples of q and q_des')
