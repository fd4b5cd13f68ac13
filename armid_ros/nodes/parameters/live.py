# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the live diagnosis, and the diagnosis that they describe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armid_ros.api.arguments import read_recording
from armid_ros.arm import ArmModel, load_misfit, load_model
from armid_ros.errors import ModelError
from armid_ros.nodes.live import LiveDiagnosis, LiveSettings
from armid_ros.nodes.parameters.identifier import robot_of, ROBOT_PARAMETERS
from armid_ros.nodes.parameters.table import NodeParameter, Values

#: Parameters for the fields of LiveSettings; they can be set at run time.
LIVE_SETTINGS = (
    NodeParameter(
        'window',
        20.0,
        'Longest motion that is diagnosed; a change empties the window.',
        's',
        limits=(4.0, 600.0),
        read_only=False,
    ),
    NodeParameter(
        'shortest',
        8.0,
        'Shortest motion after a change of the arm that is diagnosed.',
        's',
        limits=(2.0, 600.0),
        read_only=False,
    ),
    NodeParameter(
        'every',
        4.0,
        'Length of motion between two diagnoses.',
        's',
        limits=(0.5, 3600.0),
        read_only=False,
    ),
    NodeParameter(
        'rate',
        200.0,
        'Samples per second that are kept of the joint states.',
        'Hz',
        limits=(10.0, 2000.0),
        read_only=False,
    ),
    NodeParameter(
        'confirmations',
        2,
        'Diagnoses in a row that must agree on an effect before it is proposed.',
        limits=(1, 100),
        read_only=False,
    ),
    NodeParameter(
        'material',
        0.01,
        "Share of a joint's torque (rms) below which an effect does not matter.",
        limits=(0.0, 1.0),
        read_only=False,
    ),
)

LIVE_PARAMETERS = (
    *ROBOT_PARAMETERS,
    NodeParameter(
        'model',
        '',
        'model.yaml of the arm; empty: the robot description and the effects.',
    ),
    NodeParameter(
        'effects',
        [''],
        'Known effects of the arm, each as NAME[@joint+joint]:quantity=value.',
    ),
    NodeParameter('baseline', [''], 'Bags of the baseline.'),
    NodeParameter(
        'learning',
        20.0,
        'Motion of the healthy arm at the beginning. The misfit of the model is computed from it '
        'if neither a baseline nor the model file gives it. 0: diagnose all deviations from the '
        'model, not only changes.',
        's',
        limits=(0.0, 600.0),
    ),
    *LIVE_SETTINGS,
    NodeParameter(
        'save_to',
        'live_diagnosis',
        'Folder that ~/save writes to: diagnosis.json, model.yaml, report.html.',
        read_only=False,
    ),
    NodeParameter('seed', 0, 'Random seed of the diagnoses.', limits=(0, 2**62)),
)


def settings_of(value: Values) -> LiveSettings:
    """
    Return the settings that parameters describe.

    Raises
    ------
    IdentificationError
        If they do not fit each other.

    """
    fields = {entry.name: value(entry.name) for entry in LIVE_SETTINGS}
    return LiveSettings(**fields, learning=value('learning'))


def make_diagnosis(value: Values, description: str | None = None) -> LiveDiagnosis:
    """
    Make the live diagnosis that parameters describe.

    Parameters
    ----------
    value : callable
        Returns the value of a parameter of `LIVE_PARAMETERS`.
    description : str, optional
        URDF that replaces the robot of the parameters.

    Raises
    ------
    ArmidError
        If robot, model, effects, bags or settings are not valid or do not fit each other.

    """
    robot = None
    if description is not None or value('robot'):
        robot = robot_of(value, description)
    if value('model'):
        arm = load_model(Path(value('model')).expanduser(), robot)
    else:
        assert robot is not None  # the node then waits for robot_description
        arm = ArmModel(robot)
    given = ArmModel.of(arm.robot, effects=value('effects'))
    for effect, values in zip(given.effects, given.values, strict=True):
        if effect in arm.effects:
            known = list(arm.values)
            known[arm.effects.index(effect)] = values
            arm = replace(arm, values=tuple(known))
        else:
            arm = arm.with_effect(effect, values)
    if not arm.robot.rigid_parameters.any():
        raise ModelError(
            f'{arm.robot.name}: no link that moves has an <inertial>, so that the model predicts '
            'no torque to compare with; complete the description, or give a model'
        )
    bags = [read_recording(bag, arm) for bag in value('baseline')]
    misfit = load_misfit(value('model')) if value('model') and not bags else None
    return LiveDiagnosis(
        arm, settings_of(value), baseline=tuple(bags), misfit=misfit, seed=value('seed')
    )
