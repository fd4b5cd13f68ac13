# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recorded positions, velocities and torques of joints, and the report on their reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Literal, TYPE_CHECKING

from armid_ros.errors import RecordingError
from armid_ros.motion import (
    FloatArray,
    freeze,
    freeze_samples,
    Motion,
    Samples,
    selected,
    Temperatures,
)
from armid_ros.recording.curves import draw_joints
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

if TYPE_CHECKING:
    from armid_ros.robots.ties import Tie

Clock = Literal['header', 'receive']

#: Number of sampling periods beyond which a time without samples is a gap.
GAP_PERIODS = 5.0


@dataclass(frozen=True)
class TimeGap:
    """
    Time interval without samples in a recording.

    Attributes
    ----------
    t : float
        Time of the last sample before the gap [s], on the time base of the recording.
    length : float
        Duration of the gap [s].

    """

    t: float
    length: float


@dataclass(frozen=True)
class PositionRange:
    """
    Recorded position range of a joint that was not requested, such as a gripper.

    Attributes
    ----------
    joint : str
        Its name.
    lowest, highest : float
        Positions [rad or m].

    """

    joint: str
    lowest: float
    highest: float


@dataclass(frozen=True, eq=False)
class PartnerMotion:
    """
    Positions of a machine that is connected to the arm, at the samples of a recording.

    Attributes
    ----------
    robot : Robot
        Description of the other machine; its base frame is that of the arm.
    ties : tuple of Tie
        Ties that may connect the two machines.
    q : ndarray, shape (N, m)
        Its joint positions [rad or m].

    """

    robot: Robot
    ties: tuple[Tie, ...]
    q: FloatArray

    def __post_init__(self) -> None:
        """Make the positions read-only."""
        freeze(self, 'q')


@dataclass(frozen=True)
class ReadReport:
    """
    Counts of messages and samples that were dropped or repaired when a file was read.

    Attributes
    ----------
    messages : int
        JointState messages on the topic.
    samples : int
        Samples of the recording.
    merged : int
        Samples merged from messages that each hold some of the joints.
    interpolated : int
        Merged samples with some joints interpolated in time, because stamps of messages differ.
    incomplete : int
        Samples dropped because some joints were not measured around their time.
    duplicates : int
        Messages dropped because they repeat the stamp of an earlier message.
    out_of_order : int
        Messages with an earlier stamp than a previous message; they are sorted by time.
    restarted : int
        Messages dropped because the clock jumped back. The longest stretch between jumps is kept.
    nan : int
        Samples dropped because a position, velocity or torque is not finite.
    not_finite : tuple of str
        Quantities that are not finite, and in how many samples: 'effort of wrist in 10'.
    malformed : int
        Messages dropped because they cannot be decoded, or have arrays of the wrong length.
    unstamped : int
        Messages dropped because their header stamp is zero or far from those of their neighbours.
    gaps : tuple of TimeGap
        Stretches of more than five sampling periods without a sample.
    absent : tuple of str
        Quantities that were not recorded, of all joints or of some: 'effort of wrist'.
    unwrapped : tuple of str
        Joints from whose positions jumps by whole turns were removed.
    clock_note : str
        Why the receive time was used; empty if the header time was used.
    damage : str
        Damage of the file; empty if it is undamaged.

    """

    messages: int = 0
    samples: int = 0
    merged: int = 0
    interpolated: int = 0
    incomplete: int = 0
    duplicates: int = 0
    out_of_order: int = 0
    restarted: int = 0
    nan: int = 0
    malformed: int = 0
    unstamped: int = 0
    not_finite: tuple[str, ...] = ()
    gaps: tuple[TimeGap, ...] = ()
    absent: tuple[str, ...] = ()
    unwrapped: tuple[str, ...] = ()
    clock_note: str = ''
    damage: str = ''

    @property
    def clean(self) -> bool:
        """Whether every message became a sample and every quantity was recorded."""
        return self == ReadReport(messages=self.messages, samples=self.samples)

    @property
    def unharmed(self) -> bool:
        """Whether no sample was dropped or repaired, even if quantities are missing."""
        return replace(self, absent=(), unwrapped=()).clean

    def describe(self) -> str:
        """Return the report as a few sentences."""
        whose = f' ({", ".join(self.not_finite)})' if self.not_finite else ''
        sentences = [f'{self.samples} samples from {self.messages} messages']
        counted = (
            (self.merged, 'merged from messages with some of the joints each'),
            (self.interpolated, 'of the merged samples interpolated in time'),
            (self.incomplete, 'dropped because some joints were not measured'),
            (self.duplicates, 'dropped because of a repeated stamp'),
            (self.out_of_order, 'out of order and sorted by time'),
            (self.restarted, 'dropped because the clock jumped back'),
            (self.nan, f'dropped because of values that are not finite{whose}'),
            (self.malformed, 'dropped because the message is malformed'),
            (self.unstamped, 'dropped because of a missing stamp'),
        )
        sentences += [f'{count} {reason}' for count, reason in counted if count]
        text = ', '.join(sentences) + '.'
        if self.gaps:
            longest = max(self.gaps, key=lambda gap: gap.length)
            number = f'{len(self.gaps)} gaps' if len(self.gaps) > 1 else '1 gap'
            text += f' {number}, the longest {longest.length:.3g} s at {longest.t:.3f} s.'
        if self.absent:
            text += f' Not recorded: {", ".join(self.absent)}.'
        if self.unwrapped:
            text += f' Jumps by full turns removed: {", ".join(self.unwrapped)}.'
        if self.clock_note:
            text += f' The time of reception is used, because {self.clock_note}.'
        if self.damage:
            text += f' {self.damage[0].upper()}{self.damage[1:]}.'
        return text


@dataclass(frozen=True, kw_only=True, repr=False)
class Recording:
    """
    Recorded joint measurements of one arm.

    Attributes
    ----------
    joints : tuple of str
        Joint names in column order, n of them.
    t : ndarray, shape (N,)
        Time since the first sample [s], strictly increasing.
    q : ndarray, shape (N, n)
        Positions [rad or m].
    dq, tau : ndarray, shape (N, n), or None
        Velocities and actuator torques [N m] or forces [N]; None when not every joint has them.
    start_ns : int
        Stamp of the first sample [ns since the epoch of the clock].
    source : str
        Bag that the recording was read from; empty if it was made in memory.
    topic : str
        Name of the JointState topic.
    clock : {'header', 'receive'}
        Source of the stamps: the header of the sender, or the time of reception at the recorder.
    report : ReadReport
        Counts of repaired and dropped messages.
    partner : PartnerMotion or None
        Another machine that was recorded with the arm.
    others : tuple of PositionRange
        Position ranges of further joints in the same messages or columns.
    temperature : Temperatures or None
        Measured temperatures of the joints or their motors.

    Examples
    --------
    >>> import armid_ros as ar
    >>> run = ar.read_recording('monday', 'my_arm.urdf')
    >>> run.joints, run.q.shape == run.tau.shape
    (('waist', 'shoulder', 'elbow'), True)

    From arrays:

    >>> import numpy as np
    >>> t = np.arange(200) / 100.0
    >>> ar.Recording(joints=('hinge',), t=t, q=np.sin(t)[:, None]).duration
    1.99

    """

    joints: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    dq: FloatArray | None = None
    tau: FloatArray | None = None
    start_ns: int = 0
    source: str = ''
    topic: str = '/joint_states'
    clock: Clock = 'header'
    report: ReadReport = field(default_factory=ReadReport)
    partner: PartnerMotion | None = None
    others: tuple[PositionRange, ...] = ()
    temperature: Temperatures | None = None

    def __post_init__(self) -> None:
        """Make the arrays read-only; check their shapes and that times increase."""
        object.__setattr__(self, 'joints', tuple(self.joints))
        freeze_samples(self.source or 'recording', self, 'q', 'dq', 'tau')
        backwards = np.flatnonzero(np.diff(self.t) <= 0.0)
        if len(backwards):
            k = int(backwards[0]) + 1
            raise RecordingError(
                f'{self.source or "recording"}: time does not increase at sample {k} '
                f'({self.t[k]:.6f} s after {self.t[k - 1]:.6f} s); sort the samples by time and '
                'remove samples with equal stamps'
            )

    def __len__(self) -> int:
        """Return the number of samples N."""
        return len(self.t)

    def __repr__(self) -> str:
        """Return a summary of two lines: source, duration, rate, quantities and joints."""
        rate = f'{1.0 / self.period:.4g} Hz' if self.period else 'one sample'
        held = [
            name
            for name, values in (('velocity', self.dq), ('effort', self.tau))
            if values is not None
        ]
        return (
            f'Recording {self.source or "in memory"}: {self.duration:.2f} s at {rate}, '
            f'{", ".join(["position", *held])}\n  of {", ".join(self.joints)}'
        )

    @property
    def n_joints(self) -> int:
        """Return the number of joints n."""
        return len(self.joints)

    @property
    def duration(self) -> float:
        """Return the time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0]) if len(self.t) else 0.0

    @property
    def period(self) -> float:
        """Return the median time between samples [s]."""
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else 0.0

    def plot(self, quantity: Literal['q', 'dq', 'tau'] = 'tau') -> npt.NDArray[np.object_]:
        """
        Plot a quantity, such as torque, over time in one subplot per joint.

        Parameters
        ----------
        quantity : {'q', 'dq', 'tau'}
            Quantity to draw.

        Returns
        -------
        ndarray of matplotlib.axes.Axes, shape (n,)

        Raises
        ------
        RecordingError
            If the quantity was not recorded.

        """
        values = getattr(self, quantity)
        if values is None:
            raise RecordingError(
                f'{self.source or "recording"}: {quantity} was not recorded, and cannot be drawn'
            )
        labels = {
            'q': 'position [rad or m]',
            'dq': 'velocity [rad/s or m/s]',
            'tau': 'torque [N m or N]',
        }
        return draw_joints(self.joints, {'measured': (self.t, values)}, labels[quantity])

    def motion(self, cutoff: float | None = None) -> Motion:
        """
        Return the filtered motion of the longest gap-free section, with unfiltered torque.

        Parameters
        ----------
        cutoff : float, optional
            Cut-off of the position filter [Hz]; chosen from the noise by default.

        Returns
        -------
        Motion
            Filtered position, velocity and acceleration at a constant rate; the torque is not
            filtered. Both ends are cut off, since the filter needs neighbouring samples.

        Raises
        ------
        IdentificationError
            If no stretch is long enough, or the cut-off exceeds half of the rate.

        """
        # imported here, as identification depends on this package
        filtered = import_module('armid_ros.api.arguments').motion_of(self, cutoff)
        assert isinstance(filtered, Motion)
        return filtered

    def select(self, samples: Samples) -> Recording:
        """Return the recording with selected samples only; times are unchanged."""
        partner = self.partner and replace(self.partner, q=self.partner.q[samples])
        return replace(self, **selected(self, samples, 't', 'q', 'dq', 'tau'), partner=partner)


def recorded_together(
    recording: Recording, other: Recording, robot: Robot, ties: Sequence[Tie] = ()
) -> Recording:
    """
    Add the positions of a connected machine to a recording, interpolated in time.

    Parameters
    ----------
    recording : Recording
        Recording of the arm.
    other : Recording
        Recording of the other machine, on the same clock.
    robot : Robot
        Its description.
    ties : sequence of Tie
        Ties that may connect the two machines.

    Returns
    -------
    Recording
        Recording of the arm with the other machine as partner, while both were recorded.

    Raises
    ------
    RecordingError
        If the two have no time in common.

    """
    t = recording.t + 1e-9 * (recording.start_ns - other.start_ns)
    inside = (t >= other.t[0]) & (t <= other.t[-1])
    steps = np.diff(other.t)
    after = np.clip(np.searchsorted(other.t, t), 1, len(steps))
    inside &= steps[after - 1] <= GAP_PERIODS * other.period
    if np.count_nonzero(inside) < 4:
        raise RecordingError(
            f'{recording.source}: the topics {recording.topic} and {other.topic} were not '
            'recorded at the same time; record them together'
        )
    q = CubicSpline(other.t, other.q)(t[inside])
    return replace(recording.select(inside), partner=PartnerMotion(robot, tuple(ties), q))


def given_twice(fitted: Sequence[Recording], held_out: Sequence[Recording] = ()) -> str:
    """
    Return the names of recordings that occur more than once, as text; '' if none.

    A recording given twice would have twice the weight, and a fitted recording cannot be held
    out. Recordings are equal if their positions and torques are equal, since two simulated runs
    may have equal positions.

    Parameters
    ----------
    fitted, held_out : sequence of Recording
        Recordings that the model is fitted to, and held-out recordings.

    """

    def same(a: Recording, b: Recording) -> bool:
        if a.tau is None or b.tau is None:
            return a.tau is b.tau and np.array_equal(a.q, b.q)
        return np.array_equal(a.q, b.q) and np.array_equal(a.tau, b.tau)

    again = [
        a.source if a.source == b.source else f'{a.source} (is {b.source})'
        for k, a in enumerate([*fitted, *held_out])
        for b in fitted[:k]
        if same(a, b)
    ]
    return ', '.join(dict.fromkeys(again))


def require_once(fitted: Sequence[Recording], held_out: Sequence[Recording] = ()) -> None:
    """Raise RecordingError if a recording occurs more than once."""
    names = given_twice(fitted, held_out)
    if names:
        raise RecordingError(
            f'recordings are given twice, or in two roles: {names}; give each recording once'
        )
