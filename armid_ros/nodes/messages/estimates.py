# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Estimates as messages, as statuses of /diagnostics and as files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_msgs.msg import ParameterEstimate
from armid_ros.arm.model_file import parameter_table, save_model
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate
from armid_ros.files import write_file
from armid_ros.files.own import refuse_replacing
from armid_ros.identification.online.change import Change
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.nodes.base import key_values
from diagnostic_msgs.msg import DiagnosticStatus
import yaml

SCHEMA = 'armid/estimate/1'
#: What is written: the estimate, a model that has it, and the robot of that.
FILES = ('estimate.yaml', 'model.yaml', 'robot.urdf')
#: A change is a warning for so long [s].
RECENT = 60.0


def estimate_message(
    estimate: Estimate, samples: int, condition_number: float = 0.0
) -> ParameterEstimate:
    """Return an estimate as the message that plotters and rosbags know; the stamp is unset."""
    return ParameterEstimate(
        name=[p.name for p in estimate.parameters],
        joint=[p.joint for p in estimate.parameters],
        unit=[p.unit for p in estimate.parameters],
        value=estimate.values.tolist(),
        std_dev=estimate.std.tolist(),
        samples=samples,
        condition_number=condition_number,
    )


def save_identification(folder: Path, identifier: OnlineIdentifier) -> tuple[Path, ...]:
    """
    Write what was learned.

    Parameters
    ----------
    folder : Path
        Gets estimate.yaml (base parameters as estimated), model.yaml (an arm model that has
        them, for the simulated arm) and robot.urdf, to which the model refers.
    identifier : OnlineIdentifier
        Has learned.

    Raises
    ------
    ModelError
        If the folder cannot be written to.
    OutputError
        If it has files of these names that are no results.

    """
    refuse_replacing(folder, FILES)
    robot, estimate = identifier.arm.robot, identifier.estimate()
    document = {
        'schema': SCHEMA,
        'robot': robot.name,
        'gravity': [float(g) for g in robot.gravity],
        'samples': identifier.samples,
        'condition_number': identifier.condition_number,
        'parameters': parameter_table(
            estimate.parameters, estimate.values, [float(s) for s in estimate.std]
        ),
    }
    paths = tuple(folder / name for name in FILES)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_file(paths[2], robot.urdf)
        save_model(paths[1], identifier.model(), paths[2].name, estimate)
        write_file(paths[0], yaml.safe_dump(document, sort_keys=False, width=99))
    except OSError as error:
        raise ModelError(f'{folder}: cannot be written: {error.strerror}') from error
    return paths


def parameter_status(name: str, estimate: Estimate | None) -> DiagnosticStatus:
    """
    Return the estimate with its intervals.

    Parameters
    ----------
    name : str
        Of the status.
    estimate : Estimate or None
        None before there is one.

    """
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.OK)
    status.message = 'nothing learned so far'
    if estimate is not None:
        status.message = 'value, lower and upper end of the 95 % interval'
        status.values = key_values(_values(estimate))
    return status


def change_status(name: str, changes: Sequence[Change], now: float) -> DiagnosticStatus:
    """
    Return what has changed about the arm; a warning while it is new.

    Parameters
    ----------
    name : str
        Of the status.
    changes : sequence of Change
        Oldest first.
    now : float
        Time of the last sample [s].

    """
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.OK, message='no change seen')
    values: dict[str, object] = {'changes': len(changes)}
    if changes:
        latest = changes[-1]
        age = now - latest.t
        if age < RECENT:
            status.level = DiagnosticStatus.WARN
        status.message = f'{latest}, {age:.0f} s ago'
        values |= _values(latest.size)
    status.values = key_values(values)
    return status


def _values(estimate: Estimate) -> dict[str, float]:
    found: dict[str, float] = {}
    for parameter, value, (lower, upper) in zip(
        estimate.parameters, estimate.values, estimate.interval(), strict=True
    ):
        name = ' '.join(filter(None, (parameter.joint, parameter.name)))
        key = f'{name} [{parameter.unit}]'
        found |= {key: value, f'{key} lower': lower, f'{key} upper': upper}
    return found
