# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the recordings are like."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from armid_ros.identification import Fit
from armid_ros.identification.rows.period import exact_period
from armid_ros.recording import Recording
from armid_ros.report.notation import digits, torque_unit
from armid_ros.report.page import Section
from armid_ros.report.repeatability import Repeatability
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class RecordingQuality:
    """
    One recording in numbers.

    Attributes
    ----------
    source, role : str
        Which, and what it was used for.
    duration : float
        [s].
    rate : float
        Samples per second [Hz].
    jitter : float
        Standard deviation of the time between samples, as a share of it, holes left out.
    longest_gap : float
        Longest time between two samples [s].
    clock : str
        Whose time it is.
    description : str
        What reading it met.
    clean : bool
        Whether that was nothing.
    repeatability : Repeatability or None
        What its periods differ by; None where nothing repeats.

    """

    source: str
    role: str
    duration: float
    rate: float
    jitter: float
    longest_gap: float
    clock: str
    description: str
    clean: bool
    repeatability: Repeatability | None

    @staticmethod
    def of(recording: Recording, role: str, fits: Sequence[Fit] = ()) -> RecordingQuality:
        """Measure a recording."""
        steps = np.diff(recording.t) if len(recording) > 1 else np.zeros(1)
        period = recording.period or 1.0
        ordinary = steps[steps < 5.0 * period]
        return RecordingQuality(
            source=recording.source or 'in memory',
            role=role,
            duration=recording.duration,
            rate=1.0 / period,
            jitter=float(np.std(ordinary) / period) if len(ordinary) else 0.0,
            longest_gap=float(steps.max()),
            clock=recording.clock,
            description=recording.report.describe(),
            clean=recording.report.unharmed,
            repeatability=_repeatability(recording, fits),
        )


@dataclass(frozen=True)
class DataQuality(Section):
    """
    Rate, gaps and repairs of every recording.

    Attributes
    ----------
    recordings : sequence of RecordingQuality
        Training data first.
    robot : Robot or None
        Gives joints and units, where repeatability is shown.
    at_fault : collection of str
        Sources of what the verdict is that it is at fault, however well it was read.

    """

    title: ClassVar[str] = 'Data quality'
    template: ClassVar[str] = 'data_quality.html'

    recordings: Sequence[RecordingQuality]
    robot: Robot | None = None
    at_fault: Collection[str] = ()

    @property
    def repeating(self) -> list[tuple[str, float, list[tuple[str, str, str, float]]]]:
        """Return recording, period, per joint what varies, the residual, what repeats of it."""
        if self.robot is None:
            return []
        return [
            (recording.source, recording.repeatability.period, _rows(recording, self.robot))
            for recording in self.recordings
            if recording.repeatability is not None
        ]


def _repeatability(recording: Recording, fits: Sequence[Fit]) -> Repeatability | None:
    """Compare periods of the rows of a fit; how long one is, the recording tells better."""
    found = Repeatability.of(fits) if fits else None
    if found is None:
        return None
    return replace(found, period=exact_period(recording, found.period))


def _rows(recording: RecordingQuality, robot: Robot) -> list[tuple[str, str, str, float]]:
    given = recording.repeatability
    assert given is not None
    return [
        (
            joint,
            f'{digits(given.varying[k])} {torque_unit(robot, k)}',
            f'{digits(given.residual[k])} {torque_unit(robot, k)}',
            100.0 * float(given.repeating_share[k]),
        )
        for k, joint in enumerate(robot.joints)
    ]
