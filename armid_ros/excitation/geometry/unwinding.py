# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whole turns of joints, which change no pose but decide whether an arm can get there.

A joint that may turn twice reaches most poses in two ways, and above a floor one of them is often
cut off: the shoulder would have to swing through the ground.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.schedule import Excitation
from armid_ros.motion import FloatArray
import numpy as np

_TURN = 2.0 * np.pi
#: Samples of the period at which range and torque are looked at.
_SAMPLES = 400
#: Torques that differ by less are the same, as a share of the largest.
_SAME = 1e-6


def unwound(
    excitation: Excitation, arm: ArmModel, limits: Limits, start: FloatArray
) -> Excitation:
    """
    Return an excitation whose joints are as few turns from a start as the limits allow.

    Parameters
    ----------
    excitation : Excitation
        What is to be run.
    arm : ArmModel
        Prior model; where it tells whole turns apart, as springs do, nothing is changed.
    limits : Limits
        Position limits in force.
    start : ndarray, shape (n,)
        Where the arm stands [rad or m].

    """
    trajectory = excitation.trajectory
    turns = _turns(trajectory, limits, start)
    if not turns.any():
        return excitation
    moved = replace(trajectory, q0=trajectory.q0 + _TURN * turns)
    before, after = (arm.joint_torque(path.one_period(_SAMPLES)) for path in (trajectory, moved))
    if np.abs(after - before).max() > _SAME * np.abs(before).max():
        return excitation
    return replace(excitation, trajectory=moved)


def _turns(trajectory: FourierTrajectory, limits: Limits, start: FloatArray) -> FloatArray:
    """Whole turns to add to each joint, shape (n,)."""
    amplitude = trajectory.one_period(_SAMPLES).q
    low, high = amplitude.min(axis=0), amplitude.max(axis=0)
    wanted = np.round((start - 0.5 * (low + high)) / _TURN)
    least = np.ceil((limits.lower - low) / _TURN)
    most = np.floor((limits.upper - high) / _TURN)
    turns = np.clip(wanted, np.minimum(least, 0.0), np.maximum(most, 0.0))
    return np.where(limits.prismatic, 0.0, turns)
