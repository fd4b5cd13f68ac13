# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Changes of an arm at work: detection delay, named cause, and intervals.

The simulated humanoid arm is under a controller, with samples at 1 kHz, encoders of 17 bits, and
equal amounts of white and coloured torque noise (0.05 s). It has Stribeck friction and
load-dependent friction that the model lacks, so residuals contain a model error. The arm moves for
a minute and then changes during a motion.

    python -m benchmarks.changes [--draws 4]

"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
import copy
from dataclasses import replace
import sys

from armid_ros.arm import ArmModel
from armid_ros.effects import parse_effect
from armid_ros.estimate import ParameterName
from armid_ros.identification.online.change import Change
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import load_robot
from armid_ros.simulation import Reference, Sensors, simulate, SimulatedArm
from armid_ros.simulation.plant import Plant
import numpy as np
from scipy import signal

from benchmarks.multisine import multisine
from tests.hidden.arrays import smooth_step


def ball(mass: float) -> str:
    """Return the payload parameters of a ball with radius 3 cm, 5 cm from the wrist."""
    own = 0.4 * mass * 0.03**2
    inertia = own + mass * 0.05**2
    return (
        f'payload_m={mass},payload_mz={-0.05 * mass},'
        f'payload_Ixx={inertia},payload_Iyy={inertia},payload_Izz={own}'
    )


RATE = 1000.0
IDENTIFIED = ('viscous_friction:viscous_coefficient=0.08', 'coulomb_friction:coulomb_torque=0.05')
LACKING = (
    'stribeck_friction:stribeck_torque=0.02',
    'load_dependent_friction:load_coefficient=0.01',
)
NOISE = 0.02
#: Time constant of the coloured part of the noise [s].
COLOUR = 0.05
#: Changes, and longest accepted delay of their detection [s].
CHANGES = (
    *(f'payload:{ball(mass)}' for mass in (0.1, 0.3, 1.0)),
    'viscous_friction@elbow_pitch:viscous_coefficient=0.3',
    'coulomb_friction@elbow_pitch:coulomb_torque=0.15',
    'coulomb_friction@shoulder_pitch:coulomb_torque=0.1',
    'viscous_friction@shoulder_roll:viscous_coefficient=0.3',
    'viscous_friction@elbow_pitch:viscous_coefficient=0.08',
    'coulomb_friction@elbow_pitch:coulomb_torque=0.08',
    'coulomb_friction@elbow_pitch:coulomb_torque=0.05',
)
WANTED = 2.0
#: Duration of the motion before and after the change [s].
BEFORE, AFTER = 60.0, 4.0
SENSORS = Sensors(torque_noise=NOISE, resolution=2.0 * np.pi / 2**17)
#: Duration of the fade from rest at the beginning of a motion, and to rest at its end [s].
_RAMP = 3.0

Sample = tuple[float, FloatArray, FloatArray]


def arm_with(*effects: str) -> ArmModel:
    """Return the model of the humanoid arm with given effects."""
    return ArmModel.of('humanoid_arm', effects=effects)


def working_motion(duration: float, speed: float, rng: np.random.Generator) -> Motion:
    """Return a motion of three harmonics per joint that starts and ends at rest."""
    robot = load_robot('humanoid_arm')
    size = rng.uniform(0.3, 1.0, robot.n_joints) * 0.3
    tones = [(0.1 * speed * k, share * size) for k, share in ((1, 1.0), (2, 0.6), (5, 0.2))]
    made = multisine(robot.joints, np.arange(0.0, duration + 1e-9, 0.01), rng, tones)
    t, q, dq, ddq = made.t[:, np.newaxis], made.q, made.dq, made.ddq
    x = np.clip(np.minimum(t, t[-1] - t) / _RAMP, 0.0, 1.0)
    sign = np.where(t < t[-1] / 2.0, 1.0, -1.0) * (x < 1.0) / _RAMP
    fade, slope, bend = smooth_step(x)
    slope, bend = slope * sign, bend * sign**2
    middle = robot.middle_pose
    return Motion(
        robot.joints,
        t[:, 0],
        middle + fade * q,
        fade * dq + slope * q,
        fade * ddq + 2.0 * slope * dq + bend * q,
    )


def coloured(count: int, joints: int, rate: float, rng: np.random.Generator) -> FloatArray:
    """Return first-order autoregressive torque noise, shape (count, joints) [N m]."""
    keep = np.exp(-1.0 / (COLOUR * rate))
    white = np.sqrt(1.0 - keep**2) * rng.normal(size=(count, joints))
    return np.asarray(NOISE * signal.lfilter([1.0], [1.0, -keep], white, axis=0))


def moving_arm(seed: int, duration: float, rate: float = RATE) -> tuple[SimulatedArm, FloatArray]:
    """Return a simulated arm at the start of a motion, and its torque noise for each sample."""
    rng = np.random.default_rng(seed)
    motion = working_motion(duration + _RAMP, 1.0, rng)
    plant = Plant(arm_with(*IDENTIFIED, *LACKING), dt=1.0 / rate)
    simulated = SimulatedArm(plant, rng=rng, sensors=SENSORS, start=motion.q[0])
    simulated.set_trajectory(Reference.of(motion))
    return simulated, coloured(round(duration * rate), len(motion.joints), rate, rng)


def sampled(simulated: SimulatedArm, noise: FloatArray) -> Iterator[Sample]:
    """Advance the simulated arm, and yield time, position and noisy torque of each sample."""
    for more in noise:
        sample = simulated.advance()
        yield sample.t, sample.q, sample.tau + more


def changed(change: str) -> ArmModel:
    """Return the true model of the humanoid arm after a change of its effects."""
    arm = arm_with(*IDENTIFIED, *LACKING)
    return arm.with_effect(*parse_effect(change, arm.robot))


def size(change: str) -> dict[ParameterName, float]:
    """Return the true change of each effect parameter by name."""
    effect, values = parse_effect(change, load_robot('humanoid_arm'))
    names = effect.parameters(load_robot('humanoid_arm'))
    return dict(zip(names, values, strict=True))


def changing(
    change: str, seed: int, before: float = BEFORE, after: float = AFTER, rate: float = RATE
) -> Iterator[Sample]:
    """Yield samples of an arm whose effects change at the time `before` [s]."""
    simulated, noise = moving_arm(seed, before + after, rate)
    count = round(before * rate)
    yield from sampled(simulated, noise[:count])
    simulated.become(changed(change))
    yield from sampled(simulated, noise[count:])


def unchanging(minutes: int, seed: int, rate: float = RATE) -> Iterator[Sample]:
    """Yield samples of an unchanged arm: a new motion each minute, every fifth minute at rest."""
    rng = np.random.default_rng(seed)
    plant = Plant(arm_with(*IDENTIFIED, *LACKING), dt=1.0 / rate)
    for minute in range(minutes):
        speed = rng.uniform(0.5, 2.0)
        motion = Reference.of(working_motion(60.0, speed, rng))
        if minute % 5 == 4:
            motion = Reference(motion.joints, motion.t[[0, -1]], motion.q[[0, -1]])
        duration = 60.0 - 1.0 / rate
        run = simulate(plant, motion, rng=rng, sensors=SENSORS, rate=rate, duration=duration)
        tau = run.tau + coloured(len(run.t), len(motion.joints), rate, rng)
        for t, q, torque in zip(run.t, run.q, tau, strict=True):
            yield 60.0 * minute + t, q, torque


def identifier() -> OnlineIdentifier:
    """Return an online identifier that does not know the values of the arm's effects."""
    nothing = replace(arm_with(*IDENTIFIED, 'torque_offset'), values=())
    return OnlineIdentifier(nothing, rng=np.random.default_rng(0))


def watch(
    samples: Iterator[Sample],
    tell: Callable[[float, Change], None] | None = None,
    online: OnlineIdentifier | None = None,
) -> OnlineIdentifier:
    """Identify online, and call `tell` with time and cause of each detected parameter change."""
    online = online or identifier()
    seen = len(online.changes)
    for t, q, tau in samples:
        online.update(t, q, None, tau)
        if len(online.changes) > seen:
            seen = len(online.changes)
            if tell is not None:
                tell(t, online.changes[-1])
    return online


def outcome(truth: Mapping[ParameterName, float], found: Change) -> str:
    """Return 'named', 'named second' (as a rival) or 'WRONG': the rank of the true cause."""
    if {p for p, value in truth.items() if value} & set(found.size.parameters):
        return 'named'
    among = any(set(rival.parameters) & set(truth) for rival in found.rivals)
    return 'named second' if among else 'WRONG'


def held(truth: Mapping[ParameterName, float], found: Change) -> list[bool]:
    """Return whether the 95 % interval of each changed parameter contains the true value."""
    right = np.array([truth.get(p, 0.0) for p in found.size.parameters])
    lower, upper = found.size.interval().T
    return ((lower <= right) & (right <= upper)).tolist()


def main() -> None:
    """Print detection delay and named cause of each simulated change of the arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--draws', type=int, default=4, help='runs with every change')
    outcomes: Counter[str] = Counter()
    inside: list[bool] = []
    for seed in range(parser.parse_args().draws):
        arm, noise = moving_arm(seed, BEFORE + AFTER)
        count = round(BEFORE * RATE)
        learned = watch(sampled(arm, noise[:count]))
        print(f'draw {seed}: {len(learned.changes)} alarms before the change')
        for change in CHANGES:
            truth = size(change)
            simulated, online = copy.deepcopy((arm, learned))
            simulated.become(changed(change))
            detected: list[tuple[float, Change]] = []
            after = sampled(simulated, noise[count:])
            watch(after, lambda t, c, found=detected: found.append((t, c)), online)
            outcomes[outcome(truth, detected[0][1]) if detected else 'not seen'] += 1
            if detected and outcome(truth, detected[0][1]) == 'named':
                inside += held(truth, detected[0][1])
            print(
                change,
                *(f'  after {t - BEFORE:.2f} s: {found}' for t, found in detected),
                sep='\n',
            )
            sys.stdout.flush()
    print(f'\nafter {BEFORE:g} s of motion, within {AFTER:g} s: {dict(outcomes)}')
    print(f'95 % intervals of sizes that hold the truth: {sum(inside)} of {len(inside)}')


if __name__ == '__main__':
    main()
