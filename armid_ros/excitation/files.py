# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Excitations as files: coefficients as YAML or CSV.

YAML holds the whole run; CSV holds the trajectory, a row per joint and coefficient, and the run
in comment lines, so that a spreadsheet opens it.

"""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.schedule import Excitation
from armid_ros.files import finite, load_yaml, read_text, reading, write_file
from armid_ros.files.cells import cell_name, csv_cell
import numpy as np
import yaml

SCHEMA = 'armid/excitation/1'


def save_excitation(excitation: Excitation, path: str | Path) -> None:
    """Write an excitation; the suffix, .yaml, .yml or .csv, says how."""
    path = Path(path)
    writer = {'.yaml': excitation_text, '.yml': excitation_text, '.csv': _to_csv}.get(path.suffix)
    if writer is None:
        raise TrajectoryError(f'{path}: an excitation is written as .yaml or .csv')
    write_file(path, writer(excitation))


def load_excitation(path: str | Path) -> Excitation:
    """
    Read an excitation from a YAML or CSV file.

    Raises
    ------
    TrajectoryError
        If the file cannot be read or is not an excitation; names the file and what is wrong.

    """
    path = Path(path)
    reader = {'.yaml': _from_yaml, '.yml': _from_yaml, '.csv': _from_csv}.get(path.suffix)
    if reader is None:
        raise TrajectoryError(f'{path}: an excitation is a .yaml or a .csv file')
    text = read_text(path, TrajectoryError)
    with reading(path, TrajectoryError):
        return reader(text)


def read_excitation(text: str, source: str) -> Excitation:
    """
    Return the excitation that a text in YAML holds.

    Parameters
    ----------
    text : str
        As `excitation_text` makes it.
    source : str
        Where it came from, for messages.

    Raises
    ------
    TrajectoryError
        If it is no excitation; names the source and what is wrong.

    """
    with reading(source, TrajectoryError):
        return _from_yaml(text)


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


def _from_yaml(text: str) -> Excitation:
    content: Any = load_yaml(text)
    if not isinstance(content, dict) or content.get('schema') != SCHEMA:
        raise TrajectoryError(f'not an excitation: it has to say schema: {SCHEMA}')
    joints = content['joints']
    trajectory = FourierTrajectory(
        tuple(str(joint['name']) for joint in joints),
        finite(content['period'], 'period'),
        np.array([joint['q0'] for joint in joints], dtype=float),
        np.array([joint['a'] for joint in joints], dtype=float),
        np.array([joint['b'] for joint in joints], dtype=float),
    )
    _refuse_start(content.get('start') is not None)
    return Excitation(
        trajectory, _whole(content['n_periods']), finite(content['run_in'], 'run_in')
    )


def _refuse_start(given: bool) -> None:
    """Refuse a start pose: an excitation without it would be another motion."""
    if given:
        raise TrajectoryError(
            'an excitation has no start pose of its own; take it out, and plan the way from that '
            'pose with --start'
        )


def _whole(value: Any) -> int:
    """Return a number of periods."""
    number = finite(value, 'n_periods')
    if number != round(number):
        raise ValueError(f'n_periods has to be a whole number, not {value}')
    return round(number)


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


def _from_csv(text: str) -> Excitation:
    lines = text.splitlines()
    if not lines or lines[0].lstrip('# ').strip() != SCHEMA:
        raise TrajectoryError(f"not an excitation: its first line has to be '# {SCHEMA}'")
    run = dict(
        line.lstrip('# ').rsplit(',', 1) for line in lines if line.startswith('#') and ',' in line
    )
    rows = list(csv.DictReader(line for line in lines if not line.startswith('#')))
    if any(None in row or None in row.values() for row in rows):
        raise TrajectoryError('a row has not as many columns as the head')
    harmonics = max((int(key[1:]) for key in rows[0] if key[0] == 'a'), default=0) if rows else 0

    def column(key: str) -> list[float]:
        return [float(row[key]) for row in rows]

    _refuse_start(any(row.get('start') for row in rows))
    trajectory = FourierTrajectory(
        tuple(cell_name(row['joint']) for row in rows),
        float(run['period [s]']),
        np.array(column('q0')),
        np.array([column(f'a{k}') for k in range(1, harmonics + 1)]).T,
        np.array([column(f'b{k}') for k in range(1, harmonics + 1)]).T,
    )
    return Excitation(trajectory, _whole(run['n_periods']), float(run['run_in [s]']))
