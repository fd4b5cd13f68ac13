# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Page of an identification: verdict, torques, parameters, data quality."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from armid_ros.arm import ArmModel
from armid_ros.estimate import Estimate
from armid_ros.identification import Fit, Grade, Identification, PhysicalCertificate, Verification
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.fitting.instruments import NoiseCheck
from armid_ros.identification.fitting.least_squares import IN_WORDS
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.report.blocks import (
    BulletList,
    DataTable,
    FactList,
    next_steps,
    Panels,
    Paragraph,
    TableCell,
    VerdictSection,
)
from armid_ros.report.charts import Chart, Series
from armid_ros.report.judgement import findings_of, judge
from armid_ros.report.notation import counted, digits, plain, pretty, robot_label, sentence
from armid_ros.report.page import Page, Section
from armid_ros.report.parameter_tables import (
    arm_facts,
    full_label,
    parameter_section,
)
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
from armid_ros.report.sections.data_quality import data_quality_section
from armid_ros.report.sections.fit import error_bars, fit_section, forward_section
from armid_ros.report.statistics import residual_section, torque_reach, whiteness_section
from armid_ros.robots import Robot
import numpy as np

#: Colour of each grade.
TONES = {'good': 'good', 'poor': 'fair', 'unusable': 'bad'}


def identification_report(
    result: Identification,
    grade: Grade,
    *,
    description: ArmModel,
    recordings: Sequence[Recording],
    validation: Mapping[str, Sequence[Fit]],
    verification: Verification | None = None,
    parameters: Sequence[Section] = (),
    origin: ResultOrigin = DEFAULT_ORIGIN,
) -> str:
    """
    Return the HTML page of an identification.

    Parameters
    ----------
    result : Identification
        The identified model.
    grade : Grade
        Its grade.
    description : ArmModel
        The model before the identification.
    recordings : sequence of Recording
        Training data and held-out data.
    validation : mapping of str to sequence of Fit
        Predictions of recordings that were not used for fitting, by recording.
    verification : Verification, optional
        Test for encoder noise, and simulations.
    parameters : sequence of Section
        Sections on the parameters, by `parameter_sections`.
    origin : ResultOrigin
        Robot, files, versions, settings, seed.

    """
    described = result.arm.robot
    training: dict[str, list[Fit]] = {}
    for fit in result.training:
        training.setdefault(fit.source, []).append(fit)
    held_out = [fit for fits in validation.values() for fit in fits]
    role = 'held-out' if held_out else 'training'
    shown = held_out or list(result.training)
    unusable = grade.word == 'unusable'
    beware, steps = judge(result, validation, recordings, verification, unusable)
    read = [
        (one, 'held-out', validation[one.source])
        if one.source in validation
        else (one, 'training', training.get(one.source, ()))
        for one in recordings
    ]
    forward, noise = (verification.forward, verification.noise) if verification else ((), None)
    verdict = VerdictSection(
        grade.word,
        TONES[grade.word],
        (*grade.reasons, *findings_of(result, description, verification)),
        beware,
        error_bars(described, training, validation, result.halves),
        ''.join(steps[:1]),
        origin.step,
    )
    sections = [
        fit_section(described, training, validation, torque_reach(result, shown)),
        *next_steps(steps),
        *([forward_section(described, forward)] if forward else []),
        residual_section(described, shown, role),
        *parameters,
        whiteness_section(described, shown, role),
        *([] if noise is None else [_noise_section(described, noise)]),
        data_quality_section(read, described),
        _input_section(result, origin.robot),
    ]
    subtitle = f'{robot_label(origin.robot)} · {counted(len(training), "training recording")}'
    if validation:
        subtitle += f' · {counted(len(validation), "recording")} not used for the fit'
    title, names = f'Identification of {described.name}', (*described.joints, *described.links)
    return Page(title, subtitle, verdict, sections, origin.provenance, names).html()


def parameter_sections(
    result: Identification,
    reference: ArmModel,
    exports: Mapping[str, Sequence[str]] | None = None,
    name: str = 'description',
) -> list[Section]:
    """
    Return the sections on all parameters and, if it was enforced, on physical consistency.

    Parameters
    ----------
    result : Identification
        The identified model.
    reference : ArmModel
        Model to compare the parameters with.
    exports : mapping of str to sequence of str, optional
        Exported files, and the values that each cannot contain.
    name : str
        What the reference is: the 'description', or in a simulation the 'truth'.

    """
    values, links = result.base.values(reference.theta), result.arm.robot.links
    return [
        parameter_section(result.estimate, values, result.unidentified, links, name),
        *([_physical_section(result.physical, exports or {})] if result.physical else []),
    ]


def _input_section(result: Identification, robot: str) -> Section:
    """Return the section with robot, method, filter and excitation."""
    used = result.used
    kept = used.rate_hz / used.decimation
    facts = [
        *arm_facts(result.arm, robot),
        ('Method', IN_WORDS[result.settings.method]),
        (
            'Filter',
            f'low-pass of positions at {used.cutoff_hz:.3g} Hz, sampled at {used.rate_hz:.4g} Hz; '
            f'the same for torque and regressor; then decimation by {used.decimation} to '
            f'{kept:.3g} Hz',
        ),
        (
            'Excitation',
            f'identifies {counted(result.base.rank, "parameter")}; condition number of the '
            f'weighted regressor {plain(result.condition_number)}',
        ),
    ]
    return Section('Input', [FactList(facts)])


def _noise_section(robot: Robot, check: NoiseCheck) -> Section:
    """Return the section on encoder noise: its size, the test for bias, and the bias."""
    noise = ', '.join(
        f'{joint} {digits(1e3 * value)} m{unit}'
        for joint, value, unit in zip(
            robot.joints, check.position_noise, robot.position_units, strict=True
        )
    )
    return Section(
        'Encoder noise',
        [
            Paragraph(
                'Least squares assumes exact positions. The Durbin-Wu-Hausman test compares the '
                'fit with an instrumental-variable fit, which encoder noise does not bias. The '
                f'position noise of the recordings is {noise}.'
            ),
            BulletList(
                [(sentence(text), 'fine' if fine else 'warn') for text, fine in check.findings()]
            ),
        ],
    )


def _physical_section(
    certificate: PhysicalCertificate, exports: Mapping[str, Sequence[str]]
) -> Section:
    """Return the section on physical consistency: mass, moments, pseudo-inertia of each link."""
    quantifier = 'Every' if certificate.consistent else 'Not every'
    training, held_out = (
        100.0 * (ratio - 1.0) for ratio in (certificate.misfit_ratio, certificate.held_out_ratio)
    )
    rows = []
    for link, share in zip(certificate.links, certificate.shares, strict=True):
        active = link.link in certificate.active
        rows.append(
            (
                link.link,
                f'{link.mass:.4g}',
                ', '.join(f'{value:.3g}' for value in link.moments),
                f'{link.eigenvalues[0]:.3g}',
                digits(float(share)),
                TableCell('active', 'telling') if active else 'inactive',
            )
        )
    heads = (
        'Link',
        'Mass [kg]',
        'Principal moments [kg m²]',
        'Smallest eigenvalue',
        'Over its prior',
        'Constraint',
    )
    activity = [(sentence(line), '') for line in certificate.constraint_notes]
    homeless = []
    for file, lines in exports.items():
        kinds = Counter(line.split(':')[0] for line in lines)
        if kinds:
            named = ', '.join(f'{kind} ({counted(n, "value")})' for kind, n in kinds.items())
            text = f'{file} cannot contain {named}: a comment in the file lists the values.'
            homeless.append(Paragraph(text))
    return Section(
        'Physical consistency',
        [
            Paragraph(
                f'{quantifier} link is physically consistent: all four eigenvalues of the '
                'pseudo-inertia have to be positive. The constraints change the torque error by '
                f'{training:.2f} % on the training data and by {held_out:+.2f} % in '
                f'cross-validation. Cross-validation chose {certificate.weight:g} as the weight '
                'of the description.'
            ),
            DataTable(heads, rows, (0, 2, 5)),
            BulletList(activity or [('No constraint is active.', 'fine')]),
            *homeless,
        ],
    )


def convergence_section(history: Sequence[tuple[float, Estimate]], truth: FloatArray) -> Section:
    """
    Return the section with online estimates over time and the true values.

    Parameters
    ----------
    history : sequence of (float, Estimate)
        Times since the start [s], and estimates of P parameters.
    truth : ndarray, shape (P,)
        True values.

    """
    t, parameters = np.array([at for at, _ in history]), history[-1][1].parameters
    values = np.array([estimate.values for _, estimate in history])
    reach = HALF_WIDTH * np.array([estimate.std for _, estimate in history])
    seen: Counter[str] = Counter()
    turns = []
    for k in np.argsort(-np.abs(truth) / reach[-1]):
        unit = parameters[k].unit
        turns.append((seen[unit], k))
        seen[unit] += 1
    panels = []
    for k in sorted(k for _, k in sorted(turns)[:6]):
        # an interval that is much wider than the value would fill the chart
        known = reach[:, k] < 3.0 * (abs(truth[k]) + reach[-1, k])
        lower, upper, drawn = (
            np.where(known, curve, np.nan)
            for curve in (values[:, k] - reach[:, k], values[:, k] + reach[:, k], values[:, k])
        )
        chart = Chart(
            t,
            [
                Series('95 % interval', lower, 'floor', 'band', upper),
                Series('online estimate', drawn, 'residual'),
            ],
            'time [s]',
            f'estimate [{pretty(parameters[k].unit)}]',
            height=170,
            link='convergence',
            levels=[(float(truth[k]), 'truth')],
            legend=False,
        )
        panels.append((full_label(parameters[k]), '', [chart]))
    text = (
        'Six parameters over time, the best-determined one of each unit first. The band is the '
        '95 % interval of the online estimate; the line is the true value.'
    )
    title = 'Convergence of the online estimate'
    return Section(title, [Paragraph(text), Panels(panels, three=True)])
