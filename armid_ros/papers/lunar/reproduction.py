# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Experiments of the paper on a 6-DOF humanoid arm, repeated in simulation.

Table 3 is the arm on the moon, Table 4 the arm on the moon with 0.3 kg in the hand, Table 6 the
real arm on Earth. The torque columns are peaks; the percentage is the RMSE as a share of the peak.

The arm of the paper's Table 2 runs one designed trajectory, slowly, with torque noise as large as
the paper's errors. The arm is identified with gravity torques alone, as in the paper, and with the
full dynamics. The description has masses that are 20 % too small. Errors are relative to the true
torque along held-out trajectories. Errors relative to the noisy torque of the run are given as
well, as the paper may have used these.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros import ArmModel
from armid_ros.excitation import (
    ClearanceModel,
    design,
    DesignSettings,
    Excitation,
    Limits,
    random_feasible,
)
from armid_ros.identification.identify import Identification, identify
from armid_ros.identification.rows.regression import Fit
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import collision_model, load_robot, Robot
from armid_ros.simulation import Sensors, simulate
import numpy as np
import scipy.optimize

#: Load in the hand in Table 4 [kg].
LOAD = 0.3


@dataclass(frozen=True, eq=False)
class PaperTable:
    """
    Published torque errors in a table of the paper, with peak torques and torque noise.

    Attributes
    ----------
    number : int
        Its number.
    title : str
        Title of the table.
    robot : str
        Shipped robot that represents the arm.
    gravity : str
        'moon' or 'earth'.
    peak : ndarray, shape (6,)
        Peak torque [N m].
    error : ndarray, shape (6,)
        Torque error of the paper [N m]: RMSE, in Table 6 the mean absolute error.
    noise : ndarray, shape (6,)
        Torque noise of the reproduction [N m]. In Table 6, the noise that the paper measured, as
        mean amplitude; otherwise the RMSE of the paper, as standard deviation.

    """

    number: int
    title: str
    robot: str
    gravity: str
    peak: FloatArray
    error: FloatArray
    noise: FloatArray

    @property
    def uniform(self) -> bool:
        """Whether the table gives mean absolute torque errors instead of rms torque errors."""
        return self.number == 6


TABLES = (
    PaperTable(
        3,
        'on the moon',
        'humanoid_arm',
        'moon',
        1e-3 * np.array([618.66, 608.73, 147.27, 141.64, 7.27, 1.91]),
        1e-3 * np.array([32.64, 39.93, 4.89, 6.79, 0.46, 0.13]),
        1e-3 * np.array([32.64, 39.93, 4.89, 6.79, 0.46, 0.13]),
    ),
    PaperTable(
        4,
        'on the moon, 0.3 kg in the hand',
        'humanoid_arm_loaded',
        'moon',
        1e-3 * np.array([852.91, 806.69, 270.67, 266.12, 9.95, 4.77]),
        1e-3 * np.array([59.60, 36.35, 7.61, 11.46, 0.60, 0.33]),
        1e-3 * np.array([59.60, 36.35, 7.61, 11.46, 0.60, 0.33]),
    ),
    PaperTable(
        6,
        'on Earth',
        'humanoid_arm',
        'earth',
        np.array([3.50, 4.04, 0.87, 0.89, 0.21, 0.16]),
        np.array([0.16, 0.27, 0.05, 0.07, 0.05, 0.04]),
        np.array([0.46, 0.49, 0.18, 0.17, 0.19, 0.16]),
    ),
)


#: Sampling rate of the recording [Hz].
_RATE = 100.0


@dataclass(frozen=True, eq=False)
class MethodErrors:
    """
    Torque errors of a model of the gravity torques alone, or of the full dynamics.

    Attributes
    ----------
    result : Identification
        Result of the method.
    held_out : ndarray, shape (6,)
        Error against the true torque along held-out trajectories [N m]; RMSE, or for Table 6 the
        mean absolute error.
    noisy : ndarray, shape (6,)
        Error against the noisy torque of the run [N m].

    """

    result: Identification
    held_out: FloatArray
    noisy: FloatArray


@dataclass(frozen=True, eq=False)
class Repeated:
    """
    Repetition of a table of the paper in simulation.

    Attributes
    ----------
    table : PaperTable
        The table of the paper.
    joints : tuple of str
        Joints, shoulder first.
    peak : ndarray, shape (6,)
        Largest gravity torque of each joint over all poses [N m].
    peak_run : ndarray, shape (6,)
        Largest torque along the trajectories of the errors [N m].
    methods : tuple of MethodErrors
        With gravity torques alone, and with the full dynamics.
    test : Fit
        First held-out trajectory: true torque, and prediction with gravity torques alone.

    """

    table: PaperTable
    joints: tuple[str, ...]
    peak: FloatArray
    peak_run: FloatArray
    methods: tuple[MethodErrors, ...]
    test: Fit

    @property
    def ratios(self) -> dict[str, FloatArray]:
        """Relative torque errors (6,) by method: percent of peak torque, or over torque noise."""
        (gravity, dynamics), table = self.methods, self.table
        published, unit = 0.01 * table.peak, 0.01 * self.peak_run
        if table.uniform:
            published = unit = table.noise
        return {
            'paper': table.error / published,
            'against_noise': gravity.noisy / unit,
            'weight_alone': gravity.held_out / unit,
            'whole_dynamics': dynamics.held_out / unit,
        }


@dataclass(frozen=True)
class Composite:
    """
    True and identified values of one gravity parameter, without and with the load.

    Attributes
    ----------
    name : str
        Expression of masses and moments, times gravity.
    joint : str
        Joint of the parameter.
    truth, value, std : float
        True value, estimate and standard deviation on the moon without load [N mm].
    loaded_truth, loaded, loaded_std : float
        True value, estimate and standard deviation with the load [N mm].

    """

    name: str
    joint: str
    truth: float
    value: float
    std: float
    loaded_truth: float
    loaded: float
    loaded_std: float


@dataclass(frozen=True)
class Reproduction:
    """
    Repetition of all experiments of the paper in simulation.

    Attributes
    ----------
    repeated : tuple of Repeated
        Tables 3, 4 and 6.
    composites : tuple of Composite
        The minimal gravity parameters.
    load, load_std : float
        Estimated mass of the load from the two runs on the moon, and its standard deviation [kg].

    """

    repeated: tuple[Repeated, ...]
    composites: tuple[Composite, ...]
    load: float
    load_std: float


def reproduce(
    *, seed: int, progress: Callable[[float, str], None] = lambda share, what: None
) -> Reproduction:
    """
    Repeat all experiments of the paper in simulation.

    Parameters
    ----------
    seed : int
        Seed of all random numbers.
    progress : callable, optional
        Callback with the share that is done, 0 to 1, and the name of the step.

    """
    rng = np.random.default_rng(seed)
    nominal = load_robot('humanoid_arm', gravity='moon')
    progress(0.0, 'designing the trajectory')
    collision = collision_model(nominal)
    # slow, as in the paper
    settings = DesignSettings(
        period=60.0,
        speed='slow',
        starts=2,
        candidates=20,
        iterations=60,
        noise=TABLES[0].noise,
        target='gravity',
    )
    run = design(ArmModel(nominal), settings, rng, collision=collision).excitation
    limits, bodies = Limits.of(nominal, speed='slow'), ClearanceModel.of(collision, 0.01)
    tests = [
        Excitation(
            random_feasible(ArmModel(nominal), limits, 60.0, 3, rng, clearance=bodies)
        ).motion(_RATE)
        for _ in range(5)
    ]
    repeated = []
    for index, table in enumerate(TABLES):
        progress(0.5 + index / 6.0, f'table {table.number}')
        repeated.append(_repeat(table, run, tests, np.random.default_rng([seed, table.number])))
    return Reproduction(tuple(repeated), *_compared(repeated[0], repeated[1], rng))


def attainable(robot: Robot, rng: np.random.Generator) -> FloatArray:
    """Return the largest gravity torque of each joint over all poses, shape (n,) [N m]."""
    n = robot.n_joints

    def torque(q: FloatArray) -> FloatArray:
        return inverse_dynamics(robot, Motion.of_states(robot.joints, q, 0.0, 0.0))

    poses = rng.uniform(-np.pi, np.pi, (5000, n))
    sizes = np.abs(torque(poses))
    best = np.zeros(n)
    for joint in range(n):
        for pose in poses[np.argsort(sizes[:, joint])[-3:]]:
            found = scipy.optimize.minimize(
                lambda q, joint=joint: -abs(float(torque(q)[0, joint])), pose
            )
            best[joint] = max(best[joint], -found.fun)
    return best


def _repeat(
    table: PaperTable, run: Excitation, tests: Sequence[Motion], rng: np.random.Generator
) -> Repeated:
    """Simulate the run of a table, identify the arm, and predict the held-out motions."""
    robot = load_robot(table.robot, gravity=table.gravity)
    truth = ArmModel(robot)
    made = simulate(
        truth,
        run.motion(1000.0),
        rng=rng,
        sensors=Sensors(resolution=2 * np.pi / 2**18),  # encoder of 18 bits
        rate=_RATE,
    )
    if table.uniform:
        noise = 2.0 * table.noise * rng.uniform(-1.0, 1.0, made.tau.shape)
    else:
        noise = table.noise * rng.normal(size=made.tau.shape)
    tau, source = made.tau + noise, f'the run of table {table.number}'
    recording = Recording(joints=made.joints, t=made.t, q=made.q, tau=tau, source=source)
    nominal = load_robot('humanoid_arm', gravity=table.gravity)
    # masses of the description relative to the arm
    nominal = nominal.with_inertias(0.8 * nominal.rigid_parameters)
    torques = [truth.torque(motion) for motion in tests]
    methods = []
    for slow in (True, False):
        described = ArmModel(nominal, quasi_static=slow)
        result = identify(described, [recording], rng=np.random.default_rng(0))
        arm = replace(result.arm, quasi_static=slow)
        found = [arm.torque(motion) for motion in tests]
        off = np.concatenate([f - t for f, t in zip(found, torques, strict=True)])
        left = tau - arm.torque(made.truth)
        methods.append(MethodErrors(result, _size(off, table), _size(left, table)))
        if slow:
            shown = found[0]
    return Repeated(
        table,
        robot.joints,
        attainable(robot, rng),
        np.abs(np.concatenate(torques)).max(axis=0),
        tuple(methods),
        Fit(
            'held out',
            tests[0].with_torque(torques[0]),
            np.ones(torques[0].shape, dtype=bool),
            shown,
        ),
    )


def _size(errors: FloatArray, table: PaperTable) -> FloatArray:
    """Return mean absolute or rms torque errors of the joints, (6,), as in the table."""
    if table.uniform:
        return np.asarray(np.mean(np.abs(errors), axis=0))
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))


def _compared(
    bare: Repeated, loaded: Repeated, rng: np.random.Generator
) -> tuple[tuple[Composite, ...], float, float]:
    """Return gravity parameters with and without load; mass of the load and its std [kg]."""
    robots = [load_robot(r.table.robot, gravity='moon') for r in (bare, loaded)]
    theory = ArmModel(robots[0], quasi_static=True).base_parameters(rng)
    gravity = 1e3 * float(np.linalg.norm(robots[0].gravity))
    found = [r.methods[0].result for r in (bare, loaded)]
    truth = [gravity * theory.values(robot.rigid_parameters) for robot in robots]
    values = [gravity * theory.values(one.arm.robot.rigid_parameters) for one in found]
    places = [
        [
            next(
                k
                for k, p in enumerate(one.estimate.parameters)
                if (p.name.split(' ')[0] == name.name.split(' ')[0])
            )
            for name in theory.parameters
        ]
        for one in found
    ]
    stds = [gravity * one.estimate.std[rows] for one, rows in zip(found, places, strict=True)]
    composites = tuple(
        Composite(name.name, name.joint, *map(float, numbers))
        for name, *numbers in zip(
            theory.parameters,
            truth[0],
            values[0],
            stds[0],
            truth[1],
            values[1],
            stds[1],
            strict=True,
        )
    )
    change = (values[1] - values[0]) / gravity
    hand = [j for j, name in enumerate(theory.standard) if name.joint == robots[0].joints[-1]]
    columns = theory.grouping[:, hand[:4]]  # m, mx, my, mz
    covariance = sum(
        one.estimate.covariance[np.ix_(rows, rows)]
        for one, rows in zip(found, places, strict=True)
    )
    weighted = np.linalg.solve(covariance, columns)
    spread = np.linalg.inv(weighted.T @ columns)
    load = spread @ (weighted.T @ change)
    return composites, float(load[0]), float(np.sqrt(spread[0, 0]))
