# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated arms with elastic joints, and trajectories that make springs identifiable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.reference import Reference
from armid_ros.robots.two_link import ROBOT, two_link_set, TwoLinkParameters, TwoLinkSet
from armid_ros.simulation.controller import MotorControl, VelocityLoop
from armid_ros.simulation.plant import Plant
from armid_ros.simulation.sensors import Sensors
from armid_ros.simulation.simulated_arm import SimulatedArm
from armid_ros.simulation.springs import Elasticity
import numpy as np
import numpy.typing as npt


def two_link_arm(parameters: TwoLinkParameters, robot: Robot | None = None) -> ArmModel:
    """
    Return the shipped elastic two-link arm as an arm model with effects of the catalogue.

    The model does not contain the friction of the links, which the plant adds.

    """
    robot = parameters.body(robot or load_robot(ROBOT))
    springs = make_effect('joint_elasticity', robot)
    springs = springs.with_shape((parameters.spring_damping / parameters.stiffness)[:, np.newaxis])
    arm = ArmModel(robot).with_effect(springs, 1.0 / parameters.stiffness)
    for name, values in (
        ('rotor_inertia', parameters.rotor),
        ('viscous_friction', parameters.joint_motor_damping),
        ('coulomb_friction', parameters.joint_coulomb),
    ):
        arm = arm.with_effect(make_effect(name, robot), values)
    return arm


def two_link_loop(shipped: TwoLinkSet, share: float = 1.0) -> VelocityLoop:
    """Return the velocity loops of the shipped two-link arm, with gains times `share`."""
    # units of the gains are V s/rad and V/rad at the motors
    scale = share * shipped.parameters.torque_per_volt * shipped.parameters.gear
    proportional, integral = (
        scale * np.asarray(shipped.assumptions[name])
        for name in ('proportional_gain', 'integral_gain')
    )
    return VelocityLoop(proportional, integral)


def shipped_arm(robot: Robot) -> tuple[ArmModel, TwoLinkSet | None]:
    """
    Return the arm model of a shipped robot; for the two-link arm, also its parameter set.

    The model has no effects, except for the two-link arm: the springs, friction and drives of that
    arm are in its parameter set 'after'.

    """
    if robot.name != ROBOT:
        return ArmModel(robot), None
    shipped = two_link_set('after')
    return two_link_arm(shipped.parameters, robot), shipped


def elastic_joints(arm: ArmModel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """
    Return the names of elastic joints with rotor inertia, and of elastic joints without.

    A motor without inertia has no independent motion. The twist of its spring follows the load
    without delay.

    """
    action, joints = arm.action(), arm.robot.joints
    if action.transmission is None:
        return (), ()
    rotor = np.zeros(len(joints)) if action.inertia is None else np.diag(action.inertia)
    springs = np.flatnonzero(np.isfinite(action.transmission.stiffness))
    with_rotor = tuple(joints[j] for j in springs if rotor[j] > 0.0)
    return with_rotor, tuple(joints[j] for j in springs if rotor[j] <= 0.0)


def make_simulated_arm(
    arm: ArmModel,
    *,
    rng: np.random.Generator,
    warn: Callable[[str], object],
    drives: TwoLinkSet | None = None,
    gain: float = 1.0,
    dt: float = 1e-3,
    sensors: Sensors | None = None,
    start: npt.ArrayLike | None = None,
) -> SimulatedArm:
    """
    Return a simulated arm; joints with elasticity and rotor inertia are simulated as elastic.

    Parameters
    ----------
    arm : ArmModel
        Arm model.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    warn : callable
        Called with a note if elastic joints are simulated as rigid.
    drives : TwoLinkSet, optional
        Velocity loops, friction of the links and places of the accelerometers of the two-link arm.
        By default, loops are designed from the model of the arm.
    gain : float
        Factor on the gains of the loops of elastic joints.
    dt : float
        Step of plant and loops [s].
    sensors, start
        As for `SimulatedArm`.

    """
    springs, rotorless = elastic_joints(arm)
    if rotorless:
        warn(
            f'{", ".join(rotorless)}: joint_elasticity without rotor_inertia, so no motor moves '
            'independently. All joints are simulated as rigid, with encoders that read the twist '
            'under load; for vibrations, add rotor_inertia'
        )
    if rotorless or not springs:
        return SimulatedArm(Plant(arm, dt=dt), rng=rng, sensors=sensors, start=start)
    if drives is None:
        plant, places = Plant(arm, dt, elasticity=Elasticity()), None
        control = MotorControl.of(plant)
    else:
        elasticity = Elasticity(link_damping=drives.parameters.link_damping)
        plant = Plant(arm, dt, elasticity=elasticity)
        control = MotorControl(two_link_loop(drives), dt)
        places = np.outer(drives.assumptions['accelerometer_radius'], [1.0, 0.0, 0.0])
    loop = VelocityLoop(gain * control.loop.proportional, gain * control.loop.integral)
    return SimulatedArm(
        plant,
        rng=rng,
        controller=replace(control, loop=loop),
        sensors=sensors,
        accelerometers=places,
        start=start,
    )


#: Samples per second of the multisines.
_RATE = 500.0
#: Pause between two experiments [s].
_PAUSE = 1.0

#: Function that returns whether a path, shape (N, n), is allowed.
Clear = Callable[[FloatArray], bool]


def multisine(
    count: int,
    dt: float,
    band: tuple[float, float],
    rms: npt.ArrayLike,
    rng: np.random.Generator,
) -> FloatArray:
    """
    Return one period of random-phase multisine signals with all frequencies of a band.

    Parameters
    ----------
    count : int
        Samples of the period.
    dt : float
        Time between samples [s].
    band : tuple of float
        Lowest and highest frequency [Hz].
    rms : array_like, shape (n,)
        Root mean square of each signal.
    rng : numpy.random.Generator
        Source of the phases.

    Returns
    -------
    ndarray, shape (count, n)

    """
    size = np.asarray(rms, dtype=float)
    frequency = np.fft.rfftfreq(count, dt)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    spectrum = np.zeros((len(frequency), len(size)), dtype=complex)
    spectrum[inside] = np.exp(2j * np.pi * rng.random((int(inside.sum()), len(size))))
    signal = np.fft.irfft(spectrum, count, axis=0)
    return np.asarray(size * signal / np.sqrt(np.mean(signal**2, axis=0)))


def multisine_course(
    robot: Robot, duration: float, torque: float, rng: np.random.Generator, clear: Clear
) -> Reference:
    """
    Return a random reference: moves between poses, each with a multisine torque added.

    Friction keeps its sign during a move. The arm rests between two moves.

    Parameters
    ----------
    robot : Robot
        Robot with the limits.
    duration : float
        Largest duration of the trajectory [s].
    torque : float
        Root mean square of the multisine, as a share of the torque limits.
    rng : numpy.random.Generator
        Source of poses and phases.
    clear : callable
        Function that returns whether a path from pose to pose is allowed.

    Raises
    ------
    TrajectoryError
        If a limit is unknown, the duration is too short for one move, or no pose can be reached.

    """
    limit = _finite(robot, robot.torque_limit, 'torque')
    velocity = _finite(robot, robot.velocity_limit, 'velocity')
    here, parts, stand = robot.middle_pose, [], round(_PAUSE * _RATE)
    still = np.zeros((stand, robot.n_joints))
    samples = stand
    while True:
        there = _next_pose(robot, here, rng, clear, np.zeros(robot.n_joints))
        # share of the velocity limits in a move to another pose during a multisine
        needed = float(np.max(1.875 * np.abs(there - here) / (0.25 * velocity)))
        # shortest duration of an experiment: 4 s
        count = round(max(4.0, needed) * _RATE)
        samples += count + stand
        if samples > duration * _RATE:
            break
        x = np.arange(count)[:, np.newaxis] / count
        q = here + (there - here) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        on_top = np.minimum(1.0, np.minimum(x, 1.0 - x) / 0.05)
        # band of the multisine [Hz]
        tau = on_top * multisine(count, 1.0 / _RATE, (2.0, 100.0), torque * limit, rng)
        parts.append((np.vstack([still + here, q]), np.vstack([still, tau])))
        here = there
    if not parts:
        raise TrajectoryError(
            f'a duration of {duration:g} s is too short: one move with a multisine needs '
            f'{samples / _RATE:.3g} s'
        )
    q = np.vstack([*(part[0] for part in parts), still + here])
    tau = np.vstack([*(part[1] for part in parts), still])
    dq = np.gradient(q, 1.0 / _RATE, axis=0)
    return Reference(robot.joints, np.arange(len(q)) / _RATE, q, dq, None, tau)


def step_course(
    robot: Robot, duration: float, velocity: float, rng: np.random.Generator, clear: Clear
) -> Reference:
    """
    Return a random reference: velocity steps from rest, of single joints and of all joints.

    Parameters
    ----------
    robot : Robot
        Robot with the limits.
    duration : float
        Largest duration of the trajectory [s].
    velocity : float
        Velocity of the steps, as a share of the velocity limits.
    rng : numpy.random.Generator
        Source of the poses.
    clear : callable
        Function that returns whether a path from pose to pose is allowed.

    Raises
    ------
    TrajectoryError
        If a limit is unknown, the duration is too short for one step, or no pose can be reached.

    """
    limit = _finite(robot, robot.velocity_limit, 'velocity')
    n = robot.n_joints
    directions = [*np.eye(n), np.ones(n), (-1.0) ** np.arange(n)]
    t, q, number, length = [0.0, _PAUSE], [robot.middle_pose] * 2, 0, 0.5  # of a step [s]
    while True:
        step = velocity * limit * directions[number % len(directions)] * length
        there = _next_pose(robot, q[-1], rng, clear, step)
        way = float(np.max(np.abs(there - q[-1]) / (velocity * limit)))
        times = t[-1] + np.cumsum([way, _PAUSE, length, _PAUSE])
        if times[-1] > duration:
            break
        t += times.tolist()
        q += [there, there, there + step, there + step]
        number += 1
    if not number:
        raise TrajectoryError(
            f'a duration of {duration:g} s is too short: one step needs {times[-1]:.3g} s'
        )
    return Reference(robot.joints, np.array(t), np.array(q))


def _next_pose(
    robot: Robot, here: FloatArray, rng: np.random.Generator, clear: Clear, beyond: FloatArray
) -> FloatArray:
    """Draw a pose with a collision-free straight line to it, and with room for the next step."""
    middle = robot.middle_pose
    reach, tries = np.pi / 3.0, 1000  # largest distance from the middle [rad or m]; drawn poses
    lower = np.maximum(robot.lower, middle - reach)
    upper = np.minimum(robot.upper, middle + reach)
    room = 0.1 * (upper - lower)
    for _ in range(tries):
        there = rng.uniform(lower + room, upper - room)
        if clear(np.vstack([np.linspace(here, there, 50), there + beyond])):
            return np.asarray(there)
    raise TrajectoryError(
        f'{robot.name}: none of {tries} poses can be reached from the middle of the ranges in a '
        'straight line without bodies coming too close; try another --seed'
    )


def _finite(robot: Robot, limit: FloatArray, quantity: str) -> FloatArray:
    """Return the limits (n,) of a quantity; raise a TrajectoryError if a limit is not finite."""
    for joint, value in zip(robot.joints, limit, strict=True):
        if not np.isfinite(value):
            raise TrajectoryError(
                f'joint {joint}: the description has no {quantity} limit, but a share of it is '
                'needed; add a <limit>'
            )
    return limit
