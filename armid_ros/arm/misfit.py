# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The misfit of a model: its residual on the recordings of its identification.

The residual of a real arm exceeds the noise, so a diagnosis measures changes in units of the
misfit. The block ``misfit`` of model.yaml has ``unit``, ``data`` (held-out or training), ``rms``
of the residual by joint, and ``relative_error_percent`` of the torque. A misfit grows with the
torque, so ``torque_rms`` has the torque of these recordings. A misfit includes noise, so
``filters`` has the filters of the data.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from armid_ros.errors import ModelError
from armid_ros.files import finite
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

_DATA = ('held-out', 'training')


class RowFilters(NamedTuple):
    """
    Filter settings of an identification: sampling rate [Hz], cut-off [Hz] and decimation.

    The fields are those of `armid_ros.identification.rows.signals.Conditioning`.

    """

    rate_hz: float
    cutoff_hz: float
    decimation: int


@dataclass(frozen=True)
class Misfit:
    """
    Residual of a model on the recordings from which it was identified, for each joint.

    Attributes
    ----------
    data : str
        'held-out', or 'training' if no recording was held out.
    rms : mapping of str to float
        Root mean square residual of each joint [N m].
    relative_error_percent : float
        100 |tau - tau_hat| / |tau| over all joints.
    torque_rms : mapping of str to float, or None
        Root mean square torque of each joint [N m]; None if unknown.
    information : ndarray, shape (P, P), or None
        Inverse covariance of the parameters, from the recordings of the identification; None if
        unknown. It is not in model.yaml.
    unusable : bool
        Whether the grade of the identification was unusable; this is not in model.yaml.
    filters : RowFilters or None
        Filters of the data of the misfit; None if unknown.

    """

    data: str
    rms: Mapping[str, float]
    relative_error_percent: float
    torque_rms: Mapping[str, float] | None = None
    information: FloatArray | None = None
    unusable: bool = False
    filters: RowFilters | None = None

    def document(self) -> dict[str, Any]:
        """Return the misfit as the block ``misfit`` of model.yaml."""
        block = {
            'unit': 'N m',
            'data': self.data,
            'rms': {joint: float(value) for joint, value in self.rms.items()},
            'relative_error_percent': float(self.relative_error_percent),
        }
        if self.torque_rms is not None:
            block['torque_rms'] = {j: float(value) for j, value in self.torque_rms.items()}
        if self.filters is not None:
            block['filters'] = self.filters._asdict()
        return block

    def of(self, robot: Robot, torque_rms: FloatArray | None = None) -> FloatArray:
        """
        Return the rms residual of each joint of a robot, shape (n,) [N m].

        Parameters
        ----------
        robot : Robot
            The arm.
        torque_rms : ndarray, shape (n,), optional
            Root mean square torque of other recordings [N m]; the residual is scaled up by this
            torque if it is larger than in the identification.

        Raises
        ------
        ModelError
            If the misfit has no value for a joint.

        """
        missing = [joint for joint in robot.joints if joint not in self.rms]
        if missing:
            raise ModelError(
                f"the model has no misfit for joint '{missing[0]}'; identify the arm again. "
                f'Joints with a misfit: {", ".join(self.rms)}'
            )
        residual = np.array([self.rms[joint] for joint in robot.joints])
        if torque_rms is None or self.torque_rms is None:
            return residual
        return residual * growth(torque_rms, np.array([self.torque_rms[j] for j in robot.joints]))


def growth(now: FloatArray, before: FloatArray) -> FloatArray:
    """Return the ratio now / before of the rms torques of each joint, at least 1, shape (n,)."""
    return np.asarray(np.maximum(now / np.maximum(before, 1e-12), 1.0))


def misfit_of_block(block: Any) -> Misfit:
    """Read the misfit from the block ``misfit`` of a model.yaml."""
    try:
        rms, torque = _torques(block['rms']), block.get('torque_rms')
        loud = None if torque is None else _torques(torque)
        data, error = str(block['data']), block['relative_error_percent']
        filters = None
        if 'filters' in block:
            found = [finite(block['filters'][n], f'misfit: {n}') for n in RowFilters._fields]
            if min(found) <= 0.0:
                raise ModelError(f'misfit: {", ".join(RowFilters._fields)} have to be positive')
            filters = RowFilters(found[0], found[1], round(found[2]))
    except (AttributeError, KeyError, TypeError) as fault:
        raise ModelError(f"the entry 'misfit' of the model is malformed: {fault}") from fault
    if data not in _DATA:
        raise ModelError(f"misfit: 'data' is '{data}', but has to be {' or '.join(_DATA)}")
    if loud is not None and not loud.keys() >= rms.keys():
        raise ModelError(f"misfit: joint '{min(rms.keys() - loud.keys())}' has no 'torque_rms'")
    relative = finite(error, 'relative_error_percent of the misfit')
    return Misfit(data, rms, relative, loud, filters=filters)


def _torques(block: Any) -> dict[str, float]:
    """Read the rms torque of each joint from a block of model.yaml; ModelError if negative."""
    torques = {
        str(joint): finite(value, f"misfit of joint '{joint}'") for joint, value in block.items()
    }
    negative = [joint for joint, value in torques.items() if value < 0.0]
    if negative:
        raise ModelError(f"misfit: the rms of joint '{negative[0]}' is negative")
    return torques
