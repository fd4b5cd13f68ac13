# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Speed of the simulated arm relative to real time, as a run and sample by sample.

Every arm has rotor inertias, and viscous and Coulomb friction in each joint. It follows a smooth
reference at 1 kHz by computed torque; sensors have noise, quantisation and a delay. The aim is 60
times real time. Times are the smallest processor times of many short repetitions, as on an idle
processor.

"""

from __future__ import annotations

from collections.abc import Callable
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.robots import load_robot, Robot
from armid_ros.simulation import (
    ComputedTorque,
    Plant,
    Reference,
    Sensors,
    simulate,
    SimulatedArm,
)
from armid_ros.simulation.run import SimulatedRun
import numpy as np

from benchmarks.real_recordings import example_robot

REACH = 60.0
SECONDS = 0.5
REPETITIONS = 100


def main() -> None:
    """Print the simulation speed of each arm."""
    panda = str(example_robot('panda_description/urdf/panda.urdf'))
    for name, source in (('humanoid arm, 6 joints', 'humanoid_arm'), ('Panda, 7 joints', panda)):
        report(name, load_robot(source))


def report(name: str, robot: Robot) -> None:
    """Measure the simulation speed of one arm, and print a table."""
    reference, controller = swinging(robot), ComputedTorque(ArmModel(robot))
    plant, rng = Plant(with_friction(robot)), np.random.default_rng(0)
    sensors = Sensors(
        torque_noise=0.05,
        position_noise=1e-6,
        velocity_noise=1e-3,
        resolution=1e-5,
        torque_delay=2,
    )

    def run() -> SimulatedRun:
        return simulate(plant, reference, rng=rng, controller=controller, sensors=sensors)

    stuck = np.mean(run().truth.dq == 0.0)
    streamed = SimulatedArm(
        plant, rng=rng, controller=controller, sensors=sensors, start=reference.q[0]
    )
    times = np.array(repeated(run, 1)) / round(SECONDS / plant.dt)
    factor, usual = plant.dt / times.min(), plant.dt / np.median(times)
    verdict = 'reached' if factor >= REACH else 'NOT reached'
    print(f'{name}: {factor:.1f} x real time, {REACH:.0f} x wanted: {verdict}')
    print(f'  median of the repetitions                          {usual:6.1f} x')
    print(f'  joints at rest, of all samples                     {100 * stuck:6.1f} %')
    for what, seconds in (
        ('simulate(), all in, per 1 ms step', times.min()),
        ('SimulatedArm.advance(1), read every step', min(repeated(streamed.advance, 50))),
        (
            'SimulatedArm.advance(5), read at 200 Hz',
            min(repeated(lambda: streamed.advance(5), 50)),
        ),
    ):
        print(f'  {what:50s} {1e6 * seconds:6.1f} us')


def with_friction(robot: Robot) -> ArmModel:
    """Return the arm with rotor inertias, and with friction of a few % of the torque limits."""
    drive = np.minimum(robot.torque_limit, 100.0)
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), 0.02 * drive)
    arm = arm.with_effect(make_effect('coulomb_friction', robot), 0.03 * drive)
    return arm.with_effect(make_effect('rotor_inertia', robot), 1e-3 * drive)


def swinging(robot: Robot) -> Reference:
    """Return a sinusoidal motion of all joints over a quarter of their position ranges."""
    t = np.linspace(0.0, SECONDS, 26)[:, np.newaxis]
    w = np.linspace(4.0, 8.0, robot.n_joints)
    middle, reach = (robot.upper + robot.lower) / 2, (robot.upper - robot.lower) / 8
    reach = np.minimum(reach, 0.5 * robot.velocity_limit / w)
    q = middle + reach * np.sin(w * t)
    dq, ddq = reach * w * np.cos(w * t), -reach * w**2 * np.sin(w * t)
    return Reference(robot.joints, t[:, 0], q, dq, ddq)


def repeated(call: Callable[[], object], number: int) -> list[float]:
    """Return repeated measurements of the time of a call [s], averaged over `number` calls."""
    times = []
    for _ in range(REPETITIONS):
        start = time.process_time()
        for _ in range(number):
            call()
        times.append((time.process_time() - start) / number)
    return times


if __name__ == '__main__':
    main()
