# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert estimates to messages, statuses of /diagnostics and files."""

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
#: Written files: the estimate, the model with the estimate, and its robot.
FILES = ('estimate.yaml', 'model.yaml', 'robot.urdf')


def estimate_message(
    estimate: Estimate, samples: int, condition_number: float = 0.0
) -> ParameterEstimate:
    """Convert an estimate to a ParameterEstimate message without a stamp."""
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
    Write the estimate to files.

    Parameters
    ----------
    folder : Path
        Folder for estimate.yaml (estimated base parameters), model.yaml (an arm model with these
        parameters, for the simulated arm) and robot.urdf, to which the model refers.
    identifier : OnlineIdentifier
        Identifier with the estimate.

    Raises
    ------
    ModelError
        If the folder cannot be written to.
    OutputError
        If files of these names exist that are not results.

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
    Return the /diagnostics status of an estimate with its intervals.

    Parameters
    ----------
    name : str
        Name of the status.
    estimate : Estimate or None
        None before the first estimate.

    """
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.OK)
    status.message = 'nothing learned so far'
    if estimate is not None:
        status.message = 'value, lower and upper end of the 95 % interval'
        status.values = key_values(_values(estimate))
    return status


def change_status(name: str, changes: Sequence[Change], now: float) -> DiagnosticStatus:
    """
    Return the /diagnostics status of the changes of the arm, a warning for recent ones.

    Parameters
    ----------
    name : str
        Name of the status.
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
        if age < 60.0:
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
