# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of two links on springs: stiffness and responses of the joints."""

from __future__ import annotations

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.papers.elastic.identification.three_steps import TwoInertiaIdentification
from armid_ros.papers.elastic.report.parameters import parameters_section, rigid_section
from armid_ros.papers.elastic.report.steps import decibels_apart, responses_section, steps_section
from armid_ros.report.notation import counted, digits
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.frame import Origin, VerdictSection
from armid_ros.robots.two_link import TwoLinkParameters

#: Largest difference of measured decoupled response and model for a good grade [dB rms].
_CLOSE_DB = 0.5


def elastic_report(
    result: TwoInertiaIdentification,
    robot: str,
    known: TwoLinkParameters | None,
    source: str,
    provenance: Provenance,
) -> str:
    """
    Return report.html of an identification of elastic joints.

    Parameters
    ----------
    result : TwoInertiaIdentification
        Results of the three steps.
    robot : str
        Its name.
    known : TwoLinkParameters or None
        Reference parameters for comparison.
    source : str
        Source of the reference parameters.
    provenance : Provenance
        Files, versions, settings, seed.

    """
    sections: list[Section] = [verdict(result), responses_section(result)]
    if result.tuning is not None:
        sections.append(steps_section(result.tuning))
    sections += [
        parameters_section(result, known, source),
        rigid_section(result.rigid),
        Origin(provenance),
    ]
    steps = 0 if result.tuning is None else result.tuning.measured.shape[1]
    subtitle = f'{robot} · {counted(result.experiments, "experiment")} through the resonances'
    subtitle += f' · {counted(steps, "step response")}'
    return Page(f'Elastic joints of {robot}', subtitle, sections).html()


def verdict(result: TwoInertiaIdentification) -> VerdictSection:
    """Say how stiff the springs are, how surely, and what is not known."""
    springs = []
    for k, joint in enumerate(result.joints):
        value = f'{result.parameters.stiffness[k]:.0f}'
        if result.tuning is not None:
            estimate = result.tuning.estimate
            value += f' ± {HALF_WIDTH * estimate.std[estimate.index("kg", joint)]:.0f}'
        springs.append(f'{value} N m/rad at {joint}')
    interval = ' (95 %)' if result.tuning is not None else ''
    sentences = [f'The joint stiffness is {" and ".join(springs)}{interval}.']
    poor = [
        joint for k, joint in enumerate(result.joints) if decibels_apart(result, k) > _CLOSE_DB
    ]
    beware = (
        [
            f'{", ".join(poor)}: the measured response differs from that of motor, spring and '
            f'link by more than {_CLOSE_DB:g} dB.'
        ]
        if poor
        else []
    )
    step = 'Use the parameters of elastic.json for the controller, or in a simulation.'
    if result.tuning is None:
        step = 'Record step responses, and add them with --steps.'
        beware.append('Without step responses the parameters have no intervals.')
    else:
        before, after = result.tuning.rms
        sentences.append(
            f'The error of the step responses fell from {digits(before)} to {digits(after)} rad/s '
            'rms by tuning, noise included.'
        )
        beware.append(
            'Viscous friction of link and motor are known as a sum; their shares are not.'
        )
    if poor:
        step = f'Look at the frequency responses of {", ".join(poor)}.'
    grade, tone = ('uncertain', 'fair') if poor else ('found', 'good')
    return VerdictSection(grade, tone, sentences, beware, step=step)
