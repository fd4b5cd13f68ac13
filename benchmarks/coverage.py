# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Coverage of 95 % intervals, over repeats with coloured torque noise and encoder noise.

The arm is simulated, so the true base parameters, effects and torques along another motion are
known. The intervals are those of an identification from a recording, and online.

    python -m benchmarks.coverage [--repeats 500] [--online-repeats 200]

"""

import argparse
import time

from armid_ros.arm import ArmModel
from armid_ros.identification import IdentificationSettings, identify, SignalSettings
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.recording import Recording
import numpy as np
from scipy.signal import lfilter

from benchmarks.multisine import multisine

FRICTION = (
    'viscous_friction:viscous_coefficient=0.08',
    'coulomb_friction:coulomb_torque=0.05',
    'torque_offset:torque_offset=0.02',
)
RATE, SECONDS = 200.0, 20.0
T = np.arange(round(SECONDS * RATE)) / RATE
TORQUE_NOISE = 0.05
HALF_WIDTH = 1.959964


def recorded(motion, tau, rng, encoder, pole):
    """Return a recording with encoder noise [rad] and autoregressive torque noise [N m]."""
    white = rng.normal(size=(len(tau) + 500, tau.shape[1]))
    coloured = lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], white, axis=0)[500:]
    return Recording(
        joints=motion.joints,
        t=motion.t,
        q=motion.q + encoder * rng.normal(size=tau.shape),
        tau=tau + TORQUE_NOISE * coloured,
        source='repeat',
    )


def from_recording(arm, recording):
    """Identify from a recording, and return base parameters and their estimate."""
    settings = IdentificationSettings(signals=SignalSettings(10.0, 4))
    result = identify(arm, [recording], settings, rng=np.random.default_rng(0))
    return result.base, result.estimate


def online(arm, recording):
    """Identify online, sample by sample, and return base parameters and their estimate."""
    identifier = OnlineIdentifier(arm, rng=np.random.default_rng(0))
    for t, q, tau in zip(recording.t, recording.q, recording.tau, strict=True):
        identifier.update(float(t), q, None, tau)
    return identifier.base, identifier.estimate()


def coverage(method, repeats, encoder, pole):
    """Identify repeatedly, and print the share of 95 % intervals that contain the true value."""
    rng = np.random.default_rng(0)
    arm = ArmModel.of('humanoid_arm', effects=FRICTION)
    structure = ArmModel(arm.robot, arm.effects)
    motion, other = (multisine(arm.robot.joints, T, rng) for _ in range(2))
    tau = arm.torque(motion)
    other = other.select(slice(None, None, 20))
    off = {'base parameters': [], 'effects': [], 'predicted torque': []}
    start = time.perf_counter()
    for _ in range(repeats):
        base, estimate = method(structure, recorded(motion, tau, rng, encoder, pole))
        truth = base.values(arm.theta)
        columns = arm.columns(other)[:, :, base.independent]
        flat = columns.reshape(-1, columns.shape[2])
        std = np.sqrt(np.sum((flat @ estimate.covariance) * flat, axis=1))
        error = estimate.values - truth
        off['predicted torque'] += (flat @ error / std).tolist()
        for name, own in zip(estimate.parameters, error / estimate.std, strict=True):
            off['effects' if '_' in name.name else 'base parameters'].append(own)
    print(
        f'{method.__name__}, {repeats} repeats of {SECONDS:g} s, encoder noise {encoder:g} rad, '
        f'torque noise {TORQUE_NOISE:g} N m with pole {pole:g} at {RATE:g} Hz '
        f'({time.perf_counter() - start:.0f} s)'
    )
    for what, errors in off.items():
        share = 100.0 * np.mean(np.abs(errors) <= HALF_WIDTH)
        print(
            f'    {what:18s}{share:6.1f} %  wanted 93 to 97 %   rms error over the stated '
            f'deviation {np.sqrt(np.mean(np.square(errors))):.2f}',
            flush=True,
        )


def main():
    """Print the coverage of intervals from recordings and of online intervals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=500)
    parser.add_argument('--online-repeats', type=int, default=200)
    arguments = parser.parse_args()
    for method, repeats in (
        (from_recording, arguments.repeats),
        (online, arguments.online_repeats),
    ):
        for encoder, pole in ((2e-5, 0.95), (2e-4, 0.95), (0.0, 0.0)):
            if repeats:
                coverage(method, repeats, encoder, pole)


if __name__ == '__main__':
    main()
