# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Coverage of 95 % intervals, over repeats with coloured torque noise and encoder noise.

The arm is simulated, so the true base parameters, effects and torques along another motion are
known. The intervals are those that an identification prints,
from a recording and online.

    python -m benchmarks.coverage [--repeats 500] [--online-repeats 200] [--duration 20]

"""

import argparse
from dataclasses import dataclass, field
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import IdentificationSettings, identify, SignalSettings
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.recording import Recording
from armid_ros.robots import load_robot
import numpy as np
from scipy.signal import lfilter

from benchmarks.multisine import multisine

FRICTION = {'viscous_friction': 0.08, 'coulomb_friction': 0.05, 'torque_offset': 0.02}
RATE = 200.0
HALF_WIDTH = 1.959964


@dataclass
class Tally:
    """Hits, errors and stated standard deviations over repeats."""

    hits: list = field(default_factory=list)
    errors: list = field(default_factory=list)
    stated: list = field(default_factory=list)

    def add(self, estimate, truth, std):
        """Add one repeat."""
        self.hits.append(np.abs(estimate - truth) <= HALF_WIDTH * std)
        self.errors.append(estimate - truth)
        self.stated.append(std)

    def line(self, what):
        """Return a row of the table."""
        errors, stated = np.array(self.errors), np.array(self.stated)
        bias = np.abs(errors.mean(axis=0)) / errors.std(axis=0)
        ratio = np.median(np.sqrt(np.mean(stated**2, axis=0)) / errors.std(axis=0))
        low, high = np.percentile(np.mean(self.hits, axis=0), [5, 95])
        return (
            f'    {what:18s}{100 * np.mean(self.hits):6.1f} %  wanted 93 to 97 %   '
            f'one by one {100 * low:.0f} to {100 * high:.0f} %, stated/true deviation '
            f'{ratio:.2f}, bias/deviation {np.median(bias):.2f} (largest {bias.max():.2f})'
        )


def coloured(rng, shape, pole):
    """Return first-order autoregressive noise of unit variance."""
    white = rng.normal(size=(shape[0] + 500, shape[1]))
    return lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], white, axis=0)[500:]


def from_recording(arm, recording):
    """Identify offline; return base parameters and estimate."""
    settings = IdentificationSettings(signals=SignalSettings(10.0, 4))
    result = identify(arm, [recording], settings, rng=np.random.default_rng(0))
    return result.base, result.estimate


def online(arm, recording):
    """Identify sample by sample; return base parameters and estimate."""
    identifier = OnlineIdentifier(arm, rng=np.random.default_rng(0))
    for t, q, tau in zip(recording.t, recording.q, recording.tau, strict=True):
        identifier.update(float(t), q, None, tau)
    return identifier.base, identifier.estimate()


def coverage(identified, repeats, duration, encoder, torque, pole, seed=0):
    """Identify repeatedly and print a table of coverages."""
    rng = np.random.default_rng(seed)
    robot = load_robot('humanoid_arm')
    arm = ArmModel(robot)
    for name, value in FRICTION.items():
        arm = arm.with_effect(make_effect(name, robot), np.full(robot.n_joints, value))
    structure = ArmModel(robot, arm.effects)
    t = np.arange(round(duration * RATE)) / RATE
    motion, other = (multisine(robot.joints, t, rng) for _ in range(2))
    tau = arm.torque(motion)
    other = other.select(slice(None, None, 20))
    tallies = {'base parameters': Tally(), 'effects': Tally(), 'predicted torque': Tally()}
    start = time.perf_counter()
    columns = None
    for _ in range(repeats):
        recording = Recording(
            joints=robot.joints,
            t=motion.t,
            q=motion.q + encoder * rng.normal(size=motion.q.shape),
            tau=tau + torque * coloured(rng, tau.shape, pole),
            source='repeat',
        )
        base, estimate = identified(structure, recording)
        truth = base.values(arm.theta)
        if columns is None:
            columns = arm.columns(other)[:, :, base.independent]
            rigid = np.array(['_' not in p.name for p in estimate.parameters])
        flat = columns.reshape(-1, columns.shape[2])
        std = np.sqrt(np.sum((flat @ estimate.covariance) * flat, axis=1))
        tallies['base parameters'].add(estimate.values[rigid], truth[rigid], estimate.std[rigid])
        tallies['effects'].add(estimate.values[~rigid], truth[~rigid], estimate.std[~rigid])
        tallies['predicted torque'].add(flat @ estimate.values, flat @ truth, std)
    print(
        f'{identified.__name__}, {repeats} repeats of {duration:g} s, torque noise {torque:g} N m '
        f'with pole {pole:g} at {RATE:g} Hz, encoder noise {encoder:g} rad '
        f'({time.perf_counter() - start:.0f} s)'
    )
    for what, tally in tallies.items():
        print(tally.line(what), flush=True)


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=500)
    parser.add_argument('--online-repeats', type=int, default=200)
    parser.add_argument('--duration', type=float, default=20.0)
    arguments = parser.parse_args()
    for identified, repeats in (
        (from_recording, arguments.repeats),
        (online, arguments.online_repeats),
    ):
        for encoder, pole in ((2e-5, 0.95), (2e-4, 0.95), (0.0, 0.0)):
            if repeats:
                coverage(identified, repeats, arguments.duration, encoder, 0.05, pole)


if __name__ == '__main__':
    main()
