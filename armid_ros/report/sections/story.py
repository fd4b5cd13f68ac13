# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis in short: the arm with the joint that it is about, where, patch, and the gap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis, Finding
from armid_ros.diagnosis.verdict.words import by_cause
from armid_ros.report.arm_drawing import ArmDrawing, draw_arm
from armid_ros.report.notation import digits, percent
from armid_ros.report.page import Section
from armid_ros.residual import JointResidual, Residual
import numpy as np

#: Joints of the gap that are listed one by one.
_JOINTS = 2


@dataclass(frozen=True)
class Story(Section):
    """
    The answers to the questions that a person has, in their order.

    Attributes
    ----------
    diagnosis : Diagnosis
        What was found.
    residual : Residual or None
        The learned residual.

    """

    title: ClassVar[str] = 'In short'
    template: ClassVar[str] = 'story.html'

    diagnosis: Diagnosis
    residual: Residual | None = None

    @property
    def drawing(self) -> ArmDrawing:
        """Return the arm in a pose that it was in, with joints of the largest cause coloured."""
        data, robot = self.diagnosis.data, self.diagnosis.arm.robot
        cause: list[Finding] = next(iter(by_cause(self.diagnosis.findings)), [])
        names = ', '.join(one.name.replace('_', ' ') for one in cause)
        found = [place.joint for place in self.diagnosis.where] + [m.joint for m in self._maps]
        named = {joint for one in cause for joint in one.joints}
        joints = [joint for joint in robot.joints if joint in named] if cause else found[:1]
        caption = f'coloured: {", ".join(joints)} ({names or "the largest gap"})'
        if any(not one.joints for one in cause):
            joints, caption = list(robot.joints), f'coloured: the whole arm ({names})'
        q = np.concatenate([part.at_rows.q for part in data]) if data else None
        return draw_arm(robot, joints, q, caption if joints else 'no joint stands out')

    @property
    def rows(self) -> list[tuple[str, list[str]]]:
        """Questions and answers."""
        answers = [('Where', self._where()), ('Patch', self._patch()), ('Gap', self._gap())]
        rest = self.diagnosis.left
        if self.diagnosis.findings and rest:
            answers.append(('Unexplained', [f'{w.joint}: {w.signature}' for w in rest[:_JOINTS]]))
        return answers

    @property
    def _maps(self) -> tuple[JointResidual, ...]:
        return () if self.residual is None else self.residual.joints

    def _where(self) -> list[str]:
        places, whole = self.diagnosis.where, share_of(self.diagnosis)
        lines = [
            f'{place.joint}: {percent(place.share_of_gap)} of {whole}, {place.signature}'
            for place in places[:_JOINTS]
        ]
        if len(places) > _JOINTS:
            rest = sum(place.share_of_gap for place in places[_JOINTS:])
            others = ', '.join(place.joint for place in places[_JOINTS:])
            lines.append(f'{others}: {percent(rest)}')
        unseen = self.diagnosis.not_checked
        if not lines and self.diagnosis.verdict != 'consistent':
            return ['No joint is far above its floor.']
        none = 'No joint that was checked has a gap.' if unseen else 'No joint has a gap.'
        gap, joints = self.diagnosis.gap, self.diagnosis.arm.robot.joints
        if gap is not None and gap.predicted and places:
            joint = places[0].joint
            if gap.chi2_before[joints.index(joint)] <= 1.0:
                held_out = f'in the held-out ones {joint} is below its floor'
                lines.insert(0, f'In the fitted recordings only; {held_out}:')
        lines = lines or [none]
        return [*lines, f'Not checked: {", ".join(unseen)}.'] if unseen else lines

    def _patch(self) -> list[str]:
        diagnosis = self.diagnosis
        patched = not diagnosis.harmful
        added = [finding.name.replace('_', ' ') for finding in diagnosis.findings if patched]
        if self._maps:
            added.append(f'the learned residual of {", ".join(one.joint for one in self._maps)}')
        if not added:
            return ['The model is unchanged.']
        more = ', with rigid body and friction refitted' * (diagnosis.refitted and patched)
        return [f'model.yaml is the model with {" and ".join(added)}{more}.']

    def _gap(self) -> list[str]:
        gap, robot = self.diagnosis.gap, self.diagnosis.arm.robot
        if gap is None:
            return ['Not measured.']
        j = int(np.argmax(gap.chi2_before))
        before, after, floor = (
            f'{digits(float(x[j]))} {robot.torque_units[j]}'
            for x in (gap.before, gap.after, gap.floor)
        )
        where = 'on held-out recordings' if gap.predicted else f'on {gap.data}'
        change = f'{before} before, {after} after' if self.diagnosis.findings else after
        return [
            f'{robot.joints[j]}: {change}, {where}.',
            f'The floor, {floor}, is {self.diagnosis.baseline}.',
            *(
                f'{one.joint}: the map predicts {percent(one.gain)} of the residual without a '
                'known cause.'
                for one in self._maps
            ),
        ]


def share_of(diagnosis: Diagnosis) -> str:
    """Return what the shares of joints are of: where something is named, of what it explains."""
    return 'the explained part' if diagnosis.findings else 'the gap'
