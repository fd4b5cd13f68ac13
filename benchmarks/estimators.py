# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
All estimators side by side: three real machines, and 100 draws of a simulated arm.

A draw is the humanoid arm with friction along a random multisine of 20 s, with torque noise and
noisy encoders; errors are against the truth, along a motion that was not used. The EMPS is also
simulated with its own controller, as published.

"""

from pathlib import Path
import sys
import tempfile
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import ArmidError
from armid_ros.identification import IdentificationSettings, identify, SignalSettings
from armid_ros.identification.assess.forward import forward_validation, unlimited
from armid_ros.identification.estimators.names import ESTIMATORS
from armid_ros.identification.estimators.side_by_side import compare_methods, ComparisonSettings
from armid_ros.motion import Motion
from armid_ros.recording import read_recording, Recording
from armid_ros.robots import load_robot
from armid_ros.simulation import Controller, Plant, simulate
import numpy as np
from scipy import signal
from scipy.io import loadmat

from benchmarks import real_recordings

FRICTION = 'viscous_friction,coulomb_friction,torque_offset'
DRAWS = 100
#: Position noise [rad] and filters: a good encoder, a poor one, and that with too high a cut-off.
CASES = (
    (1e-5, SignalSettings()),
    (3e-4, SignalSettings()),
    (3e-4, SignalSettings(20.0, 4)),
)
TORQUE_NOISE = 0.05
#: Samples at the beginning that the published errors of the EMPS leave out.
EMPS_BORDER = 49
RATE = 200.0
VALUES = {
    'viscous_friction': 0.08,
    'coulomb_friction': 0.05,
    'torque_offset': 0.02,
    'rotor_inertia': 0.02,
}


def number(value, width=8, digits=3):
    """Return a number, or a dash."""
    return f'{"-":>{width}s}' if value is None else f'{value:{width}.{digits}f}'


def table(title, scores):
    """Print what a comparison found."""
    print(f'{title}\n    method  train %   held %  position  bias %  scatter %    time s')
    for s in scores:
        cells = (s.training, s.held_out, s.position_error, s.bias, s.scatter, s.seconds)
        print(f'    {s.method:5s}', *map(number, cells), s.note[:70])


def halves(recording):
    """Return the first and the second half of a recording."""
    middle = len(recording) // 2
    parts = slice(0, middle), slice(middle, None)
    return [
        Recording(
            joints=recording.joints,
            t=recording.t[part] - recording.t[part][0],
            q=recording.q[part],
            tau=recording.tau[part],
            source=f'{recording.source}, half {k + 1}',
        )
        for k, part in enumerate(parts)
    ]


def compared(title, arm, training, held_out):
    """Compare all on one machine."""
    scores = compare_methods(
        arm, [training], [held_out], ComparisonSettings(ESTIMATORS), clock=time.process_time
    )
    table(title, scores)


class EmpsController(Controller):
    """
    nu = kp kv (q_r - q) - kv dq, at most 10 V, with dq = (q[k] - q[k - 2]) / (2 T).

    The mean of two differences is the filter of the published model; with it the recorded
    positions give the recorded voltage within 0.24 % (3.3 % with a single difference).

    """

    kp, kv, volts, period = 160.18, 243.45, 10.0, 1e-3

    def __init__(self):
        """Begin at rest."""
        self._before = None

    def torque(self, q, dq, desired, feedforward):
        """Return the force of the drive [N]."""
        last, one_before = self._before or (q, q)
        self._before = q, last
        nu = self.kp * self.kv * (desired[0] - q) - self.kv * (q - one_before) / (2 * self.period)
        return real_recordings.EMPS_GAIN * np.clip(nu, -self.volts, self.volts)


def emps_closed_loop(data, arm):
    """
    Simulate the EMPS as controlled; return errors [%] of position and force.

    As published (Simulation_EMPS.m of the data set): 100 |measured - simulated| / |measured| over
    all samples but the first 49, the position behind a Butterworth filter of 100 Hz and order 4
    forwards and backwards, the force as it is.

    """
    raw = loadmat(data / 'emps' / 'DATA_EMPS.mat')
    t, q, qg, vir = (raw[key].ravel().astype(float) for key in ('t', 'qm', 'qg', 'vir'))
    dq = np.gradient(qg, t)
    reference = Motion(('slide',), t - t[0], qg[:, None], dq[:, None], np.gradient(dq, t)[:, None])
    run = simulate(
        Plant(unlimited(arm), hard_stops=False),
        reference,
        rng=np.random.default_rng(0),
        controller=EmpsController(),
    )
    rows = slice(EMPS_BORDER, min(len(q), len(run.t)))
    smooth = signal.filtfilt(*signal.butter(4, 0.2), q)
    force = real_recordings.EMPS_GAIN * vir
    pairs = (smooth[rows], run.truth.q[rows, 0]), (force[rows], run.tau[rows, 0])
    return [100.0 * np.linalg.norm(a - b) / np.linalg.norm(a) for a, b in pairs]


def machines(data):
    """Print the tables of the real machines."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        emps = real_recordings.emps(data, out)
        arm = ArmModel.of(emps.robot, effects=FRICTION)
        first, pulses = (read_recording(bag, joints=arm.robot.joints) for bag in emps.bags)
        compared('EMPS, held out: the pulses', arm, first, pulses)
        print('    with its own controller (published: position 0.0138 %, force 5.85 %)')
        for method in ESTIMATORS:
            found = identify(
                arm, [first], IdentificationSettings(method), rng=np.random.default_rng(0)
            )
            position, force = emps_closed_loop(data, found.arm)
            print(f'    {method:5s} position {position:.4f} %, force {force:.2f} %')
        tx40 = real_recordings.tx40(data, out)
        arm = ArmModel.of(tx40.robot, effects=f'{FRICTION},rotor_inertia,coupled_joint_friction')
        recording = read_recording(tx40.bags[0], joints=arm.robot.joints)
        compared('TX40, second half held out', arm, *halves(recording))
    ur10 = real_recordings.ur10(data)
    arm = ArmModel.of(ur10.robot, effects=f'{FRICTION},rotor_inertia')
    recording = read_recording(ur10.bags[0], joints=arm.robot.joints)
    compared('UR10, second half held out', arm, *halves(recording))


def multisine(joints, duration, rng, amplitude=0.5, base_hz=0.1):
    """Return three harmonics of each joint with random phases, exact to the second derivative."""
    t = np.arange(round(duration * RATE)) / RATE
    w = 2 * np.pi * base_hz * np.array([1.0, 2.0, 5.0])[:, None]
    size = amplitude * np.array([1.0, 0.6, 0.2])[:, None]
    angle = w[None] * t[:, None, None] + rng.uniform(0, 2 * np.pi, (3, len(joints)))
    q, dq, ddq = size * np.sin(angle), size * w * np.cos(angle), -size * w**2 * np.sin(angle)
    return Motion(joints, t, q.sum(axis=1), dq.sum(axis=1), ddq.sum(axis=1))


def drawn(arm, noise, rng):
    """Return a recording of a new motion."""
    motion = multisine(arm.robot.joints, 20.0, rng)
    tau = arm.torque(motion)
    return Recording(
        joints=motion.joints,
        t=motion.t,
        q=motion.q + noise * rng.normal(size=motion.q.shape),
        tau=tau + TORQUE_NOISE * rng.normal(size=tau.shape),
        source='draw',
    )


def simulated(draws):
    """Print error, bias and time of every estimator over draws with encoder noise."""
    robot = load_robot('humanoid_arm')
    arm = ArmModel(robot)
    for name, value in VALUES.items():
        arm = arm.with_effect(make_effect(name, robot), np.full(6, value))
    structure = ArmModel(robot, arm.effects)
    test = multisine(robot.joints, 10.0, np.random.default_rng(12345))
    tau = arm.torque(test)
    size = np.linalg.norm(tau)
    held_out = Recording(joints=test.joints, t=test.t, q=test.q, tau=tau, source='test')
    for noise, signals in CASES:
        errors = {method: [] for method in ESTIMATORS}
        positions, spent, failed = (dict.fromkeys(ESTIMATORS, 0.0) for _ in range(3))
        for draw in range(draws):
            recording = drawn(arm, noise, np.random.default_rng(draw))
            for method in ESTIMATORS:
                begin = time.process_time()
                try:
                    found = identify(
                        structure,
                        [recording],
                        IdentificationSettings(method, signals),
                        rng=np.random.default_rng(0),
                    )
                except ArmidError:
                    failed[method] += 1
                    errors[method].append(None)
                    continue
                spent[method] += time.process_time() - begin
                errors[method].append(found.arm.torque(test) - tau)
                if draw < 10:
                    try:
                        score = forward_validation(
                            found.arm, held_out, found.used, nominal=arm, duration=10.0
                        )
                        positions[method] += score.position_error.max() ** 2 / min(draws, 10)
                    except ArmidError:
                        positions[method] = np.nan
        losses = {
            m: np.array([np.inf if e is None else 100 * np.linalg.norm(e) / size for e in es])
            for m, es in errors.items()
        }
        best = np.argmin([losses[m] for m in ESTIMATORS], axis=0)
        said = 'automatic' if signals.cutoff_hz is None else f'{signals.cutoff_hz:g} Hz'
        print(f'{draws} simulated draws, encoder noise {noise:g} rad, cut-off {said}')
        print('    method  error %   bias %  position    time s   best of  failed')
        for k, method in enumerate(ESTIMATORS):
            made = [e for e in errors[method] if e is not None]
            print(
                f'    {method:5s}',
                number(float(np.median(losses[method]))),
                number(100 * np.linalg.norm(np.mean(made, axis=0)) / size if made else None),
                number(1e3 * float(np.sqrt(positions[method]))),
                number(spent[method] / max(1, len(made))),
                f'{int(np.sum(best == k)):8d} {int(failed[method]):7d}',
                flush=True,
            )


def main():
    """Print all tables; a number of draws may be given."""
    simulated(int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS)
    machines(real_recordings.folder())


if __name__ == '__main__':
    main()
