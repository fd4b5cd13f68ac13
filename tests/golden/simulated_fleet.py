# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A simulated fleet with known changes: bags for the tests and the golden results of `armid fleet`.

Arms of one kind differ in mass and friction, and have a different motion in every bag, a bag per
day. Friction varies with the temperature of the day. Some arms change: a step of friction, a
load in the hand, wear of a joint, or an effect that the model lacks. Some bags are damaged.

"""

from __future__ import annotations

import datetime
import json
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.recording import write_recording
from armid_ros.robots import load_robot
import numpy as np

from benchmarks.multisine import multisine

ROBOT = Path(__file__).parents[2] / 'examples' / 'arm.urdf'
EFFECTS = 'viscous_friction,coulomb_friction,torque_offset'
RATE = 200.0
FIRST_DAY = datetime.datetime(2026, 1, 1, 8, tzinfo=datetime.UTC)
#: Frequencies of the motion [Hz] and their sizes [rad].
TONES = ((0.1, 0.5), (0.25, 0.3), (0.55, 0.12))
#: Noise of the torque sensors [N m].
NOISE = np.array([0.05, 0.05, 0.02])
VISCOUS, COULOMB = np.array([0.6, 0.6, 0.3]), np.array([0.5, 0.5, 0.25])
#: Speed below which dry friction decreases, which the model lacks [rad/s].
SLIDING = 0.02
#: Relative standard deviation of viscous friction by the temperature of a day.
TEMPERATURE = 0.01
#: Kinds of changes, and range of their sizes.
CHANGES = {
    'friction': (0.08, 0.3),  # share by which the dry friction of a joint steps up
    'load': (0.05, 0.3),  # mass in the hand [kg]
    'wear': (0.02, 0.06),  # share of its viscous friction that a joint gains a day
    'unmodelled': (0.1, 0.5),  # spring of a cable at a joint [N m/rad]
}


def healthy(rng):
    """Draw an arm: the description with other masses and friction."""
    robot = load_robot(str(ROBOT))
    arm = ArmModel.of(robot, effects=EFFECTS)
    bodies = robot.rigid_parameters.reshape(-1, 10) * rng.normal(1.0, 0.03, (robot.n_joints, 1))
    viscous, coulomb = (base * rng.uniform(0.8, 1.25, 3) for base in (VISCOUS, COULOMB))
    return arm.with_theta(
        np.concatenate([bodies.ravel(), viscous, coulomb, rng.normal(0, 0.1, 3)])
    )


def lived(arm, truth, day, rng):
    """Return the state of an arm on a day."""
    theta = arm.theta.copy()
    rigid = len(arm.robot.rigid_parameters)
    theta[rigid : rigid + 3] *= 1.0 + TEMPERATURE * rng.normal()
    if not truth or day < truth['day']:
        return arm.with_theta(theta)
    joint, size = truth['joint'], truth['size']
    if truth['what'] == 'friction':
        theta[rigid + 3 + joint] *= 1.0 + size
    elif truth['what'] == 'wear':
        theta[rigid + joint] *= 1.0 + size * (day - truth['day'] + 1)
    changed = arm.with_theta(theta)
    if truth['what'] == 'load':
        return changed.with_effect(
            make_effect('payload', arm.robot), [size, 0.0, 0.0, 0.3 * size, 0, 0, 0, 0, 0, 0]
        )
    if truth['what'] == 'unmodelled':
        name = arm.robot.joints[joint]
        return changed.with_effect(make_effect(f'joint_spring@{name}', arm.robot), [size, 0.0])
    return changed


def moved(arm, seconds, rng):
    """Return a motion in closed form with noisy torque."""
    t = np.arange(round(seconds * RATE)) / RATE
    motion = multisine(arm.robot.joints, t, rng, TONES)
    rigid = len(arm.robot.rigid_parameters)
    coulomb = arm.theta[rigid + 3 : rigid + 6]
    soft = coulomb * (np.tanh(motion.dq / SLIDING) - np.sign(motion.dq))
    return motion.with_torque(arm.torque(motion) + soft + NOISE * rng.normal(size=motion.q.shape))


def draw(arms, bags, changed, damaged, seed=0):
    """Return every arm with its change, and the days of its damaged bags."""
    root = np.random.default_rng(seed)
    sick = set(root.choice(arms, changed, replace=False).tolist())
    broken = set(root.choice(arms * bags, damaged, replace=False).tolist())
    kinds, drawn = list(CHANGES), []
    for number in range(arms):
        rng = np.random.default_rng([seed, number])
        arm, event = healthy(rng), None
        if number in sick:
            what = kinds[sum(one[2] is not None for one in drawn) % len(kinds)]
            event = {
                'what': what,
                'joint': int(rng.integers(3)),
                'day': int(rng.integers(bags // 3, max(bags // 3 + 1, 2 * bags // 3))),
                'size': float(rng.uniform(*CHANGES[what])),
            }
        damage = {day for day in range(bags) if number * bags + day in broken}
        drawn.append((f'arm_{number:04d}', arm, event, damage, rng))
    return drawn


def generate(folder, arms, bags, changed, damaged, seconds=60.0, seed=0):
    """Write a fleet and its true changes."""
    drawn = draw(arms, bags, changed, damaged, seed)
    days = [FIRST_DAY + datetime.timedelta(days=day) for day in range(bags)]
    truth = {
        'arms': {name: event for name, _, event, _, _ in drawn if event},
        'damaged': [f'{name}/{days[day].date()}' for name, *_, bad, _ in drawn for day in bad],
    }
    Path(folder).mkdir(parents=True, exist_ok=True)
    Path(folder, 'truth.json').write_text(json.dumps(truth, indent=1))
    for name, arm, event, damage, rng in drawn:
        for day, start in enumerate(days):
            bag = Path(folder, name, start.date().isoformat())
            bag.parent.mkdir(exist_ok=True)
            measured = moved(lived(arm, event, day, rng), seconds, rng)
            write_recording(bag, measured, start_ns=round(start.timestamp() * 1e9))
            if day in damage:
                (file,) = bag.glob('*.mcap')
                file.write_bytes(b'\0' * 4096)
