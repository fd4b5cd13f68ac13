# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Section on the quality of the recordings: rate, gaps, repairs, repeatability."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from armid_ros.identification import Fit
from armid_ros.identification.rows.period import find_period, refined_period
from armid_ros.inspection.facts import Sampling
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.report.blocks import BulletList, DataTable, Fold, Paragraph, TableCell
from armid_ros.report.notation import digits, plain
from armid_ros.report.page import Section, Templated
from armid_ros.robots import Robot
import numpy as np


def data_quality_section(
    read: Sequence[tuple[Recording, str, Sequence[Fit]]],
    robot: Robot | None = None,
    at_fault: Collection[str] = (),
) -> Section:
    """
    Return the section with rate, gaps and repairs of each recording.

    Parameters
    ----------
    read : sequence of (Recording, str, sequence of Fit)
        Each recording with its use and its fits.
    robot : Robot, optional
        Joints and units; without a robot, repeatability is not shown.
    at_fault : collection of str
        Names of recordings with faulty signals, by the verdict.

    """
    rows, notes = [], []
    for recording, role, _ in read:
        source, sampling = recording.source or 'in memory', Sampling.of(recording)
        rows.append(
            (
                source,
                role,
                f'{sampling.duration:.1f} s',
                f'{plain(sampling.rate_hz, 4)} Hz',
                f'{100 * sampling.jitter:.1f} %',
                f'{plain(1e3 * sampling.longest_step)} ms',
                recording.clock,
            )
        )
        text = recording.report.describe()
        clean, faulty = recording.report.unharmed, recording.source in at_fault
        if clean:
            text += ' The recorded signals are at fault: see the verdict.' * faulty or (
                ' Nothing dropped, nothing repaired.'
            )
        notes.append((f'{source}: {text}', 'fine' if clean and not faulty else 'warn'))
    heads = ('Recording', 'Used for', 'Duration', 'Rate', 'Jitter', 'Longest step', 'Clock')
    blocks: list[Templated] = [DataTable(heads, rows, (0, 1, 6)), BulletList(notes)]
    if robot is not None:
        blocks += _repeatability(read, robot)
    return Section('Data quality', blocks)


def _repeatability(
    read: Sequence[tuple[Recording, str, Sequence[Fit]]], robot: Robot
) -> list[Templated]:
    """Return a foldable table of torque noise and joint residuals for each periodic recording."""
    folds: list[Templated] = []
    for recording, _, fits in read:
        found = repeatability(fits) if fits else None
        if found is None:
            continue
        period, varying, residual = found
        power = np.where(residual > 0.0, residual, 1.0) ** 2
        shares = 100.0 * np.clip(1.0 - varying**2 / power, 0.0, 1.0)
        rows = []
        for k, joint in enumerate(robot.joints):
            unit = robot.torque_units[k]
            rows.append(
                (
                    joint,
                    f'{digits(varying[k])} {unit}',
                    f'{digits(residual[k])} {unit}',
                    # from half of the residual on, the model can be improved
                    TableCell(f'{shares[k]:.0f} %', 'telling' if shares[k] > 50.0 else ''),
                )
            )
        source = recording.source or 'in memory'
        folds.append(
            Fold(
                f'Repeatability: {source} repeats after {period:.2f} s',
                [
                    Paragraph(
                        'The difference between two periods is noise. The repeatable part of the '
                        'residual is model error, which a better model could explain.'
                    ),
                    DataTable(('Joint', 'Not repeatable', 'Residual', 'Repeatable share'), rows),
                ],
                opened=not folds,
            )
        )
    unknown = Paragraph(
        'Repeatability: unknown, because no recording repeats its motion. Record two periods of '
        'one excitation to separate noise from model error.'
    )
    return folds or [unknown]


def repeatability(fits: Sequence[Fit]) -> tuple[float, FloatArray, FloatArray] | None:
    """
    Return the period of a recorded motion, and each joint's torque noise and residual.

    Two periods are compared in the longest stretch of a recording; None if no motion repeats. The
    residuals are compared, each at the positions of its own period. Torque that depends only on
    the motion cancels, whether it is modelled or not.

    Returns
    -------
    period : float
        [s].
    varying : ndarray, shape (n,)
        Standard deviation of the part of the residual that does not repeat [N m].
    residual : ndarray, shape (n,)
        Root mean square of the residual of the same samples [N m].

    """
    fit = max(fits, key=lambda one: len(one.motion))
    # the period is searched for in the first 150 s
    count = int(np.searchsorted(fit.motion.t, fit.motion.t[0] + 150.0))
    motion = fit.motion.select(slice(count))
    fewest = 20  # pairs of samples for a standard deviation
    found = find_period(motion.t, motion.q) if count > fewest else None
    if found is None or found[1].stop - found[1].start < fewest:
        return None
    lag, where = found
    first = slice(where.start, where.stop)
    second = slice(where.start + lag, where.stop + lag)
    used = fit.informative[first] & fit.informative[second]
    pairs = np.maximum(used.sum(axis=0), 1)
    one, other = fit.residual[first], fit.residual[second]
    apart = np.sum((other - one) ** 2, axis=0, where=used) / pairs
    both = np.sum(one**2 + other**2, axis=0, where=used) / pairs
    period = refined_period(motion.q, lag, where) * float(motion.t[1] - motion.t[0])
    return period, np.sqrt(0.5 * apart), np.sqrt(0.5 * both)
