# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of an identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from armid_ros.arm import ArmModel
from armid_ros.identification import Fit, Grade, Identification, Verification
from armid_ros.identification import grade as graded
from armid_ros.identification.fitting.least_squares import IN_WORDS
from armid_ros.recording import Recording
from armid_ros.report.blocks import ContentSection, FactList
from armid_ros.report.families import effects_in_words
from armid_ros.report.judgement import judge
from armid_ros.report.notation import counted, robot_label
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.assessment import (
    excitation_section,
    noise_section,
    physical_section,
)
from armid_ros.report.sections.data_quality import data_quality_section
from armid_ros.report.sections.fit import by_recording, error_bars, fit_section, forward_section
from armid_ros.report.sections.frame import next_steps_section, Origin, VerdictSection
from armid_ros.report.sections.parameters import parameter_section
from armid_ros.report.sections.residuals import residual_section, whiteness_section
from armid_ros.report.statistics import directions, torque_reach, torque_scale

#: Colour of each grade.
TONES = {'good': 'good', 'poor': 'fair', 'unusable': 'bad'}


@dataclass(frozen=True)
class Assessment:
    """
    How an identification was assessed, apart from predicting recordings.

    Attributes
    ----------
    verification : Verification or None
        Test for encoder noise, and simulations.
    grade : Grade or None
        What it is good for; found out where it is not given.
    exports : mapping of str to sequence of str
        Files for other programs, and what each has no place for.
    reference : str
        What parameters are compared with: the 'description', or in a simulation the 'truth'.
    sections : sequence of Section
        Further sections, shown before the next steps.

    """

    verification: Verification | None = None
    grade: Grade | None = None
    exports: Mapping[str, Sequence[str]] = field(default_factory=dict)
    reference: str = 'description'
    sections: Sequence[Section] = ()


def identification_report(
    result: Identification,
    *,
    description: ArmModel,
    robot: str,
    recordings: Sequence[Recording],
    validation: Mapping[str, Sequence[Fit]],
    validation_recordings: Sequence[Recording] = (),
    assessment: Assessment | None = None,
    provenance: Provenance | None = None,
) -> str:
    """
    Return report.html of an identification.

    Parameters
    ----------
    result : Identification
        What was found.
    description : ArmModel
        The model before the identification, to compare parameters with.
    robot : str
        Shipped name or path of the description.
    recordings : sequence of Recording
        Training data.
    validation : mapping of str to sequence of Fit
        Predictions of recordings that were not used for fitting, by recording.
    validation_recordings : sequence of Recording
        Those recordings.
    assessment : Assessment, optional
        What the identification was put to.
    provenance : Provenance, optional
        Files, versions, settings, seed.

    Returns
    -------
    str
        One HTML file that loads nothing.

    """
    described, assessment = result.arm.robot, assessment or Assessment()
    verification, grade = assessment.verification, assessment.grade
    training = by_recording(result.training)
    held_out = [fit for fits in validation.values() for fit in fits]
    role = 'held-out' if held_out else 'training'
    shown = held_out or list(result.training)
    if grade is None:
        grade = graded(result, description, recordings, validation, validation_recordings)
    judgement = judge(result, validation, [*recordings, *validation_recordings], verification)
    sentences = (*grade.reasons, *judgement.sentences)
    read = [
        *((one, 'training', training.get(one.source, ())) for one in recordings),
        *((one, 'held-out', validation.get(one.source, ())) for one in validation_recordings),
    ]
    worst = directions(result.estimate, torque_scale(result))
    forward, noise = (verification.forward, verification.noise) if verification else ((), None)
    sections: list[Section] = [
        VerdictSection(
            grade.word,
            TONES[grade.word],
            sentences,
            judgement.beware,
            error_bars(described, training, validation),
        ),
        next_steps_section(judgement.next_steps),
        fit_section(described, training, validation, torque_reach(result, shown)),
        *([forward_section(described, forward)] if forward else []),
        residual_section(described, shown, role),
        parameter_section(
            result.estimate,
            result.base.values(description.theta),
            result.unidentified,
            described.links,
            assessment.reference,
        ),
        *([physical_section(result.physical, assessment.exports)] if result.physical else []),
        excitation_section(result.condition_number, result.base.rank, worst, described.links),
        whiteness_section(described, shown, role),
        *([] if noise is None else [noise_section(described, noise)]),
        *assessment.sections,
        data_quality_section(read, described),
        _asked(result, robot, list(training), list(validation)),
        Origin(provenance or Provenance()),
    ]
    subtitle = (
        f'{robot_label(robot)} · {counted(len(training), "training recording")} · '
        f'{counted(len(validation), "held-out recording")}'
    )
    return Page(f'Identification of {described.name}', subtitle, sections).html()


def _asked(
    result: Identification, robot: str, training: Sequence[str], validation: Sequence[str]
) -> ContentSection:
    gravity = ', '.join(f'{g:.4g}' for g in result.arm.robot.gravity)
    used = result.used
    kept = used.rate_hz / used.decimation
    facts = [
        ('Robot', robot),
        ('Joints', ', '.join(result.arm.robot.joints)),
        ('Gravity', f'({gravity}) m/s²'),
        ('Effects', effects_in_words(result.arm.effects)),
        ('Method', IN_WORDS[result.settings.method]),
        (
            'Filter',
            f'positions below {used.cutoff_hz:.3g} Hz of {used.rate_hz:.4g} Hz; torque and model '
            f'alike, then one sample of {used.decimation} kept ({kept:.3g} Hz)',
        ),
        ('Fitted to', ', '.join(training)),
        ('Held out', ', '.join(validation) or 'nothing'),
    ]
    return ContentSection('What was asked', [FactList(facts)])
