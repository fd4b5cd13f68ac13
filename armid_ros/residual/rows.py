# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Residual torques of each joint, with the position, velocity and load of the joint."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.effects.learned import holding_torque
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Number of blocks of the cross-validation; each block is predicted from the others.
BLOCKS = 10


@dataclass(frozen=True)
class JointRows:
    """
    Residual torque, position, velocity and load of one joint in N informative samples.

    Attributes
    ----------
    inputs : ndarray, shape (N, 3)
        Position, velocity, load.
    residual : ndarray, shape (N,)
        Measured torque minus that of the model [N m].
    block : ndarray of int, shape (N,)
        Number of the block of each row, 0 to BLOCKS - 1.

    """

    inputs: FloatArray
    residual: FloatArray
    block: npt.NDArray[np.intp]

    def __len__(self) -> int:
        """Return the number N of samples."""
        return len(self.residual)

    def select(self, chosen: npt.NDArray[np.bool_]) -> JointRows:
        """Return the samples that a mask of shape (N,) selects."""
        return JointRows(self.inputs[chosen], self.residual[chosen], self.block[chosen])

    def folds(self) -> Iterator[npt.NDArray[np.bool_]]:
        """Yield for each nonempty block a mask (N,) of the samples outside the block."""
        for block in range(BLOCKS):
            others = self.block != block
            if others.any() and not others.all():
                yield others


def joint_rows(arm: ArmModel, data: Sequence[Trajectory]) -> list[JointRows]:
    """
    Return the informative samples of each joint, with the residual torque of a model.

    Parameters
    ----------
    arm : ArmModel
        The model.
    data : sequence of Trajectory
        Recordings.

    Returns
    -------
    list of JointRows
        The rows of each joint.

    """
    links = [arm.link_motion(part.at_rows) for part in data]
    q, dq = (np.concatenate([getattr(link, name) for link in links]) for name in ('q', 'dq'))
    inputs = np.stack([q, dq, holding_torque(arm.body, q)], axis=-1)
    residual = np.concatenate([part.residual(arm) for part in data])
    informative = np.concatenate([part.informative for part in data])
    result = []
    for joint in range(residual.shape[1]):
        use = informative[:, joint]
        count = int(use.sum())
        block = np.arange(count) * BLOCKS // max(count, 1)
        result.append(JointRows(inputs[use, joint], residual[use, joint], block))
    return result
