# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Estimates as messages and as files."""

from __future__ import annotations

from pathlib import Path

from armid_msgs.msg import ParameterEstimate
from armid_ros.arm.model_file import parameter_table, save_model
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate
from armid_ros.files import write_file
from armid_ros.files.own import refuse_replacing
from armid_ros.identification.online.identifier import OnlineIdentifier
import yaml

SCHEMA = 'armid/estimate/1'
#: What is written: the estimate, a model that has it, and the robot of that.
FILES = ('estimate.yaml', 'model.yaml', 'robot.urdf')


def estimate_message(
    estimate: Estimate, samples: int, condition_number: float
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
