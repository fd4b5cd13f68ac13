# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
False and missed reports of mistakes in recordings, and their sensitivity to the limits.

The recordings are of a UR10 and a TX40, if the environment variable ARMID_DATA names their folder,
and of simulated arms whose links are up to a fifth lighter or heavier than described. Mistakes are
made in sound ones. Every limit is made 30 % smaller and larger; a row per limit has the numbers of
suspected sound recordings and of missed mistakes.

    python -m benchmarks.grade

"""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import fields, replace
import os
from pathlib import Path
import tempfile
import time
from unittest import mock

from armid_ros.arm import ArmModel
from armid_ros.identification.assess import hypotheses, mistakes, prediction_error
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.mistakes import find_mistake
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.recording import read_recording, Recording
from armid_ros.robots import load_robot
import numpy as np

from benchmarks import real_recordings
from benchmarks.coverage import FRICTION
from benchmarks.multisine import multisine

#: Limits that decide whether a mistake is reported; the others are limits of grades.
DECIDING = ('poor', 'unusable', 'floor', 'gain', 'free_body', 'torque_factor', 'gravity_change')


def simulated(seed):
    """Return a robot and a recording of an arm that is nearly as described."""
    rng = np.random.default_rng(seed)
    robot = load_robot('humanoid_arm')
    links = robot.rigid_parameters.reshape(-1, 10) * rng.uniform(0.8, 1.2, (6, 1))
    arm = ArmModel.of(robot.with_inertias(links.ravel()), effects=FRICTION)
    motion = multisine(robot.joints, np.arange(0.0, 20.0, 0.005), rng)
    tau = arm.torque(motion)
    tau += 0.02 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
    source = f'simulated {seed}'
    return robot, Recording(joints=robot.joints, t=motion.t, q=motion.q, tau=tau, source=source)


def sound(folder) -> Iterator:
    """Yield robots and recordings without mistakes."""
    yield from (simulated(seed) for seed in range(3))
    if 'ARMID_DATA' in os.environ:
        data = real_recordings.folder()
        for found in (
            real_recordings.ur10(data),
            real_recordings.tx40(data, folder),
            real_recordings.emps(data, folder),
        ):
            robot = load_robot(str(found.robot))
            for bag in found.bags:
                recording = read_recording(bag, joints=robot.joints)
                yield robot, replace(recording, dq=None)


def mistaken(robot, recording) -> Iterator:
    """Yield mistakes in a recording, each with words that its report has to contain."""
    sign = np.where(np.arange(robot.n_joints) == 1, -1.0, 1.0)
    quarter = np.where(np.arange(robot.n_joints) == 2, np.pi / 2, 0.0)
    order = [0, 2, 1, *range(3, robot.n_joints)]
    tenth = round(0.1 / recording.period)
    early, late = slice(0, len(recording.t) - tenth), slice(tenth, None)
    yield 'opposite sign', robot, replace(recording, q=recording.q * sign)
    yield 'the zero of', robot, replace(recording, q=recording.q + quarter)
    yield (
        'exchanged',
        robot,
        replace(recording, q=recording.q[:, order], tau=recording.tau[:, order]),
    )
    yield 'efforts', robot, replace(recording, tau=0.1 * recording.tau)
    yield 'gravity', robot.with_gravity((9.81, 0.0, 0.0)), recording
    yield (
        'later',
        robot,
        replace(recording, t=recording.t[early], q=recording.q[late], tau=recording.tau[early]),
    )


def said_of(robot, recording):
    """Return the report on a mistake in a recording; empty without one."""
    found = find_mistake(robot, recording, conditioning([recording], SignalSettings()))
    return '' if found is None else found.sentence(robot)


def judged(cases, limits):
    """Return the numbers of suspected sound recordings and of missed mistakes."""
    with ExitStack() as stack:
        for module in (hypotheses, mistakes, prediction_error):
            stack.enter_context(mock.patch.object(module, 'LIMITS', limits))
        said = [(expected, said_of(robot, recording)) for expected, robot, recording in cases]
    return (
        sum(bool(text) for expected, text in said if not expected),
        sum(expected not in text for expected, text in said if expected),
    )


def main():
    """Print one row per limit."""
    with tempfile.TemporaryDirectory() as folder:
        clean = list(sound(Path(folder)))
        cases = [('', robot, recording) for robot, recording in clean]
        chosen = [pair for pair in clean if pair[0].n_joints > 2][1:]
        cases += [case for pair in chosen for case in mistaken(*pair)]
        many = len(cases) - len(clean)
        began = time.process_time()
        false, missed = judged(cases, LIMITS)
        cost = (time.process_time() - began) / len(cases)
        print(f'{len(clean)} sound recordings, {many} mistakes; {cost:.2f} s of one core each')
        print(f'{"as they are":30s} suspected {false}, missed {missed}', flush=True)
        known = {part.name for part in fields(LIMITS)}
        assert known.issuperset(DECIDING)
        for name in DECIDING:
            for factor in (0.7, 1.3):
                value = factor * getattr(LIMITS, name)
                false, missed = judged(cases, replace(LIMITS, **{name: value}))
                row = f'{name} {value:.3g}'
                print(f'{row:30s} suspected {false}, missed {missed}', flush=True)


if __name__ == '__main__':
    main()
