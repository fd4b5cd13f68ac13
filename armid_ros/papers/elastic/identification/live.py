# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
All parameters of the two-link arm while it moves, sample by sample at 1 kHz.

With encoders on both sides and accelerometers on the links every term of the equations is
measured, and the parameters are linear in them: the motors' equations from one sample to the next,
as the drives hold their torque so long,

    Jm dv_m / dt + dm v_m + fm sgn(v_m) + kg twist + dg twist' = tau,

and the links' at each sample, M v_l' + h + dl v_l - kg twist - dg twist' = 0. Rows and torques
pass one and the same low-pass filter, and recursive least squares takes them in.

"""

from __future__ import annotations

from typing import NamedTuple

from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.online.recursive import RecursiveLeastSquares
from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.interaction import link_columns
import numpy as np
from scipy.signal import butter, sosfilt

#: Low-pass of rows and torques [Hz]: above the resonances.
CUTOFF = 80.0
#: Samples per second [Hz].
_RATE = 1000.0
#: Samples from one update to the next: rows between are alike.
_STRIDE = 4
#: Samples that the filter takes to forget what was before.
_SETTLING = 50
_PER_JOINT = (
    ('mm gear^2', 'kg m^2'),
    ('kg', 'N m/rad'),
    ('dl', 'N m s/rad'),
    ('dm gear^2', 'N m s/rad'),
    ('dg', 'N m s/rad'),
    ('fm gear', 'N m'),
)


class TwoLinkSample(NamedTuple):
    """
    One reading of all sensors, every array of shape (2,).

    Attributes
    ----------
    motor_q, motor_dq, tau : ndarray
        Of the motors, as seen at the joints [rad, rad/s, N m].
    link_q, link_dq, link_ddq : ndarray
        Of the links; accelerations as ``Accelerometers`` gives them.

    """

    motor_q: FloatArray
    motor_dq: FloatArray
    tau: FloatArray
    link_q: FloatArray
    link_dq: FloatArray
    link_ddq: FloatArray


class OnlineTwoInertia:
    """
    Identify a planar two-link arm with elastic joints while it moves.

    Parameters
    ----------
    joints : tuple of str
        Names of both.

    """

    def __init__(self, joints: tuple[str, ...]) -> None:
        rigid = [ParameterName(name, '', 'kg m^2') for name in ('alpha', 'beta', 'gamma')]
        own = [ParameterName(name, joint, unit) for name, unit in _PER_JOINT for joint in joints]
        self._recursion = RecursiveLeastSquares((*rigid, *own))
        self._sections = butter(2, CUTOFF, fs=_RATE, output='sos')
        self.interrupt()

    @property
    def estimate(self) -> Estimate:
        """Return what is known now."""
        return self._recursion.estimate

    def interrupt(self) -> None:
        """Begin a new stretch of samples, which does not continue the one before."""
        self._before: TwoLinkSample | None = None
        self._state: FloatArray | None = None
        self._count = 0

    def take(self, sample: TwoLinkSample) -> bool:
        """Take in one sample; return whether the estimate is a new one."""
        before, self._before = self._before, sample
        if before is None:
            return False
        table = np.zeros((4, 16))
        table[:2, -1] = before.tau
        _motor_rows(table, before, sample, 1.0 / _RATE)
        # fill the links' equations at a sample
        joints = np.arange(2)
        moved = (part[np.newaxis] for part in (before.link_q, before.link_dq, before.link_ddq))
        table[2:, :3] = link_columns(*moved)[0]
        table[2 + joints, 5 + joints] = -(before.motor_q - before.link_q)
        table[2 + joints, 7 + joints] = before.link_dq
        table[2 + joints, 11 + joints] = -(before.motor_dq - before.link_dq)
        flat = table.reshape(1, -1)
        if self._state is None:
            self._state = np.zeros((len(self._sections), 2, flat.shape[1]))
        passed, self._state = sosfilt(self._sections, flat, axis=0, zi=self._state)
        self._count += 1
        if self._count < _SETTLING or self._count % _STRIDE:
            return False
        rows = passed.reshape(table.shape)
        self._recursion.update(rows[:, :-1], rows[:, -1])
        return True


def _motor_rows(table: FloatArray, before: TwoLinkSample, after: TwoLinkSample, dt: float) -> None:
    """Fill the motors' equations, means from one sample to the next."""
    joints = np.arange(2)
    twist = before.motor_q - before.link_q
    strain = before.motor_dq - before.link_dq
    twist_after = after.motor_q - after.link_q
    strain_after = after.motor_dq - after.link_dq
    mean = (twist + twist_after) / 2.0 + dt / 12.0 * (strain - strain_after)
    sign = (np.sign(before.motor_dq) + np.sign(after.motor_dq)) / 2.0
    columns = (
        (after.motor_dq - before.motor_dq) / dt,
        mean,
        None,
        (after.motor_q - before.motor_q) / dt,
        (twist_after - twist) / dt,
        sign,
    )
    for number, column in enumerate(columns):
        if column is not None:
            table[joints, 3 + 2 * number + joints] = column
