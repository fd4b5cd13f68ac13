# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an identifier has learned, as statuses of /diagnostics that people and plotters read."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.estimate import Estimate
from armid_ros.identification.online.change import Change
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

#: A change is a warning for so long [s].
RECENT = 60.0


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
        status.values = _values(estimate)
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
    status.values = [KeyValue(key='changes', value=str(len(changes)))]
    if changes:
        latest = changes[-1]
        age = now - latest.t
        if age < RECENT:
            status.level = DiagnosticStatus.WARN
        status.message = f'{latest}, {age:.0f} s ago'
        status.values += _values(latest.size)
    return status


def _values(estimate: Estimate) -> list[KeyValue]:
    found = []
    for parameter, value, ends in zip(
        estimate.parameters, estimate.values, estimate.interval(), strict=True
    ):
        name = ' '.join(filter(None, (parameter.joint, parameter.name)))
        for suffix, number in (('', value), (' lower', ends[0]), (' upper', ends[1])):
            key = f'{name} [{parameter.unit}]{suffix}'
            found.append(KeyValue(key=key, value=f'{number:.9g}'))
    return found
