# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torques that do not change while their joint moves.

A passive joint and a drive at its limit have such torques, too: the model takes next to none of
the one, and the other is the highest there is.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armid_ros.arm import ArmModel
from armid_ros.identification.rows.checks import SILENT
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.recording.series import NOTHING
import numpy as np

#: For so long [s], and while the joint goes so far of its way.
_LONG, _FAR = 1.0, 0.2
#: Share of weight or inertia by which what the model takes has to change meanwhile; of a passive
#: joint the two cancel.
_TAKEN = 0.5


def dead_channels(arm: ArmModel, recording: Recording, motions: Sequence[Motion]) -> Iterator[str]:
    """
    Say whose torque stays the same, though the joint moves and takes another one.

    Where it is that of every joint, nobody measured any, and that alone is said.

    Parameters
    ----------
    arm : ArmModel
        What is believed of the arm.
    recording : Recording
        As it was read, with torques.
    motions : sequence of Motion
        Its stretches, filtered.

    Yields
    ------
    str
        Recording, joint, time and remedy, without a full stop.

    """
    assert recording.tau is not None
    if np.all(np.ptp(recording.tau, axis=0) < NOTHING):
        yield f'in {recording.source or "a recording"} {SILENT}'
        return
    units = arm.robot.torque_units
    t, least = recording.t, max(2, round(_LONG / recording.period))
    for j, joint in enumerate(recording.joints):
        reading, q = recording.tau[:, j], recording.q[:, j]
        start, stop = _longest_same(reading)
        moved = float(np.ptp(q[start:stop])) > _FAR * float(np.ptp(q))
        top = float(np.abs(reading).max())
        at_limit = 0.0 < top == abs(reading[start]) and stop - start < len(reading)
        if stop - start < least or not moved or at_limit:
            continue
        if _changes(arm, motions, j, float(t[start]), float(t[stop - 1])):
            always = stop - start == len(reading)
            when = 'throughout' if always else f'from {t[start]:.3f} s to {t[stop - 1]:.3f} s'
            value = f'{reading[start] + 0.0:.4g} {units[j]}'
            remedy = 'record with the joint held still' if always else 'leave that time out'
            yield (
                f'in {recording.source or "a recording"} the torque of {joint} stays at '
                f'{value} {when} while the joint moves: its channel is dead; {remedy}'
            )


def _longest_same(reading: FloatArray) -> tuple[int, int]:
    """Return where the longest run of one value starts and stops."""
    edges = np.flatnonzero(np.abs(np.diff(reading)) > NOTHING) + 1
    bounds = np.concatenate([[0], edges, [len(reading)]])
    longest = int(np.argmax(np.diff(bounds)))
    return int(bounds[longest]), int(bounds[longest + 1])


def _changes(
    arm: ArmModel, motions: Sequence[Motion], joint: int, start: float, stop: float
) -> bool:
    """Return whether what the model takes of a joint changes between two times."""
    for motion in motions:
        inside = (motion.t >= start) & (motion.t <= stop)
        if np.count_nonzero(inside) < 2:
            continue
        load = arm.load(motion)[inside, joint]
        weight = arm.load(motion.at_rest())[inside, joint]
        largest = max(float(np.std(weight)), float(np.std(load - weight)))
        if float(np.std(load)) > _TAKEN * largest > 0.0:
            return True
    return False
