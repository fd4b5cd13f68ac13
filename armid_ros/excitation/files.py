# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Writing of excitations as YAML or CSV, and reading from YAML.

A CSV file, for spreadsheets, has one row per joint and coefficient of the trajectory; comment
lines contain the run.

"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.schedule import Excitation
from armid_ros.files import finite, load_yaml, read_text, reading, write_file
from armid_ros.files.cells import csv_cell
import numpy as np
import yaml

SCHEMA = 'armid/excitation/1'


def save_excitation(excitation: Excitation, path: str | Path) -> None:
    """Write an excitation in the format of the suffix: .yaml, .yml or .csv."""
    path = Path(path)
    writer = {'.yaml': excitation_text, '.yml': excitation_text, '.csv': _to_csv}.get(path.suffix)
    if writer is None:
        raise TrajectoryError(f'{path}: an excitation is written as .yaml or .csv')
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
        raise TrajectoryError(f'{path}: an excitation is read from a .yaml file')
    return read_excitation(read_text(path, TrajectoryError), str(path))


def read_excitation(text: str, source: str) -> Excitation:
    """
    Return the excitation in a YAML text.

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
            raise TrajectoryError(f'not an excitation: it has to contain schema: {SCHEMA}')
        if content.get('start') is not None:  # an ignored start pose would change the motion
            raise TrajectoryError(
                'an excitation has no start pose; remove it, and plan the way from that pose '
                'with --start'
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
    """Return an excitation as YAML."""
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
    text = io.StringIO()
    text.write(f'# {SCHEMA}\n')
    text.write(f'# period [s],{trajectory.period!r}\n')
    text.write(f'# n_periods,{excitation.n_periods}\n')
    text.write(f'# run_in [s],{excitation.run_in!r}\n')
    numbers = range(1, trajectory.harmonics + 1)
    head = ['joint', 'q0', *(f'a{k}' for k in numbers), *(f'b{k}' for k in numbers)]
    text.write(','.join(head) + '\n')
    for j, joint in enumerate(trajectory.joints):
        values = [trajectory.q0[j], *trajectory.a[j], *trajectory.b[j]]
        text.write(','.join([csv_cell(joint), *(repr(float(value)) for value in values)]) + '\n')
    return text.getvalue()
