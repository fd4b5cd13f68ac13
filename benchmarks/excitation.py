# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Comparison of designed with random excitations, in two tables.

The humanoid arm on the moon: 12 gravity parameters with the torque noise of the paper's Table 3. A
designed trajectory is compared with un-optimised ones over 20 % of each joint's range (medians of
20), with 3 harmonics in 20 s. The Panda and the UR10: all base parameters with viscous and Coulomb
friction, 20 s, 5 harmonics, a clearance of 1 cm between links, compared with the best of 1000
random feasible trajectories.

"""

import argparse
from dataclasses import replace
import resource
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.excitation import (
    check_limits,
    ClearanceModel,
    design,
    DesignProblem,
    DesignSettings,
    evaluate,
    FourierTrajectory,
    random_feasible,
)
from armid_ros.robots import collision_model, load_robot
import numpy as np

from benchmarks.real_recordings import example_robot

URDF = {
    'panda': 'panda_description/urdf/panda.urdf',
    'ur10': 'ur_description/urdf/ur10_robot.urdf',
}
#: Torque noise of the humanoid arm: RMSE of the paper's Table 3, no load [N m].
LUNAR_NOISE = 1e-3 * np.array([32.64, 39.93, 4.89, 6.79, 0.46, 0.13])
LUNAR_SAMPLES = 200
REPEATS = 200
HELD_OUT = 5
#: Rate of the samples from which all trajectories of 20 s are evaluated [Hz].
RATE = 100.0


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--random', type=int, default=1000, help='random trajectories')
    arguments = parser.parse_args()
    humanoid(arguments.seed)
    for name in URDF:
        arm_table(name, arguments)


def humanoid(seed):
    """Compare a design for the gravity parameters with un-optimised trajectories."""
    robot = load_robot('humanoid_arm', gravity='moon')
    arm = replace(ArmModel(robot), quasi_static=True)
    collision = collision_model(robot)
    rng = np.random.default_rng(seed)
    settings = DesignSettings(
        period=20.0,
        harmonics=3,
        n_periods=1,
        target='gravity',
        speed='medium',
        noise=LUNAR_NOISE,
        rate=LUNAR_SAMPLES / 20.0,
    )
    (result, seconds, cpu) = timed(lambda: design(arm, settings, rng, collision=collision))
    problem = DesignProblem.of(arm, settings, rng)
    clearance = ClearanceModel.of(collision, 0.01)
    plain = [narrow(arm, problem, clearance, rng) for _ in range(20)]
    unseen = [
        random_feasible(arm, problem.limits, 20.0, 3, rng, clearance=clearance).one_period(
            LUNAR_SAMPLES
        )
        for _ in range(HELD_OUT)
    ]
    ours = result.excitation.trajectory
    cond = [evaluate(problem, t).information.condition for t in (ours, *plain)]
    error = [held_out_error(problem, t, unseen, rng) for t in (ours, *plain)]
    dense = result.excitation.motion(100.0)
    limits = len(check_limits(result.limits, dense, arm.torque(dense)))
    print('humanoid arm, moon, 12 gravity parameters     un-optimised   designed   ratio  wanted')
    rows = (('condition number', cond, 6.0), ('held-out error, % of peak', error, 2.0))
    for label, values, wanted in rows:
        median = float(np.median(values[1:]))
        ratio = median / values[0]
        print(f'{label:44s}{median:14.2f}{values[0]:11.2f}{ratio:8.1f}{wanted:8.0f}')
    hits = int(np.sum(clearance.smallest(dense.q, 1.0) < 0.01))
    print(f'limits violated {limits}, samples with less than 1 cm clearance {hits} (wanted 0, 0)')
    print(f'{seconds:.1f} s, {cpu:.1f} s of processor time')


def narrow(arm, problem, clearance, rng):
    """Draw a collision-free trajectory over the middle 20 % of every joint's range."""
    lower, upper = problem.limits.position_range()
    while True:
        a, b = rng.normal(size=(2, len(lower), 3)) * np.arange(1, 4)
        raw = FourierTrajectory(problem.limits.joints, 20.0, np.zeros(len(lower)), a, b)
        q = raw.one_period(400).q
        scaled = raw.scaled(0.2 * (upper - lower) / np.ptp(q, axis=0))
        q = scaled.one_period(400).q
        centre = 0.5 * (lower + upper) - 0.5 * (q.max(axis=0) + q.min(axis=0))
        trajectory = replace(scaled, q0=centre)
        if clearance.smallest(trajectory.one_period(400).q, 0.1).min() > 0.01:
            return trajectory


def held_out_error(problem, trajectory, unseen, rng):
    """Return mean over joints of RMSE / peak against the true torque [%], 200 noise draws."""
    w = problem.columns(trajectory.one_period(LUNAR_SAMPLES))[:, problem.base.independent]
    errors = np.linalg.pinv(w) @ rng.normal(size=(len(w), REPEATS))
    shares = []
    for motion in unseen:
        wrong = problem.columns(motion)[:, problem.base.independent] @ errors
        wrong = wrong.reshape(len(motion), -1, REPEATS) * problem.noise[:, np.newaxis]
        rmse = np.sqrt(np.mean(wrong**2, axis=0)).mean(axis=1)
        shares.append(rmse / np.abs(problem.arm.torque(motion)).max(axis=0))
    return 100.0 * float(np.mean(shares))


def arm_table(name, arguments):
    """Compare designs for one arm with random trajectories."""
    arm = ArmModel(load_robot(str(example_robot(URDF[name]))))
    for effect in ('viscous_friction', 'coulomb_friction'):
        arm = arm.with_effect(make_effect(effect, arm.robot))
    collision = collision_model(arm.robot)
    clearance = ClearanceModel.of(collision, 0.01)
    settings = DesignSettings(period=20.0, harmonics=5, n_periods=1, rate=RATE)
    rng = np.random.default_rng(arguments.seed)
    problem = DesignProblem.of(arm, settings, rng)
    print(f'\n{name}, {problem.base.rank} base parameters with friction')
    print(
        f'{"":34s}{"log det":>9s}{"condition":>11s}{"seconds":>9s}{"cpu s":>8s}'
        f'{"limits":>8s}{"< 1 cm":>8s}   (violations in 20 000 samples)'
    )

    def row(label, motion, seconds, cpu):
        information = problem.information(motion, n_recorded=RATE * 20.0)
        limits = len(check_limits(problem.limits, motion, arm.torque(motion)))
        hits = int(np.sum(clearance.smallest(motion.q, 1.0) < 0.01))
        print(
            f'{label:34s}{information.log_det:9.1f}{information.condition:11.1f}'
            f'{seconds:9.1f}{cpu:8.1f}{limits:8d}{hits:8d}',
            flush=True,
        )

    def draw():
        draws = [
            random_feasible(arm, problem.limits, 20.0, 5, rng, clearance=clearance)
            for _ in range(arguments.random)
        ]
        return draws, [evaluate(problem, one).information for one in draws]

    (draws, found), seconds, cpu = timed(draw)
    for what, key in (('log det', lambda i: -i.log_det), ('condition', lambda i: i.condition)):
        best = draws[int(np.argmin([key(i) for i in found]))]
        row(f'random, best {what} of {arguments.random}', best.one_period(20000), seconds, cpu)
    for label, balance in (('ours, D only (balance 0)', 0.0), ('ours', 1.0)):
        wanted = replace(settings, balance=balance)
        result, seconds, cpu = timed(
            lambda wanted=wanted: design(
                arm, wanted, np.random.default_rng(arguments.seed), collision=collision
            )
        )
        row(label, result.excitation.trajectory.one_period(20000), seconds, cpu)
    print('wanted: both better than the rows above, 30 s on two idle cores, 0 violations')


def timed(work):
    """Return a result, its time [s], and its processor time in all processes [s]."""

    def used():
        kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        return sum(sum(resource.getrusage(kind)[:2]) for kind in kinds)

    start, before = time.perf_counter(), used()
    result = work()
    return result, time.perf_counter() - start, used() - before


if __name__ == '__main__':
    main()
