# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Diagnoses as messages."""

from __future__ import annotations

from armid_msgs.msg import Diagnosis
from armid_ros.diagnosis import Finding
from armid_ros.live import Answer
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

#: What each verdict is in /diagnostics: something is wrong where it names or cannot name.
_LEVELS = {
    'consistent': DiagnosticStatus.OK,
    'bad_data': DiagnosticStatus.ERROR,
}


def diagnosis_message(answer: Answer, robot: str, confirmed: bool) -> Diagnosis:
    """Return an answer as a message; the stamp is unset."""
    message = Diagnosis(
        robot=robot,
        verdict=answer.verdict,
        summary=answer.summary,
        window=float(answer.window.duration),
        confirmed=confirmed,
        effect=[finding.name for finding in answer.findings],
        effect_joints=[','.join(finding.joints) for finding in answer.findings],
        share=[float(finding.share) for finding in answer.findings],
        rivals=[','.join(finding.ambiguous_with) for finding in answer.findings],
        gap_joint=[row.joint for row in answer.gap],
        gap_before=[row.before for row in answer.gap],
        gap_after=[row.after for row in answer.gap],
        gap_floor=[row.floor for row in answer.gap],
    )
    for number, finding in enumerate(answer.findings):
        for parameter, value, std in _rows(finding):
            message.name.append(parameter.name)
            message.joint.append(parameter.joint)
            message.unit.append(parameter.unit)
            message.value.append(float(value))
            message.std_dev.append(float(std))
            message.of_effect.append(number)
    return message


def diagnosis_status(name: str, robot: str, answer: Answer | None) -> DiagnosticStatus:
    """Return what /diagnostics says of the last answer: in words, and as numbers to plot."""
    status = DiagnosticStatus(name=name, hardware_id=robot, message='nothing diagnosed so far')
    status.level = DiagnosticStatus.OK
    if answer is None:
        return status
    status.level = _LEVELS.get(answer.verdict, DiagnosticStatus.WARN)
    status.message = f'{answer.verdict.replace("_", " ")}: {answer.summary}'
    numbers = {'processor seconds': answer.seconds, 'window': answer.window.duration}
    for row in answer.gap:
        numbers |= {
            f'gap before {row.joint} [N m]': row.before,
            f'gap after {row.joint} [N m]': row.after,
            f'floor {row.joint} [N m]': row.floor,
        }
    for finding in answer.findings:
        for parameter, value, std in _rows(finding):
            what = ' '.join(filter(None, (finding.name, parameter.joint, parameter.name)))
            numbers |= {f'{what} [{parameter.unit}]': value, f'{what} std': std}
    status.values = [KeyValue(key=k, value=f'{float(x):.9g}') for k, x in numbers.items()]
    return status


def _rows(finding: Finding) -> list[tuple[object, float, float]]:
    return list(zip(finding.parameters, finding.values, finding.std, strict=True))
