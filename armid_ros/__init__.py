# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification of robot arms: find where simulation and measurement disagree.

An arm model is a rigid body plus a list of effects. With ``import armid_ros as ar``::

    arm = ar.ArmModel.of('ur10.urdf', effects='viscous_friction,coulomb_friction,torque_offset')
    model = ar.identify(arm, ['monday.mcap', 'tuesday.csv'], validate='wednesday.mcap')
    print(model)
    model.plot()  # axes of matplotlib
    found = ar.diagnose(model, 'today.mcap')
    print(found)
    found.save('found')  # a folder with the report and the model; ar.load_model reads it again

Names are imported when they are used. The packages, from the ground up: ``robots`` (descriptions),
``model`` (rigid body), ``effects`` (friction and other torques), ``arm`` (rigid body with
effects), ``recording``, ``simulation``, ``excitation``, ``identification``, ``inspection``,
``diagnosis``, ``report``, ``api``, ``nodes``, ``cli``.

"""

from __future__ import annotations

from importlib import import_module
from typing import Any, TYPE_CHECKING

from armid_ros.version import __version__ as __version__

if TYPE_CHECKING:
    from armid_ros.api.arguments import read_recording
    from armid_ros.api.comparison import compare, ComparisonResult
    from armid_ros.api.design import design_excitation, excite
    from armid_ros.api.diagnosis import diagnose, DiagnosisResult
    from armid_ros.api.excitation import ExcitationResult
    from armid_ros.api.identification import IdentificationResult, identify
    from armid_ros.api.inspection import check, inspect, InspectionResult
    from armid_ros.api.simulation import simulate
    from armid_ros.arm import ArmModel, load_model, save_model
    from armid_ros.effects import Effect, make_effect, Quantity, register
    from armid_ros.errors import ArmidError
    from armid_ros.estimate import Estimate
    from armid_ros.identification.online.identifier import OnlineIdentifier
    from armid_ros.model import regressor
    from armid_ros.motion import Motion
    from armid_ros.recording import Recording, write_recording
    from armid_ros.robots import load_robot, Robot, shipped_robots

#: Public names by their module.
_NAMES = {
    'armid_ros.robots': ('load_robot', 'shipped_robots', 'Robot'),
    'armid_ros.arm': ('ArmModel', 'load_model', 'save_model'),
    'armid_ros.effects': ('Effect', 'Quantity', 'make_effect', 'register'),
    'armid_ros.model': ('regressor',),
    'armid_ros.motion': ('Motion',),
    'armid_ros.recording': ('Recording', 'write_recording'),
    'armid_ros.api.arguments': ('read_recording',),
    'armid_ros.api.inspection': ('inspect', 'InspectionResult', 'check'),
    'armid_ros.api.identification': ('identify', 'IdentificationResult'),
    'armid_ros.identification.online.identifier': ('OnlineIdentifier',),
    'armid_ros.api.diagnosis': ('diagnose', 'DiagnosisResult'),
    'armid_ros.api.comparison': ('compare', 'ComparisonResult'),
    'armid_ros.api.simulation': ('simulate',),
    'armid_ros.api.design': ('design_excitation', 'excite'),
    'armid_ros.api.excitation': ('ExcitationResult',),
    'armid_ros.estimate': ('Estimate',),
    'armid_ros.errors': ('ArmidError',),
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    'load_robot',
    'shipped_robots',
    'Robot',
    'ArmModel',
    'load_model',
    'save_model',
    'Effect',
    'Quantity',
    'make_effect',
    'register',
    'regressor',
    'Motion',
    'Recording',
    'read_recording',
    'write_recording',
    'inspect',
    'InspectionResult',
    'identify',
    'IdentificationResult',
    'OnlineIdentifier',
    'diagnose',
    'DiagnosisResult',
    'check',
    'compare',
    'ComparisonResult',
    'simulate',
    'design_excitation',
    'excite',
    'ExcitationResult',
    'Estimate',
    'ArmidError',
]


def __getattr__(name: str) -> Any:
    """Import a public name of the package at its first use; raise AttributeError if unknown."""
    if name not in _HOMES:
        raise AttributeError(
            f"armid_ros has no public name '{name}'; its public names are {', '.join(__all__)}, "
            'and it has packages such as armid_ros.excitation'
        )
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names of the package, for tab completion in a Python shell."""
    return [*__all__, '__version__']
