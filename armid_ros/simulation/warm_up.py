# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Temperatures of a simulated arm: constant, or a warm-up of first order."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.motion import Motion, Temperatures
import numpy as np


def temperature_course(text: str, n_joints: int, duration: float) -> Temperatures:
    """
    Return joint temperatures over a run, from a text START:END:TIME_CONSTANT.

    Parameters
    ----------
    text : str
        '25' for a constant temperature [degC], or '20:45:600' for a warm-up from 20 to 45 degC
        with a time constant of 600 s; with commas, one for each joint.
    n_joints : int
        Number of joints.
    duration : float
        Length of the run [s].

    Raises
    ------
    ModelError
        If the text is malformed, or is for another number of joints.

    """
    period = 1.0  # of a simulated sensor [s]
    t = np.arange(0.0, duration + period, period)
    columns = []
    try:
        for part in text.split(','):
            first, *rest = (float(number) for number in part.split(':'))
            last, constant = rest or (first, 1.0)
            columns.append(last + (first - last) * np.exp(-t / max(constant, 1e-9)))
        values = np.broadcast_to(np.column_stack(columns), (len(t), n_joints))
    except ValueError:
        raise ModelError(
            f"temperature '{text}' cannot be read: write 25, or 20:45:600 for 20 to 45 degC with "
            f'a time constant of 600 s; or {n_joints} of these with commas, one for each joint'
        ) from None
    return Temperatures(t, values)


def at_temperature(arm: ArmModel, course: Temperatures) -> ArmModel:
    """Return an arm model whose effects follow the given joint temperatures."""
    still = np.zeros_like(course.values)
    return arm.along(Motion(arm.robot.joints, course.t, still, still, still, temperature=course))
