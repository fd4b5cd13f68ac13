# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis in short: the arm with the joint that it is about, where, patch, and the gap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis, Finding
from armid_ros.diagnosis.verdict.words import by_cause
from armid_ros.report.arm_picture import ArmPicture, draw_arm
from armid_ros.report.notation import digits, percent, torque_unit
from armid_ros.report.page import render, Section
from armid_ros.residual import JointResidual, Residual
from markupsafe import Markup
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
        What is left without a name, learned.

    """

    title: ClassVar[str] = 'In short'
    template: ClassVar[str] = 'story.html'

    diagnosis: Diagnosis
    residual: Residual | None = None

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints to be pointed out: those of the largest cause, or else the one with the gap."""
        robot = self.diagnosis.arm.robot
        if self.diagnosis.findings:
            named = {joint for one in self._headline for joint in one.joints}
            return tuple(joint for joint in robot.joints if joint in named)
        found = [place.joint for place in self.diagnosis.where] + [m.joint for m in self._maps]
        return tuple(found[:1])

    @property
    def whole_arm(self) -> bool:
        """Whether a cause is one of the whole arm."""
        return any(not finding.joints for finding in self._headline)

    @property
    def _headline(self) -> list[Finding]:
        """Return the cause that explains most."""
        return next(iter(by_cause(self.diagnosis.findings)), [])

    @property
    def picture(self) -> Markup:
        """Return the arm, in a pose that it was in."""
        data = self.diagnosis.data
        q = np.concatenate([part.at_rows.q for part in data]) if data else None
        robot = self.diagnosis.arm.robot
        drawn: ArmPicture = draw_arm(robot, robot.joints if self.whole_arm else self.joints, q)
        return render('arm_picture.html', {'picture': drawn, 'label': self.caption})

    @property
    def caption(self) -> str:
        """Return what the drawing shows."""
        names = ', '.join(one.name.replace('_', ' ') for one in self._headline)
        if self.whole_arm:
            return f'coloured: the whole arm ({names})'
        if not self.joints:
            return 'no joint stands out'
        return f'coloured: {", ".join(self.joints)} ({names or "the largest gap"})'

    @property
    def rows(self) -> list[tuple[str, list[str]]]:
        """Questions and answers."""
        answers = [('Where', self._where()), ('Patch', self._patch()), ('Gap', self._gap())]
        left = self.diagnosis.left
        if self.diagnosis.findings and left:
            answers.append(('Unexplained', [f'{w.joint}: {w.signature}' for w in left[:_JOINTS]]))
        return answers

    def _where(self) -> list[str]:
        places = self.diagnosis.where
        whole = share_of(self.diagnosis)
        lines = [
            f'{place.joint}: {percent(place.share_of_gap)} of {whole}, {place.signature}'
            for place in places[:_JOINTS]
        ]
        if len(places) > _JOINTS:
            rest = sum(place.share_of_gap for place in places[_JOINTS:])
            others = ', '.join(place.joint for place in places[_JOINTS:])
            lines.append(f'{others}: {percent(rest)}')
        unseen = self.diagnosis.not_checked
        if lines or self.diagnosis.verdict == 'consistent':
            none = 'No joint that was checked has a gap.' if unseen else 'No joint has a gap.'
            found = [*self._in_fitted_alone(), *lines] or [none]
            return [*found, f'Not checked: {", ".join(unseen)}.'] if unseen else found
        return ['No joint is far above its floor.']

    def _in_fitted_alone(self) -> list[str]:
        """Say that a gap was located in fitted data, where others have none in its joint."""
        gap, places = self.diagnosis.gap, self.diagnosis.where
        if gap is None or not gap.predicted or not places:
            return []
        joint = places[0].joint
        if gap.chi2_before[self.diagnosis.arm.robot.joints.index(joint)] > 1.0:
            return []
        return [f'In the fitted recordings only; in the held-out ones {joint} is below its floor:']

    def _patch(self) -> list[str]:
        diagnosis = self.diagnosis
        patched = not diagnosis.harmful
        added = [finding.name.replace('_', ' ') for finding in diagnosis.findings if patched]
        if self._maps:
            added.append(f'the learned residual of {", ".join(one.joint for one in self._maps)}')
        if not added:
            return ['The model is unchanged.']
        fitted = diagnosis.refitted and patched
        more = ', with rigid body and friction refitted' if fitted else ''
        return [f'model.yaml is the model with {" and ".join(added)}{more}.']

    @property
    def _maps(self) -> tuple[JointResidual, ...]:
        return () if self.residual is None else self.residual.joints

    def _gap(self) -> list[str]:
        gap = self.diagnosis.gap
        if gap is None:
            return ['Not measured.']
        j = int(np.argmax(gap.chi2_before))
        robot = self.diagnosis.arm.robot
        unit = torque_unit(robot, j)
        before, after, floor = (
            f'{digits(float(x[j]))} {unit}' for x in (gap.before, gap.after, gap.floor)
        )
        where = 'on held-out recordings' if gap.predicted else f'on {gap.data}'
        if not self.diagnosis.findings:
            change = after
        else:
            change = f'{before} before, {after} after'
        least = f'The floor, {floor}, is {self.diagnosis.baseline}.'
        return [f'{robot.joints[j]}: {change}, {where}.', least, *map(_taken, self._maps)]


def share_of(diagnosis: Diagnosis) -> str:
    """Return what the shares of joints are of: where something is named, of what it explains."""
    return 'the explained part' if diagnosis.findings else 'the gap'


def _taken(one: JointResidual) -> str:
    """Return how much of what is left of a joint its map predicts."""
    return (
        f'{one.joint}: the map predicts {percent(one.gain)} of the residual without a known cause.'
    )
