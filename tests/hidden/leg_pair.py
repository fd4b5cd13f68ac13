# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An exoskeleton and its wearer in MuJoCo, tied or not: torques of one, noisy angles of both.

MuJoCo reads both descriptions itself; straps are its tendons, between centroids that it knows, and
torques are its inverse dynamics. The exoskeleton follows its wearer with less amplitude, late, and
with joints that are not quite aligned, differently in each case.

"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from armid_ros.recording import BagWriter, write_joint_states
import mujoco
import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from tests.hidden.arrays import FloatArray
from tests.hidden.descriptions import side_by_side

EXO, HUMAN = '/exo/joint_states', '/human/joint_states'
#: Links that straps may be on, by what both descriptions call them.
SEGMENTS = ('swing_shank', 'swing_thigh', 'stance_thigh', 'stance_shank')
JOINTS = ('stance_ankle', 'stance_knee', 'stance_hip', 'swing_hip', 'swing_knee', 'swing_ankle')
#: Time of a step forward and back, for slow, medium and fast recordings [s].
PERIODS = (2.6, 1.9, 1.5)
SINGLE_SUPPORT = (0.12, 0.5)
RATE = 1000.0
TORQUE_NOISE, ANGLE_NOISE = 0.5, np.radians(0.05)


@dataclass(frozen=True)
class Straps:
    """
    What ties the two.

    Attributes
    ----------
    segments : tuple of str
        The links with a strap.
    stiffness : float
        Of each [N/m].
    slack : float
        Way that each gives before it pulls [m].

    """

    segments: tuple[str, ...] = ()
    stiffness: float = 0.0
    slack: float = 0.0


@dataclass(frozen=True)
class Walk:
    """Torques of the exoskeleton and angles of both as sensors show them, shapes (N, 6)."""

    t: FloatArray
    exo: FloatArray
    human: FloatArray
    tau: FloatArray


def walks(
    straps: Straps,
    seed: int,
    *,
    seconds: float = 8.0,
    periods: tuple[float, ...] = PERIODS,
    wrong_masses: float = 0.0,
) -> list[Walk]:
    """
    Let a pair step to and fro at several speeds, and measure it.

    Parameters
    ----------
    straps : Straps
        What is hidden.
    seed : int
        Of the fit of the exoskeleton and of the noise.
    seconds : float
        Length of a recording.
    periods : tuple of float
        Time of a step forward and back in each [s].
    wrong_masses : float
        Spread of the true masses of the exoskeleton about those of its description, relative.

    """
    rng = np.random.default_rng(seed)
    scale, delay = rng.uniform(0.975, 0.99), rng.uniform(0.005, 0.012)
    offset = np.radians(rng.uniform(0.2, 0.6, 6) * rng.choice([-1.0, 1.0], 6))
    model = _tied(straps, 1.0 + wrong_masses * rng.uniform(-1.0, 1.0, len(JOINTS)))
    t = np.arange(0.0, seconds, 1.0 / RATE)
    result = []
    for period in periods:
        human = _angles(t, period)
        exo = scale * _angles(t - delay, period) + offset
        tau = _torques(model, t, exo, human)
        noisy = [q + ANGLE_NOISE * rng.normal(size=q.shape) for q in (exo, human)]
        result.append(Walk(t, *noisy, tau + TORQUE_NOISE * rng.normal(size=tau.shape)))
    return result


def write_walk(path: Path, walk: Walk) -> None:
    """Write a bag with the two topics of a pair."""
    stamps = 10**9 + np.rint(walk.t * 1e9).astype(np.int64)
    with BagWriter(path) as writer:
        for topic, q, tau in ((EXO, walk.exo, walk.tau), (HUMAN, walk.human, None)):
            side = topic.split('/')[1]
            names = tuple(f'{side}_{joint}' for joint in JOINTS)
            write_joint_states(writer, topic, names, stamps, q, None, tau)


def description(name: str) -> Path:
    """Return the URDF of one of the two."""
    return Path(str(resources.files('armid_ros.robots').joinpath(name, f'{name}.urdf')))


def _angles(t: FloatArray, period: float) -> FloatArray:
    """Return the joint angles of the wearer, shape (N, 6) [rad]."""
    gait = resources.files('armid_ros.robots').joinpath('human_legs', 'gait.csv').read_text()
    table = np.loadtxt(
        (line for line in gait.splitlines() if line[:1] in '0123456789.'), delimiter=','
    )
    table[-1, 1:3] = table[0, 1:3]
    leg = CubicSpline(np.append(table[:-1, 0], 1.0), table[:, 1:3], bc_type='periodic')
    begin, end = SINGLE_SUPPORT
    phase = begin + (end - begin) / 2.0 * (1.0 - np.cos(2.0 * np.pi * t / period))
    hip, knee = np.radians(leg(phase)).T
    far_hip, far_knee = np.radians(leg((phase + 0.5) % 1.0)).T
    return np.column_stack([knee - hip, knee, hip, far_hip, far_knee, 0.1 * far_knee])


def _tied(straps: Straps, masses: FloatArray) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(
        side_by_side(
            *(description(name).read_text() for name in ('exoskeleton_legs', 'human_legs'))
        )
    )
    for segment in straps.segments:
        tendon = spec.add_tendon(name=segment, springlength=[0.0, straps.slack])
        for side in ('exo', 'human'):
            body = spec.body(f'{side}_{segment}')
            body.add_site(name=f'{side}_{segment}_strap', pos=body.ipos)
            tendon.wrap_site(f'{side}_{segment}_strap')
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    model = spec.compile()
    model.tendon_stiffness[:] = straps.stiffness
    for joint, factor in zip(JOINTS, masses, strict=True):
        body = model.joint(f'exo_{joint}').id
        body = model.jnt_bodyid[body]
        model.body_mass[body] *= factor
        model.body_inertia[body] *= factor
    return model


def _torques(
    model: mujoco.MjModel, t: FloatArray, exo: FloatArray, human: FloatArray
) -> FloatArray:
    """Return the torques that move the exoskeleton so, shape (N, 6) [N m]."""
    data = mujoco.MjData(model)
    names = [f'{side}_{joint}' for side in ('exo', 'human') for joint in JOINTS]
    columns = [model.joint(name).qposadr[0] for name in names]
    curve = make_interp_spline(t, np.hstack([exo, human]), k=5)
    states = [curve(t), curve(t, 1), curve(t, 2)]
    tau = np.empty_like(exo)
    for row in range(len(t)):
        data.qpos[columns], data.qvel[columns], data.qacc[columns] = (s[row] for s in states)
        mujoco.mj_inverse(model, data)
        tau[row] = data.qfrc_inverse[columns[: len(JOINTS)]]
    return tau
