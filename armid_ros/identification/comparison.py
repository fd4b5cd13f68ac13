# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Two identifications side by side: what changed beyond its uncertainty.

With dozens of parameters one in twenty is outside its 95 % interval by chance, so differences are
held against each other (Holm 1979): a change is called one if the whole list of changes is free of
chance finds with 95 % probability.

"""

from __future__ import annotations

from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
import numpy as np
from scipy.special import erfc
import yaml

#: Probability that the list of changes has a chance find in it.
CHANCE = 0.05
_SCHEMAS = ('armid/identification/1', 'armid/model/1')


@dataclass(frozen=True)
class Parameters:
    """
    What a file says of an arm.

    Attributes
    ----------
    source : str
        The file.
    robot : str
        What it calls the robot.
    values : mapping of ParameterName to (float, float)
        Value and standard deviation of every parameter that was identified on its own.
    error_percent : float or None
        Relative torque error on held-out data, or on training data where there is none.

    """

    source: str
    robot: str
    values: dict[ParameterName, tuple[float, float]]
    error_percent: float | None


@dataclass(frozen=True)
class Change:
    """
    One parameter in both.

    Attributes
    ----------
    parameter : ParameterName
        Which.
    before, after : float
        Values.
    before_std, after_std : float
        Standard deviations.
    changed : bool
        Whether it differs by more than chance.

    """

    parameter: ParameterName
    before: float
    after: float
    before_std: float
    after_std: float
    changed: bool

    @property
    def difference(self) -> float:
        """What it grew by."""
        return self.after - self.before

    @property
    def std(self) -> float:
        """Standard deviation of the difference."""
        return float(np.hypot(self.before_std, self.after_std))

    @property
    def deviations(self) -> float:
        """Difference in its standard deviations."""
        return (
            self.difference / self.std if self.std > 0.0 else np.copysign(np.inf, self.difference)
        )


@dataclass(frozen=True)
class Comparison:
    """
    Two identifications.

    Attributes
    ----------
    before, after : Parameters
        What was compared.
    changes : tuple of Change
        Every parameter that both have, in the order of the first.
    only_before, only_after : tuple of ParameterName
        What the other does not have.

    """

    before: Parameters
    after: Parameters
    changes: tuple[Change, ...]
    only_before: tuple[ParameterName, ...]
    only_after: tuple[ParameterName, ...]

    @property
    def changed(self) -> tuple[Change, ...]:
        """What changed, the surest first."""
        found = [change for change in self.changes if change.changed]
        return tuple(sorted(found, key=lambda change: -abs(change.deviations)))

    def document(self) -> dict[str, Any]:
        """Return the comparison for programs to read (schema armid/comparison/1)."""
        return {
            'schema': 'armid/comparison/1',
            'before': self.before.source,
            'after': self.after.source,
            'parameters': [
                {
                    'name': c.parameter.name,
                    'joint': c.parameter.joint,
                    'unit': c.parameter.unit,
                    'before': c.before,
                    'before_std': c.before_std,
                    'after': c.after,
                    'after_std': c.after_std,
                    'changed': c.changed,
                }
                for c in self.changes
            ],
            'only_before': [{'name': p.name, 'joint': p.joint} for p in self.only_before],
            'only_after': [{'name': p.name, 'joint': p.joint} for p in self.only_after],
        }


def compare(before: Parameters, after: Parameters) -> Comparison:
    """
    Compare two identifications of one robot.

    Raises
    ------
    ModelError
        If they have no parameter in common.

    """
    shared = [name for name in before.values if name in after.values]
    if not shared:
        raise ModelError(
            f'{before.source} and {after.source} have no identified parameter in common; '
            'are they of one robot, in one gravity?'
        )
    pairs = [(*before.values[name], *after.values[name]) for name in shared]
    beyond = _beyond_chance(np.array(pairs))
    changes = tuple(
        Change(name, pair[0], pair[2], pair[1], pair[3], bool(sure))
        for name, pair, sure in zip(shared, pairs, beyond, strict=True)
    )
    return Comparison(
        before,
        after,
        changes,
        tuple(name for name in before.values if name not in after.values),
        tuple(name for name in after.values if name not in before.values),
    )


def read_parameters(path: str | Path) -> Parameters:
    """
    Read what was identified.

    Parameters
    ----------
    path : str or Path
        Folder of an identification, its identification.json, or a model.yaml.

    Raises
    ------
    ModelError
        Naming the file and what is wrong in it.

    """
    path = Path(path)
    if path.is_dir():
        kept = [path / name for name in ('identification.json', 'model.yaml')]
        found = [file for file in kept if file.is_file()]
        if not found:
            raise ModelError(
                f'{path}: neither identification.json nor model.yaml is in it; '
                'name the folder that armid identify wrote'
            )
        path = found[0]
    try:
        text = path.read_text(encoding='utf-8')
        document = json.loads(text) if path.suffix == '.json' else yaml.safe_load(text)
    except OSError as error:
        raise ModelError(f'{path}: {error.strerror}') from error
    except (ValueError, yaml.YAMLError) as error:
        reason = ' '.join(str(error).split())
        raise ModelError(f'{path}: neither JSON nor YAML: {reason}') from error
    if not isinstance(document, dict) or document.get('schema') not in _SCHEMAS:
        raise ModelError(f"{path}: its 'schema' has to be {' or '.join(_SCHEMAS)}")
    try:
        return _parameters(str(path), document)
    except (KeyError, TypeError, ValueError) as error:
        raise ModelError(f'{path}: {type(error).__name__} {error} is missing or wrong') from error


def _parameters(source: str, document: dict[str, Any]) -> Parameters:
    rows = list(document.get('parameters', document.get('rigid_parameters', [])))
    for effect in document.get('effects', []):
        rows += effect['parameters']
    values = {
        ParameterName(row['name'], row['joint'], row['unit']): (
            float(row['value']),
            float(row['std']),
        )
        for row in rows
        if row['std'] is not None
    }
    scores = [*document.get('validation', []), document.get('training')]
    error = scores[0]['relative_error_percent'] if scores[0] else None
    return Parameters(source, str(document['robot']), values, error)


def _beyond_chance(pairs: np.ndarray[Any, np.dtype[np.float64]]) -> list[bool]:
    """Tell which differences are beyond chance (Holm 1979); rows are value, std, value, std."""
    std = np.hypot(pairs[:, 1], pairs[:, 3])
    size = np.abs(pairs[:, 2] - pairs[:, 0])
    safe = np.where(std > 0.0, std, 1.0)
    chance = np.where(std > 0.0, erfc(size / safe / np.sqrt(2.0)), (size == 0.0).astype(float))
    beyond = [False] * len(pairs)
    for tried, index in enumerate(np.argsort(chance)):
        if chance[index] > CHANCE / (len(pairs) - tried):
            break
        beyond[int(index)] = True
    return beyond
