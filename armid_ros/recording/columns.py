# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings for the columns and units of a recording, and the conversion of a bag to SI."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path
import re

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.recording import PositionRange, Recording
import numpy as np

#: Pairs of joint names, or beginnings of them, in the file and their replacements.
Rules = Sequence[tuple[str, str]]
#: Seconds in a unit of time.
TIME_UNITS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}
#: Settings that apply to tables only; settings of units apply to tables and bags.
_TABLE_SETTINGS = (
    'time',
    'time_unit',
    'rate_hz',
    'position',
    'velocity',
    'effort',
    'temperature',
    'episode',
)
_UNIT_SETTINGS = ('degrees', 'position_scale', 'effort_scale', 'zero', 'gear')
#: Settings that do not apply when a bag is copied.
_NOT_COPIED = (*_UNIT_SETTINGS, 'rename')
#: Command-line options whose name differs from that of the setting.
_OPTIONS = {'rate_hz': '--rate', 'effort_scale': '--effort-scale or --current-gain'}


@dataclass(frozen=True)
class ColumnSettings:
    """
    Columns and units of recorded quantities; settings of None are guessed from the file.

    Attributes
    ----------
    time, position, velocity, effort, temperature : str or None
        Columns: a name, the name of an array, names with commas, or a pattern in which '{}' stands
        for the joint's name or number and '{1..7}' for numbers. 'none' for a quantity that is
        not to be read; of a bag, only temperatures may be 'none'.
    time_unit : str or None
        's', 'ms', 'us' or 'ns'.
    rate_hz : float or None
        Samples per second, for files without a column of time.
    degrees : bool
        Whether positions and velocities are in degrees.
    position_scale, effort_scale : tuple of float
        Factors of the values to rad and N m: one number, or one per joint; for currents the torque
        constants. Empty: by the unit.
    zero : tuple of float
        Offsets added to the converted positions [rad or m], one per joint; empty for none.
    gear : tuple of float
        Gear ratios, motor turns per joint turn, one or one per joint. With gears, positions,
        velocities and efforts are those of the motors. Empty for none.
    coupling : tuple of (str, str, float)
        Motor, other joint, and turns of the motor per turn of that joint, for coupled wrists.
    rename : tuple of (str, str)
        Pairs of joint names, or beginnings of them, in the file and their replacements.
    episode : int or None
        Episode of a LeRobot dataset.

    """

    time: str | None = None
    position: str | None = None
    velocity: str | None = None
    effort: str | None = None
    temperature: str | None = None
    time_unit: str | None = None
    rate_hz: float | None = None
    degrees: bool = False
    position_scale: tuple[float, ...] = ()
    effort_scale: tuple[float, ...] = ()
    zero: tuple[float, ...] = ()
    gear: tuple[float, ...] = ()
    coupling: tuple[tuple[str, str, float], ...] = ()
    rename: tuple[tuple[str, str], ...] = ()
    episode: int | None = None

    def __post_init__(self) -> None:
        """Raise RecordingError for an unknown time unit, a rate <= 0, or missing gear ratios."""
        if self.time_unit is not None and self.time_unit not in TIME_UNITS:
            raise RecordingError(
                f"'{self.time_unit}' is not a unit of time; use {', '.join(TIME_UNITS)}"
            )
        if self.rate_hz is not None and not self.rate_hz > 0.0:
            raise RecordingError(f'the sampling rate is {self.rate_hz} Hz; give a positive rate')
        if self.coupling and not self.gear:
            raise RecordingError('a coupling of motors needs gear ratios; add --gear')


def renamed(name: str, rules: Rules) -> str:
    """Rename a joint by rules (old, new), which replace a complete name or its beginning."""
    for old, new in sorted(rules, key=lambda rule: rule[0] != name):
        if name.startswith(old):
            return new + name[len(old) :]
    return name


def name_in_file(name: str, rules: Rules) -> str:
    """Return the name that a joint has in the file, before `rules` rename the joint."""
    for old, new in sorted(rules, key=lambda rule: rule[1] != name):
        before = old + name[len(new) :]
        if name.startswith(new) and renamed(before, rules) == name:
            return before
    return name


def renaming(joints: Sequence[str], names: Sequence[str]) -> str:
    """Return a rule OLD:NEW that renames `names` of a file to `joints`; '' if there is none."""
    ends = [(name[:end], name[end:]) for name in names for end in range(len(name))]
    # first try rules that replace complete words of a name
    for old, rest in sorted(ends, key=lambda end: not end[0].endswith(('_', '/'))):
        new = joints[0].removesuffix(rest)
        made = {renamed(one, [(old, new)]) for one in names}
        if joints[0].endswith(rest) and made.issuperset(joints):
            return f'{old}:{new}'
    return ''


def number(text: str) -> float:
    """
    Convert text to a float; the text may be a ratio or a multiple of pi: '1798/7', '-pi/2'.

    Raises
    ------
    RecordingError
        If the text is not a number.

    """
    value = 1.0
    try:
        for sign, piece in re.findall('([*/]|^)([^*/]*)', text.replace(' ', '')):
            factor = float(re.sub('^([+-]?)pi$', rf'\g<1>{math.pi!r}', piece))
            value = value / factor if sign == '/' else value * factor
        if not math.isfinite(value):
            raise ValueError(text)
    except (ValueError, ZeroDivisionError):
        raise RecordingError(f"'{text}' is not a number; write 0.5, 1798/7 or -pi/2") from None
    return value


def numbers(text: str | None) -> tuple[float, ...]:
    """Convert numbers separated by commas to floats; empty for an empty text."""
    return tuple(number(part) for part in text.split(',')) if text else ()


def per_joint(values: Sequence[float], joints: Sequence[str], setting: str) -> FloatArray:
    """Return one value per joint, shape (n,), from n values or from one value for all joints."""
    if len(values) not in (1, len(joints)):
        raise RecordingError(
            f'{setting} has {len(values)} values; give one value for all joints, or '
            f'{len(joints)} values for {", ".join(joints)}'
        )
    return np.broadcast_to(np.asarray(values, dtype=float), len(joints)).copy()


def refuse_columns(path: str | Path, settings: ColumnSettings, *, copied: bool = False) -> None:
    """
    Raise RecordingError if the settings of a bag include settings that apply to tables only.

    Parameters
    ----------
    path : str or Path
        The bag.
    settings : ColumnSettings
        Settings of the user.
    copied : bool
        Whether the bag is copied unchanged, so that settings of units and names are not permitted
        either.

    """
    for name in (*_TABLE_SETTINGS, *(_NOT_COPIED if copied else ())):
        if getattr(settings, name) == getattr(ColumnSettings, name):  # unchanged default
            continue
        option = _OPTIONS.get(name, f'--{name.replace("_", "-")}')
        if name in _TABLE_SETTINGS:
            raise RecordingError(
                f'{path}: {option} applies to tables, and this is a bag; remove the option, or '
                'convert the tables to a bag with armid convert'
            )
        raise RecordingError(
            f'{path}: {option} has no effect on a copied bag; use it with the command that reads '
            'the bag'
        )


def in_si(
    recording: Recording, settings: ColumnSettings, slides: Collection[bool] | None = None
) -> Recording:
    """
    Convert a recording to SI units, and from motor side to joint side.

    Parameters
    ----------
    recording : Recording
        Recording in the units of the bag.
    settings : ColumnSettings
        Scales, degrees, gears and zeros.
    slides : collection of bool, optional
        Whether each joint is prismatic; a prismatic joint is never in degrees.

    """
    if not any(getattr(settings, name) for name in _UNIT_SETTINGS):
        return recording
    joints = recording.joints
    turn = per_joint(settings.position_scale or (1.0,), joints, 'the scale of positions')
    if settings.degrees and not settings.position_scale:
        turn = np.where(list(slides or [False] * len(joints)), 1.0, np.pi / 180.0)
    q, dq, tau = recording.q * turn, recording.dq, recording.tau
    dq = None if dq is None else dq * turn
    if tau is not None:
        tau = tau * per_joint(settings.effort_scale or (1.0,), joints, 'the scale of efforts')
    if settings.gear:  # motor = G q, and therefore tau = G^T tau_motor
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
    if not (settings.gear or settings.zero) and len(set(turn)) == 1:  # the unit is known
        for one in recording.others:
            ends = sorted([float(one.lowest * turn[0]), float(one.highest * turn[0])])
            others.append(PositionRange(one.joint, *ends))
    return replace(recording, q=q, dq=dq, tau=tau, others=tuple(others))


def _position(joint: str, joints: Sequence[str]) -> int:
    """Return the index of `joint`, which is a joint name or the number (from 1) of a joint."""
    if joint in joints:
        return list(joints).index(joint)
    if joint.isdigit() and 1 <= int(joint) <= len(joints):
        return int(joint) - 1
    raise RecordingError(
        f"the coupling has the unknown joint '{joint}'; give a name "
        f'of {", ".join(joints)}, or a number from 1 to {len(joints)}'
    )
