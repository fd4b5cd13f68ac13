# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A complete excitation run: run-in from rest, periodic trajectory, and run-out to rest.

The arm accelerates and decelerates along the path of the trajectory. Run-in and run-out therefore
visit only poses of the periods. A `Transfer` leads there from other poses.

A run is written as YAML, and read from it. A CSV file, for spreadsheets, has one row per joint and
coefficient of the trajectory; comment lines contain the run.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.files import finite, load_yaml, read_text, reading, write_file
from armid_ros.files.cells import csv_text
from armid_ros.motion import Motion
import numpy as np
from numpy.polynomial import Polynomial
import numpy.typing as npt
import yaml

#: Largest difference between period * rate and a whole number, for identical periods.
_SAMPLE_TOLERANCE = 1e-6
#: The longest run [s]. Its samples are kept in memory, 1 GB for six joints at 50 Hz.
MAX_DURATION = 86400.0
#: Step from 0 to 1 with zero slope and curvature at both ends, its derivative and its integral.
_STEP = Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
_STEP_SLOPE, _STEP_INTEGRAL = _STEP.deriv(), _STEP.integ()


@dataclass(frozen=True)
class Excitation:
    """
    Run along a trajectory: rest, run-in, identical periods, run-out, rest.

    Attributes
    ----------
    trajectory : FourierTrajectory
        The periodic trajectory.
    n_periods : int
        Number of identical periods; with two or more, their difference is the noise floor.
    run_in : float
        Duration of the run-in, and of the run-out [s].

    """

    trajectory: FourierTrajectory
    n_periods: int = 2
    run_in: float = 2.0

    def __post_init__(self) -> None:
        """Check that the number of periods, the run-in and the duration are possible."""
        if int(self.n_periods) != self.n_periods or self.n_periods < 1:
            raise TrajectoryError(
                f'excitation: n_periods is {self.n_periods}, but has to be a positive integer'
            )
        if not (np.isfinite(self.run_in) and self.run_in > 0.0):
            raise TrajectoryError(f'excitation: its run-in, {self.run_in} s, has to be positive')
        if not self.duration <= MAX_DURATION:
            raise TrajectoryError(
                f'excitation: {self.n_periods} periods of {self.trajectory.period:g} s with run-'
                f'ins of {self.run_in:g} s last {self.duration:.3g} s; the maximum is one day'
            )

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints of the excitation."""
        return self.trajectory.joints

    @property
    def duration(self) -> float:
        """Duration of the excitation from rest to rest [s]."""
        return self.n_periods * self.trajectory.period + 2.0 * self.run_in

    def at(self, t: npt.ArrayLike) -> Motion:
        """
        Evaluate position, velocity and acceleration of the excitation at given times.

        Parameters
        ----------
        t : array_like, shape (N,)
            Time since the start [s]; at rest before 0 and after the duration.

        """
        time = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        before = np.maximum(self.run_in - time, 0.0) / self.run_in
        after = np.maximum(time - (self.duration - self.run_in), 0.0) / self.run_in
        phase = time - self.run_in
        if not (before.any() or after.any()):  # within the periods
            orbit = self.trajectory.motion(phase)
            return Motion(self.joints, time, orbit.q, orbit.dq, orbit.ddq)
        # x = 1 - before is the completed share of the run-in; the phase rate is _STEP(x), and the
        # remaining phase before the first period is run_in * integral of _STEP from x to 1. The
        # integral of _STEP from 0 to 1 is a half.
        lead = self.run_in * (0.5 - _STEP_INTEGRAL(1.0 - before))
        lag = self.run_in * (0.5 - _STEP_INTEGRAL(1.0 - after))
        end = self.n_periods * self.trajectory.period
        phase = np.where(before > 0.0, -lead, np.where(after > 0.0, end + lag, phase))
        speed = _STEP(1.0 - before) * _STEP(1.0 - after)
        change = (_STEP_SLOPE(1.0 - before) - _STEP_SLOPE(1.0 - after)) / self.run_in
        orbit = self.trajectory.motion(phase)
        speed, change = speed[:, np.newaxis], change[:, np.newaxis]
        return Motion(
            self.joints, time, orbit.q, orbit.dq * speed, orbit.ddq * speed**2 + orbit.dq * change
        )

    def for_joints(self, joints: tuple[str, ...]) -> Excitation:
        """
        Return the excitation with its joints in another order.

        Raises
        ------
        TrajectoryError
            If the joints are not the same.

        """
        if set(joints) != set(self.joints):
            raise TrajectoryError(
                f'the excitation has joints {", ".join(self.joints)}, but the robot has '
                f'{", ".join(joints)}'
            )
        order = [self.joints.index(joint) for joint in joints]
        path = self.trajectory
        path = FourierTrajectory(joints, path.period, path.q0[order], path.a[order], path.b[order])
        return replace(self, trajectory=path)

    def at_speed(self, share: float, rate: float) -> Excitation:
        """
        Return the excitation along the same path at a lower speed.

        Parameters
        ----------
        share : float
            Share of the speed, rounded down such that a period is a whole number of samples.
        rate : float
            Samples per second [Hz].

        Raises
        ------
        TrajectoryError
            If the share is not above 0 and at most 1, or the run would last longer than a day.

        """
        if not 0.0 < share <= 1.0:
            raise TrajectoryError(f'the speed share, {share:g}, has to be above 0 and at most 1')
        samples = self._period_samples(rate)
        longer = float(np.ceil(samples / share - _SAMPLE_TOLERANCE)) / samples
        path = self.trajectory.stretched(self.trajectory.period * longer)
        return replace(self, trajectory=path, run_in=self.run_in * longer)

    def motion(self, rate: float) -> Motion:
        """
        Return samples of the excitation at a constant rate.

        Parameters
        ----------
        rate : float
            Samples per second [Hz]; a period has to be a whole number of samples, so that the
            periods are identical sample by sample.

        Returns
        -------
        Motion
            Motion without torque; t starts at 0 and is k / rate.

        Raises
        ------
        TrajectoryError
            If a period is not a whole number of samples; the message names the nearest valid rate.

        """
        lead = self._run_in_samples(rate)
        t = np.arange(round(self.sampled_duration(rate) * rate) + 1) / rate
        run = self.at(t - lead / rate + self.run_in)
        return Motion(run.joints, t, run.q, run.dq, run.ddq)

    def sampled_duration(self, rate: float) -> float:
        """Return the time of the last sample of ``motion`` [s], for a sampling rate [Hz]."""
        samples = 2 * self._run_in_samples(rate) + self.n_periods * self._period_samples(rate)
        return samples / rate

    def _run_in_samples(self, rate: float) -> int:
        return int(np.ceil(self.run_in * rate - _SAMPLE_TOLERANCE))

    def _period_samples(self, rate: float) -> int:
        samples = self.trajectory.period * rate
        nearest = max(round(samples), 1)
        if abs(samples - nearest) > _SAMPLE_TOLERANCE * nearest:
            raise TrajectoryError(
                f'a period of {self.trajectory.period:g} s is {samples:g} samples at {rate:g} Hz; '
                f'it has to be a whole number: use {nearest / self.trajectory.period:.9g} Hz'
            )
        return nearest


SCHEMA = 'armid/excitation/1'


def save_excitation(excitation: Excitation, path: str | Path) -> None:
    """Write an excitation to a file; the suffix .yaml, .yml or .csv selects the format."""
    path = Path(path)
    writer = {'.yaml': excitation_text, '.yml': excitation_text, '.csv': _to_csv}.get(path.suffix)
    if writer is None:
        raise TrajectoryError(f'{path}: an excitation file has to end in .yaml or .csv')
    write_file(path, writer(excitation))


def load_excitation(path: str | Path) -> Excitation:
    """
    Read an excitation from a YAML file.

    Raises
    ------
    TrajectoryError
        If the file cannot be read or is not an excitation; the message names the file and the
        fault.

    """
    path = Path(path)
    if path.suffix not in ('.yaml', '.yml'):
        raise TrajectoryError(f'{path}: an excitation can be read only from a .yaml file')
    return read_excitation(read_text(path, TrajectoryError), str(path))


def read_excitation(text: str, source: str) -> Excitation:
    """
    Read an excitation from a YAML text.

    Parameters
    ----------
    text : str
        YAML text, as returned by `excitation_text`.
    source : str
        Name of the text in messages.

    Raises
    ------
    TrajectoryError
        If the text is not an excitation; the message names the source and the fault.

    """
    with reading(source, TrajectoryError):
        content: Any = load_yaml(text)
        if not isinstance(content, dict) or content.get('schema') != SCHEMA:
            raise TrajectoryError(f"not an excitation: the key 'schema' has to be {SCHEMA}")
        if content.get('start') is not None:  # it changes the motion
            raise TrajectoryError(
                "an excitation cannot contain a start pose; remove the key 'start', and give the "
                'pose with --start'
            )
        joints = content['joints']
        trajectory = FourierTrajectory(
            tuple(str(joint['name']) for joint in joints),
            finite(content['period'], 'period'),
            np.array([joint['q0'] for joint in joints], dtype=float),
            np.array([joint['a'] for joint in joints], dtype=float),
            np.array([joint['b'] for joint in joints], dtype=float),
        )
        number = finite(content['n_periods'], 'n_periods')
        if number != round(number):
            raise ValueError(f'n_periods has to be a whole number, not {number:g}')
        return Excitation(trajectory, round(number), finite(content['run_in'], 'run_in'))


def excitation_text(excitation: Excitation) -> str:
    """Return the YAML text of an excitation."""
    trajectory = excitation.trajectory
    joints = [
        {
            'name': joint,
            'q0': float(trajectory.q0[j]),
            'a': trajectory.a[j].tolist(),
            'b': trajectory.b[j].tolist(),
        }
        for j, joint in enumerate(trajectory.joints)
    ]
    content = {
        'schema': SCHEMA,
        'period': trajectory.period,
        'n_periods': excitation.n_periods,
        'run_in': excitation.run_in,
        'joints': joints,
    }
    head = (
        '# Positions q0 + sum_k (a_k sin(k w t) - b_k cos(k w t)) / (k w), w = 2 pi / period.\n'
        '# SI units: rad or m, s; a and b are velocity amplitudes.\n'
    )
    return head + yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=99)


def _to_csv(excitation: Excitation) -> str:
    trajectory = excitation.trajectory
    head = (
        f'# {SCHEMA}: Fourier coefficients of excitation.yaml, no samples of positions\n'
        f'# period [s],{trajectory.period!r}\n'
        f'# n_periods,{excitation.n_periods}\n'
        f'# run_in [s],{excitation.run_in!r}\n'
    )
    numbers = range(1, trajectory.harmonics + 1)
    rows = [['joint', 'q0', *(f'a{k}' for k in numbers), *(f'b{k}' for k in numbers)]]
    values = np.column_stack([trajectory.q0, trajectory.a, trajectory.b]).tolist()
    rows += [
        [joint, *map(repr, row)] for joint, row in zip(trajectory.joints, values, strict=True)
    ]
    return head + csv_text(rows)
