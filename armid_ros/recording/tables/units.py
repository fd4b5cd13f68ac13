# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a person says of a bag: units and sides are taken, columns and rate refused."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.tables.settings import ColumnSettings, per_joint
import numpy as np

#: Settings that say where a table has what a bag has by itself, and their options.
_WHERE = {
    'time': '--time',
    'time_unit': '--time-unit',
    'rate_hz': '--rate',
    'position': '--position',
    'velocity': '--velocity',
    'effort': '--effort',
    'episode': '--episode',
}
#: Settings that say what numbers mean.
_WHAT = {
    'degrees': '--degrees',
    'position_scale': '--position-scale',
    'effort_scale': '--effort-scale or --current-gain',
    'zero': '--zero',
    'gear': '--gear',
}


def refuse_columns(path: str | Path, settings: ColumnSettings, *, copied: bool = False) -> None:
    """
    Raise a RecordingError where a bag is told which of its columns are what, or its rate.

    Parameters
    ----------
    path : str or Path
        The bag.
    settings : ColumnSettings
        What was said.
    copied : bool
        Whether it is copied as it is, which allows no other units either.

    """
    reasons = dict.fromkeys(
        _WHERE,
        'is for tables, and this is a bag, whose messages have stamps and names; leave it out, or '
        'make a bag of the tables with armid convert',
    )
    if copied:
        reason = 'changes no bag that is copied; give it to the command that reads the bag'
        reasons |= dict.fromkeys(_WHAT, reason)
    for name, reason in reasons.items():
        if getattr(settings, name) != getattr(ColumnSettings, name):  # its default
            raise RecordingError(f'{path}: {(_WHERE | _WHAT)[name]} {reason}')


def in_si(
    recording: Recording, settings: ColumnSettings, slides: Collection[bool] | None = None
) -> Recording:
    """
    Return what a bag holds with its numbers in SI, on the side of the joints.

    Parameters
    ----------
    recording : Recording
        Positions, velocities and efforts as they are in the bag.
    settings : ColumnSettings
        Scales, degrees, gears and zeros.
    slides : collection of bool, optional
        Whether each joint is prismatic, which has no degrees.

    """
    if not any(getattr(settings, name) for name in _WHAT):
        return recording
    joints = recording.joints
    turn = per_joint(settings.position_scale or (1.0,), joints, 'the scale of positions')
    if settings.degrees and not settings.position_scale:
        turn = np.where(list(slides or [False] * len(joints)), 1.0, np.pi / 180.0)
    q, dq, tau = recording.q * turn, recording.dq, recording.tau
    dq = None if dq is None else dq * turn
    if tau is not None:
        tau = tau * per_joint(settings.effort_scale or (1.0,), joints, 'the scale of efforts')
    if settings.gear:  # motor = G q, whence tau = G^T tau_motor
        gear = np.diag(per_joint(settings.gear, joints, 'the gear ratio'))
        for motor, joint, ratio in settings.coupling:
            gear[_position(motor, joints), _position(joint, joints)] = ratio
        inverse = np.linalg.inv(gear)
        q = q @ inverse.T
        dq = None if dq is None else dq @ inverse.T
        tau = None if tau is None else tau @ gear
    if settings.zero:
        q = q + per_joint(settings.zero, joints, 'the zero of positions')
    others: list[PositionRange] = []
    if not (settings.gear or settings.zero) and len(set(turn)) == 1:  # their unit is known
        for one in recording.others:
            ends = sorted([float(one.lowest * turn[0]), float(one.highest * turn[0])])
            others.append(PositionRange(one.joint, *ends))
    return replace(recording, q=q, dq=dq, tau=tau, others=tuple(others))


def _position(joint: str, joints: Sequence[str]) -> int:
    if joint in joints:
        return list(joints).index(joint)
    if joint.isdigit() and 1 <= int(joint) <= len(joints):
        return int(joint) - 1
    raise RecordingError(
        f"a coupling names '{joint}'; there are {', '.join(joints)}, or their numbers from 1"
    )
