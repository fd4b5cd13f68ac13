# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Catalogue of all effects that can be simulated, estimated and named.

The effects below are shipped. Other effects come from ``register``, or from installed packages: an
entry point of the group ``armid_ros.effects`` names a class, or a module that registers classes.
Packages are loaded when a name is not shipped, or when all names are listed.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
import inspect
import logging
import re
from types import ModuleType
from typing import TypeVar

from armid_ros.effects.base import Effect
from armid_ros.effects.drive import ActuatorSaturation, RotorInertia, TorqueRipple
from armid_ros.effects.friction import (
    AsymmetricFriction,
    CoulombFriction,
    QuadraticFriction,
    StribeckFriction,
    TemperatureDependentFriction,
    ThermalFriction,
    ViscousFriction,
)
from armid_ros.effects.gravity import BaseTilt, GravityMagnitude
from armid_ros.effects.hysteresis import LoadDependentFriction, PreslidingHysteresis
from armid_ros.effects.interaction import HumanInteraction, InterfaceSlack
from armid_ros.effects.learned import LearnedTorque
from armid_ros.effects.load import LinkInertia, Payload
from armid_ros.effects.pairs import CoupledJointFriction, JointCoupling, TorqueCrosstalk
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.effects.sensing import EncoderOffset, TorqueDrift, TorqueGain, TorqueOffset
from armid_ros.effects.springs import JointSpring, SoftLimit
from armid_ros.effects.timing import TimeDelay, TorqueLag
from armid_ros.effects.traits import TRAITS
from armid_ros.effects.transmission import Backlash, JointElasticity
from armid_ros.errors import meant, ModelError, nearest
from armid_ros.files.cells import listed, parted
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

#: Entry-point group of packages that provide effects.
GROUP = 'armid_ros.effects'
#: Pattern of names; names occur in files, on command lines, and next to '@', '+', ':' and ','.
_NAME = re.compile(r'[a-z][a-z0-9_]*')

_EFFECTS: tuple[type[Effect], ...] = (
    ViscousFriction,
    CoulombFriction,
    StribeckFriction,
    AsymmetricFriction,
    QuadraticFriction,
    LoadDependentFriction,
    PreslidingHysteresis,
    ThermalFriction,
    CoupledJointFriction,
    TorqueOffset,
    TorqueDrift,
    TorqueGain,
    TorqueCrosstalk,
    TorqueLag,
    TimeDelay,
    EncoderOffset,
    RotorInertia,
    Payload,
    LinkInertia,
    GravityMagnitude,
    BaseTilt,
    JointElasticity,
    Backlash,
    TorqueRipple,
    JointSpring,
    JointCoupling,
    SoftLimit,
    ActuatorSaturation,
    HumanInteraction,
    InterfaceSlack,
    TemperatureDependentFriction,
    LearnedTorque,
)
for _kind in _EFFECTS:
    _kind.traits = TRAITS.get(_kind.name, _kind.traits)


class Catalogue(Mapping[str, type[Effect]]):
    """
    Mapping from effect names to effect classes; the shipped effects come first.

    Attributes
    ----------
    broken : dict of str to str
        Packages whose effects cannot be loaded, each with the reason.

    """

    def __init__(self, shipped: tuple[type[Effect], ...]) -> None:
        self._kinds = {kind.name: kind for kind in shipped}
        self._shipped = frozenset(self._kinds)
        self._complete = False
        self.broken: dict[str, str] = {}

    def __getitem__(self, name: str) -> type[Effect]:
        """Return the effect class with this name, shipped or from an installed package."""
        if name not in self._kinds:
            self._complete_once()
        return self._kinds[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of all effects; shipped effects come first."""
        self._complete_once()
        return iter(tuple(self._kinds))

    def __len__(self) -> int:
        """Return the number of effects in the catalogue."""
        self._complete_once()
        return len(self._kinds)

    def find(self, name: str) -> type[Effect]:
        """
        Return the effect class with this name; the error for an unknown name suggests others.

        Raises
        ------
        ModelError
            If the name is unknown. The message contains the nearest name or all names, and
            packages that cannot be loaded.

        """
        if name in self:
            return self[name]
        near = nearest(name, self)
        if near:
            raise ModelError(
                f"no effect '{name}'; did you mean '{near}'? 'armid effects' lists all effects"
            )
        broken = ''.join(
            f'; {package} cannot be loaded: {why}' for package, why in self.broken.items()
        )
        raise ModelError(
            f"no effect '{name}'; the catalogue has {', '.join(self)}{broken}"
            '; to use another effect, install the package that contains it'
        )

    def add(self, kind: type[Effect]) -> None:
        """
        Add an effect class to the catalogue, or replace an earlier definition of the class.

        Raises
        ------
        ModelError
            If the class is incomplete, or its name or the name of a quantity is already used.

        """
        check_kind(kind)
        there = self._kinds.get(kind.name)
        if there is not None and _home(there) != _home(kind):
            raise ModelError(
                f"the name '{kind.name}' of {_home(kind)} is already used by {_home(there)}; "
                'choose another name'
            )
        taken = {
            name: other.name
            for other in self._kinds.values()
            if other.name != kind.name
            for name in part_names(other)
        }
        for name in part_names(kind):
            if name in taken:
                raise ModelError(
                    f"{kind.name}: the name '{name}' is already used by a quantity of "
                    f'{taken[name]}; one model may contain both, so choose another name'
                )
        self._kinds[kind.name] = kind

    def remove(self, name: str) -> None:
        """Remove a user-defined effect class; a shipped or unknown name is ignored."""
        if name not in self._shipped:
            self._kinds.pop(name, None)

    def _complete_once(self) -> None:
        """Load the effects of all installed packages at the first call; then do nothing."""
        if self._complete:
            return
        self._complete = True
        for entry in entry_points(group=GROUP):
            try:
                loaded = entry.load()
                if not isinstance(loaded, ModuleType):
                    self.add(loaded)
            except Exception as error:  # another package may raise any exception
                package = entry.dist.name if entry.dist else entry.value
                self.broken[package] = f'{type(error).__name__}: {error}'
                logging.getLogger('armid_ros').warning(
                    'armid_ros: effects of %s cannot be loaded: %s; repair or uninstall it',
                    package,
                    self.broken[package],
                )


def check_kind(kind: type[Effect]) -> None:
    """
    Check that a class has the required attributes of an effect; raise a ModelError if not.

    Raises
    ------
    ModelError
        If an attribute is missing; the message names the class and the attribute.

    """
    if not (inspect.isclass(kind) and issubclass(kind, Effect)):
        raise ModelError(f'{kind!r} is not an effect class; derive it from armid_ros.Effect')
    class_path = _home(kind)
    name = getattr(kind, 'name', None)
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ModelError(f"{class_path}: 'name' has to be like 'viscous_friction', not {name!r}")
    lacking = sorted(getattr(kind, '__abstractmethods__', ()))
    if lacking:
        raise ModelError(f'{name} ({class_path}) has to define {" and ".join(lacking)}()')
    summary = getattr(kind, 'summary', None)
    if not isinstance(summary, str) or not summary.strip():
        raise ModelError(f"{name} ({class_path}): 'summary' has to be a text of one line")
    quantities: tuple[Quantity, ...] = getattr(kind, 'quantities', ())
    if not quantities or not all(isinstance(one, Quantity) for one in quantities):
        raise ModelError(f"{name} ({class_path}): 'quantities' has to be a tuple of Quantity(...)")
    if not all(isinstance(one, Shape) for one in kind.shapes):
        raise ModelError(f"{name} ({class_path}): 'shapes' has to be a tuple of Shape(...)")
    names = part_names(kind)
    twice = [part for part in names if names.count(part) > 1]
    if twice:
        raise ModelError(f"{name} ({class_path}): '{twice[0]}' names two quantities or shapes")


def part_names(kind: type[Effect]) -> list[str]:
    """Return the names of the quantities and shape parameters of an effect."""
    return [*(one.name for one in kind.quantities), *(one.name for one in kind.shapes)]


def _home(kind: type[Effect]) -> str:
    return f'{kind.__module__}.{kind.__qualname__}'


CATALOGUE = Catalogue(_EFFECTS)

#: Effects that are fitted with the rigid body by default.
USUAL_EFFECTS = tuple(effect.name for effect in _EFFECTS if effect.traits.usual)

#: Effects without a shape that are nuisance parameters if they are not requested.
UNASKED_FRICTION = tuple(e for e in _EFFECTS if e.traits.nuisance == ((),) and not e.traits.usual)

_Kind = TypeVar('_Kind', bound=type[Effect])


def register(kind: _Kind) -> _Kind:
    """
    Add a user-defined effect class to the catalogue; usable as a class decorator.

    The effect can then be named like a shipped effect: in ``make_effect``, in model.yaml and in
    ``effects='...'``. The diagnosis searches for it. A new definition of a class, as in a
    notebook, replaces the old one.

    Parameters
    ----------
    kind : type of Effect
        The class.

    Returns
    -------
    type of Effect
        The same class.

    Raises
    ------
    ModelError
        If the class is incomplete, or its name or the name of a quantity is already used.

    Examples
    --------
    >>> import armid_ros as ar
    >>> from armid_ros.effects import CATALOGUE, joint_columns
    >>> @ar.register
    ... class Hose(ar.Effect):
    ...     name = 'hose'
    ...     summary = 'hose that stiffens as it bends'
    ...     quantities = (ar.Quantity('hose_stiffness', 'N m/rad^3'),)
    ...
    ...     def columns(self, motion, arm):
    ...         return joint_columns(self, motion, motion.q**3)
    >>> ar.ArmModel.of('humanoid_arm', effects='hose@elbow_pitch:hose_stiffness=1.5').values[0]
    array([1.5])
    >>> CATALOGUE.remove('hose')  # only if nobody is to name it any more

    """
    CATALOGUE.add(kind)
    return kind


def make_effect(text: str, robot: Robot) -> Effect:
    """
    Create an effect from a text with its name and, optionally, its joints.

    Parameters
    ----------
    text : str
        'viscous_friction', or with joints 'coupled_joint_friction@joint_5+joint_6'.
    robot : Robot
        The arm it acts on.

    Raises
    ------
    ModelError
        If the catalogue has no such effect or the robot no such joint; the message lists them.

    Returns
    -------
    Effect
        The effect, without values; ``ArmModel.with_effect`` adds values.

    Examples
    --------
    >>> import armid_ros as ar
    >>> robot = ar.load_robot('my_arm.urdf')
    >>> ar.make_effect('joint_spring@elbow', robot).joints
    ('elbow',)

    """
    name, _, joints = text.strip().partition('@')
    return CATALOGUE.find(name).on(robot, listed(joints, '+') if joints else None)


#: Two example arguments of `parse_effect`, for help texts and messages.
EXAMPLES = 'viscous_friction:viscous_coefficient=0.1 or payload@wrist:payload_m=0.3'


def parse_effect(text: str, robot: Robot) -> tuple[Effect, FloatArray]:
    """
    Create an effect and its parameter values from a text, such as 'payload:payload_m=0.3'.

    Parameters
    ----------
    text : str
        'coulomb_friction:coulomb_torque=0.2', or 'payload@wrist:payload_m=0.3,payload_mz=0.01', or
        with a shape 'stribeck_friction:stribeck_torque=0.1,stribeck_velocity=0.05'. Every joint of
        the effect gets the values; a quantity not given is zero, a shape not given has its
        default.
    robot : Robot
        The arm it acts on.

    Raises
    ------
    ModelError
        If the effect, joint, quantity or shape does not exist, or a value is not a number.

    """
    head, *rest = parted(text, ':')
    assignments = ':'.join(rest)
    effect = make_effect(head, robot)
    quantities = [quantity.name for quantity in effect.quantities]
    shapes = [shape.name for shape in effect.shapes]
    values = np.zeros((len(effect.owners), len(quantities)))
    shape_values = effect.shape_values
    for assignment in filter(None, assignments.split(',')):
        key, _, number = (part.strip() for part in assignment.partition('='))
        if number and key not in quantities + shapes:
            hint = f'; a joint is named as {effect.name}@JOINT' if key.startswith('joint') else ''
            raise ModelError(
                f"{effect.name} has no '{key}'; it has {', '.join(quantities + shapes)}"
                f'{meant(key, quantities + shapes)}{hint}'
            )
        value = _number(text, effect, key, number)
        if key in quantities:
            index = quantities.index(key)
            _require_possible(effect.name, effect.quantities[index], value)
            values[:, index] = value
        else:
            shape_values[:, shapes.index(key)] = value
    return effect.with_shape(shape_values), values.ravel()


def _number(text: str, effect: Effect, key: str, number: str) -> float:
    """Convert the text of a value to a finite number; raise a ModelError if this is impossible."""
    try:
        value = float(number)
    except ValueError:
        value = np.nan
    if np.isfinite(value):
        return value
    if number or not effect.joints:
        raise ModelError(f"{text}: '{number}' is not a number; write {effect.name}:{key}=0.1")
    first = effect.quantities[0].name
    raise ModelError(
        f"{text}: '{key}' is not NAME=NUMBER. One number applies to all joints; for separate "
        f'numbers, give the effect once per joint, as {effect.name}@{effect.joints[0]}:{first}=0.1'
    )


def _require_possible(name: str, quantity: Quantity, value: float) -> None:
    """Raise a ModelError if a value is outside the physical bounds of its quantity."""
    if quantity.lower <= value <= quantity.upper:
        return
    bounds = f'{quantity.lower:g} or more'
    if np.isfinite(quantity.upper):
        bounds = f'from {quantity.lower:g} to {quantity.upper:g}'
    unit = f' {quantity.unit}' if quantity.unit else ''
    raise ModelError(f'{name}: {quantity.name} has to be {bounds}{unit}, not {value:g}')
