# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motions that people run: sums of sines, point to point, teleoperation, and periodic ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from armid_ros.robots import Robot
import numpy as np
from scipy.signal import cont2discrete, lfilter, ss2tf

from tests.hidden.arrays import FloatArray, sampled, smooth_step
from tests.hidden.lived.chain import Chain
from tests.hidden.machines import position_range

#: Step of all motions [s].
STEP = 1e-3

#: Rest before and after a motion [s].
REST = 0.4

_LARGEST_AMPLITUDE = 1.1  # rad or m

#: Share of the torque limits that the rigid arm may need.
_TORQUE_SHARE = 0.6

#: Natural frequency of the feedback [rad/s] and its damping ratio.
_BANDWIDTH, _DAMPING_RATIO = 25.0, 0.8


@dataclass(frozen=True)
class Path:
    """
    A motion of all joints, consistent to the second derivative.

    Attributes
    ----------
    t : ndarray, shape (N,)
        Time [s], every STEP.
    q, dq, ddq : ndarray, shape (N, n)
        Position, velocity, acceleration.

    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray


@dataclass(frozen=True)
class Room:
    """
    Where and how fast the joints may move.

    Attributes
    ----------
    centre, reach : ndarray, shape (n,)
        Middle of the motion and how far from it [rad or m].
    speed, acceleration : ndarray, shape (n,)
        Largest ones [rad/s, rad/s^2].

    """

    centre: FloatArray
    reach: FloatArray
    speed: FloatArray
    acceleration: FloatArray


def draw_path(
    style: str, robot: Robot, chain: Chain, duration: float, rng: np.random.Generator
) -> Path:
    """
    Draw a motion that the arm has the room and the strength for.

    Parameters
    ----------
    style : str
        Key of STYLES.
    robot : Robot
        Limits.
    chain : Chain
        True bodies.
    duration : float
        From the first to the last moment of motion [s].
    rng : Generator
        Source of randomness.

    """
    haste = rng.uniform(0.35, 0.9)
    for _ in range(60):
        path = STYLES[style](_room(robot, haste, rng), duration, rng)
        rows = slice(None, None, 20)
        tau = chain.torque(path.q[rows], path.dq[rows], path.ddq[rows])
        if np.all(np.abs(tau) < _TORQUE_SHARE * robot.torque_limit):
            return path
        haste *= 0.93
    raise RuntimeError(f'{robot.name}: no {style} motion keeps its torque limits')


def tracked(path: Path, chain: Chain, error: FloatArray) -> Path:
    """
    Return what the arm does where the path is its reference.

    The deviation is that of a second-order loop that friction and gravity push on.

    Parameters
    ----------
    path : Path
        Reference.
    chain : Chain
        True bodies.
    error : ndarray, shape (n,)
        Size of the deviation [rad].

    """
    coarse = np.arange(0, len(path.t), 10)
    load = chain.torque(path.q[coarse], path.dq[coarse], path.ddq[coarse])
    load = load / np.maximum(np.sqrt((load**2).mean(axis=0)), 1e-9)
    dry = np.tanh(path.dq[coarse] / (0.03 * np.abs(path.dq).max(axis=0) + 1e-9))
    push = -error * (0.5 * load + 0.5 * dry)
    push = sampled(path.t, path.t[coarse], push)
    position, velocity, acceleration = _second_order(push - push[0])
    return Path(path.t, path.q + position + push[0], path.dq + velocity, path.ddq + acceleration)


def sines(room: Room, duration: float, rng: np.random.Generator) -> Path:
    """Return sums of sines of frequencies that have no common period."""
    t = _clock(duration)
    n, count = len(room.centre), 5
    rate = 2.0 * np.pi * np.exp(rng.uniform(np.log(0.06), np.log(0.9), (n, count)))
    phase = rng.uniform(0.0, 2.0 * np.pi, (n, count))
    size = rng.normal(size=(n, count)) / np.sqrt(rate)
    angle = t[:, None, None] * rate + phase
    s, c = np.sin(angle), np.cos(angle)
    wave = (size * s).sum(axis=2), (size * rate * c).sum(axis=2), -(size * rate**2 * s).sum(axis=2)
    return _windowed(t, wave, room)


def periodic(room: Room, duration: float, rng: np.random.Generator) -> Path:
    """Return two equal periods of a Fourier series, with run-in and run-out."""
    t = _clock(duration)
    n, count = len(room.centre), int(rng.integers(4, 8))
    rate = 2.0 * np.pi * np.arange(1, count + 1) / ((duration - 2.0 * _RUN) / 2.0)
    cosine, sine = rng.normal(size=(2, n, count))
    angle = np.multiply.outer(t - REST - _RUN, rate)
    c, s = np.cos(angle), np.sin(angle)
    wave = (
        c @ cosine.T + s @ sine.T,
        (c * rate) @ sine.T - (s * rate) @ cosine.T,
        -(c * rate**2) @ cosine.T - (s * rate**2) @ sine.T,
    )
    return _windowed(t, wave, room)


def dwells(room: Room, duration: float, rng: np.random.Generator) -> Path:
    """Return moves from point to point, at rest between them; quintic or trapezoidal."""
    t = _clock(duration)
    n = len(room.centre)
    q, dq, ddq = (np.zeros((len(t), n)) for _ in range(3))
    profile = smooth_step if rng.random() < 0.5 else _trapezoid
    here = room.centre + room.reach * rng.uniform(-0.9, 0.9, n)
    q[:] = here
    now = REST
    while True:
        there = room.centre + room.reach * rng.uniform(-1.0, 1.0, n)
        there = np.where(rng.random(n) < 0.85, there, here)
        way = np.abs(there - here)
        needed = max((2.0 * way / room.speed).max(), np.sqrt(6.0 * way / room.acceleration).max())
        length = max(needed, 0.3) * rng.uniform(1.0, 1.6)
        if now + length > REST + duration:
            return Path(t, q, dq, ddq)
        x = np.clip((t - now) / length, 0.0, 1.0)
        s, ds, dds = (part[:, np.newaxis] for part in profile(x))
        inside = ((t > now) & (t < now + length))[:, np.newaxis]
        q += s * (there - here)
        dq += inside * ds * (there - here) / length
        ddq += inside * dds * (there - here) / length**2
        here, now = there, now + length + rng.uniform(0.15, 1.2)


def wandering(room: Room, duration: float, rng: np.random.Generator) -> Path:
    """Return what a person steers: changes of mind and pauses at odd times in every joint."""
    t = _clock(duration)
    n = len(room.centre)
    aims = np.zeros((len(t), n))
    for j in range(n):
        knots, values, now = [0.0, REST], [0.0, 0.0], REST
        while now < REST + duration:
            now += rng.uniform(0.25, 1.4)
            pause = rng.random() < 0.2
            knots += [now, now + (rng.uniform(0.3, 1.5) if pause else 0.02)]
            values += [0.0 if pause else rng.normal(), 0.0 if pause else rng.normal()]
            now = knots[-1]
        last = REST + duration - 1.2
        kept = [k for k, knot in enumerate(knots) if knot < last]
        times = [*(knots[k] for k in kept), last + 0.1]
        aims[:, j] = np.interp(t, times, [*(values[k] for k in kept), 0.0])
    speed, rate, _ = _second_order(aims, bandwidth=9.0, damping=1.0)
    place = np.zeros_like(speed)
    place[1:] = np.cumsum((speed[1:] + speed[:-1]) / 2.0 * STEP + 0.0, axis=0)
    place[1:] -= np.cumsum(np.diff(rate, axis=0), axis=0) * STEP**2 / 12.0  # Euler-Maclaurin
    scale = np.minimum(
        0.7 * room.speed / np.abs(speed).max(axis=0),
        0.7 * room.acceleration / np.abs(rate).max(axis=0),
    )
    start = rng.uniform(-1.0, 1.0, n)
    x, dx, ddx = (start + place * scale / room.reach, speed * scale / room.reach, rate * scale)
    ddx = ddx / room.reach
    q = room.centre + room.reach * np.sin(x)
    dq = room.reach * np.cos(x) * dx
    ddq = room.reach * (np.cos(x) * ddx - np.sin(x) * dx**2)
    return Path(t, q, dq, ddq)


STYLES: Mapping[str, Callable[[Room, float, np.random.Generator], Path]] = MappingProxyType(
    {'sines': sines, 'dwells': dwells, 'wandering': wandering, 'periodic': periodic}
)

_RUN = 1.3  # s


def _room(robot: Robot, haste: float, rng: np.random.Generator) -> Room:
    lower, upper = position_range(robot)
    reach = np.minimum(0.45 * (upper - lower), _LARGEST_AMPLITUDE)
    reach = reach * rng.uniform(0.5, 1.0, robot.n_joints)
    margin = reach + 0.02 * (upper - lower)
    centre = rng.uniform(lower + margin, upper - margin)
    speed = haste * np.minimum(robot.velocity_limit, 3.0)
    return Room(centre, reach, speed, speed / 0.25)


def _clock(duration: float) -> FloatArray:
    return np.arange(round((duration + 2.0 * REST) / STEP) + 1) * STEP


def _windowed(t: FloatArray, wave: tuple[FloatArray, FloatArray, FloatArray], room: Room) -> Path:
    """Fade a wave in and out, and scale it to the room."""
    end = t[-1] - REST
    rise, fall = np.clip((t - REST) / _RUN, 0.0, 1.0), np.clip((end - t) / _RUN, 0.0, 1.0)
    (a, da, dda), (b, db, ddb) = smooth_step(rise), smooth_step(fall)
    da, dda, db, ddb = da / _RUN, dda / _RUN**2, -db / _RUN, ddb / _RUN**2
    w, dw, ddw = (
        x[:, np.newaxis] for x in (a * b, da * b + a * db, dda * b + 2.0 * da * db + a * ddb)
    )
    f, df, ddf = wave
    q, dq, ddq = w * f, dw * f + w * df, ddw * f + 2.0 * dw * df + w * ddf
    size = np.minimum.reduce(
        [
            room.reach / np.abs(q).max(axis=0),
            room.speed / np.abs(dq).max(axis=0),
            room.acceleration / np.abs(ddq).max(axis=0),
        ]
    )
    return Path(t, room.centre + size * q, size * dq, size * ddq)


def _trapezoid(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a step of constant acceleration, speed and deceleration, a third of the time each."""
    speed = 1.5
    first, last = x < 1.0 / 3.0, x > 2.0 / 3.0
    s = np.where(first, 1.5 * speed * x**2, speed * (x - 1.0 / 6.0))
    s = np.where(last, 1.0 - 1.5 * speed * (1.0 - x) ** 2, s)
    ds = np.where(first, 3.0 * speed * x, np.where(last, 3.0 * speed * (1.0 - x), speed))
    return s, ds, np.where(first, 3.0 * speed, np.where(last, -3.0 * speed, 0.0))


def _second_order(
    push: FloatArray, bandwidth: float = _BANDWIDTH, damping: float = _DAMPING_RATIO
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what a second-order loop makes of an input, and its two derivatives, all (N, n).

    Exact for an input that is linear between the samples and begins at zero.

    """
    a = np.array([[0.0, 1.0], [-(bandwidth**2), -2.0 * damping * bandwidth]])
    b = np.array([[0.0], [bandwidth**2]])
    ad, bd, cd, dd, _ = cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), STEP, method='foh')
    numerator, denominator = ss2tf(ad, bd, cd, dd)
    x, v = (lfilter(row, denominator, push, axis=0) for row in numerator)
    return x, v, bandwidth**2 * (push - x) - 2.0 * damping * bandwidth * v
