# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Report and JSON document of the identification of a two-link arm with elastic joints."""

from __future__ import annotations

from typing import Any

from armid_ros.estimate import measured, name_in_words, parameter_table
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.papers.elastic.identification.interaction import (
    BAND,
    decibel_error,
    frequencies,
    ideal_response,
)
from armid_ros.papers.elastic.identification.response import (
    parameter_names,
    PER_JOINT,
    unpack,
    velocities,
)
from armid_ros.papers.elastic.identification.rigid import CUTOFF, RigidFit
from armid_ros.papers.elastic.identification.three_steps import Tuning, TwoInertiaIdentification
from armid_ros.report.blocks import DataTable, FactList, Panels, Paragraph, VerdictSection
from armid_ros.report.charts import Chart, Kind, Role, Series
from armid_ros.report.notation import counted, digits, pretty
from armid_ros.report.page import Page, Section, Templated
from armid_ros.report.provenance import Provenance
from armid_ros.robots.two_link import TwoLinkParameters
import numpy as np
import numpy.typing as npt

#: Largest rms difference between measured decoupled response and model for a good grade [dB].
_MAX_ERROR_DB = 0.5


def elastic_report(
    result: TwoInertiaIdentification,
    robot: str,
    known: TwoLinkParameters | None,
    source: str,
    provenance: Provenance,
) -> str:
    """
    Return the HTML page of the identification of a two-link arm with elastic joints.

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
    sections = [responses_section(result)]
    if result.tuning is not None:
        sections.append(steps_section(result.tuning))
    sections += [
        _parameters_section(result, known, source),
        rigid_section(result.rigid),
    ]
    steps = 0 if result.tuning is None else result.tuning.measured.shape[1]
    subtitle = f'{robot} · {counted(result.experiments, "experiment")} through the resonances'
    subtitle += f' · {counted(steps, "step response")}'
    title = f'Elastic joints of {robot}'
    return Page(title, subtitle, verdict(result), sections, provenance).html()


def verdict(result: TwoInertiaIdentification) -> VerdictSection:
    """Return the verdict box: stiffness with 95 % intervals, and joints with a poor fit."""
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
        joint for k, joint in enumerate(result.joints) if response_error(result, k) > _MAX_ERROR_DB
    ]
    beware = (
        [
            f'{", ".join(poor)}: the measured response differs from that of motor, spring and '
            f'link by more than {_MAX_ERROR_DB:g} dB.'
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
        beware.append('Only the sum of the viscous friction of link and motor is identifiable.')
    if poor:
        step = f'Look at the frequency responses of {", ".join(poor)}.'
    grade, tone = ('uncertain', 'fair') if poor else ('found', 'good')
    return VerdictSection(grade, tone, sentences, beware, step=step)


#: Parameters in words, by their symbols in elastic.json.
IN_WORDS = {
    'alpha': 'inertia of link 1',
    'beta': 'inertia of link 2',
    'gamma': 'coupling of both links',
    **{symbol: name_in_words(field) for field, symbol, _ in PER_JOINT},
    'dl + dm gear^2': 'total damping',
    'alpha + mm gear^2': 'inertia of link 1 and motor 1',
    'mm gear^2': 'motor inertia at the joint',
    'fm gear': 'Coulomb torque at the joint',
}


def _parameters_section(
    result: TwoInertiaIdentification, known: TwoLinkParameters | None, source: str
) -> Section:
    """Return the section with parameters, 95 % intervals and reference values."""
    untuned = np.concatenate([unpack(result.untuned), result.untuned.total_damping])
    text = 'Fitted to the frequency responses. Step responses would add 95 % intervals.'
    heads = ['Parameter', 'Symbol', 'Joint', 'Estimate']
    if result.tuning is not None:
        text = (
            'Tuned to the step responses. Only the sum dl + dm gear² of link and motor damping is '
            'identifiable; its division between both is that of the start values.'
        )
        heads += ['± 95 %', 'Untuned']
    if known is not None:
        text += f' Compared with {source}.'
        heads += ['Known', 'Difference']
        base = np.concatenate([unpack(known), known.total_damping])
    rows = []
    document = elastic_document(result, '')
    for k, one in enumerate([*document['parameters'], *document.get('total_damping', [])]):
        value, std = one['value'], one['std']
        row = [IN_WORDS[one['name']], pretty(one['name']), one['joint']]
        if std is None:
            row.append(f'{value:.4g}')
        else:
            row += [*measured(value, HALF_WIDTH * std), digits(untuned[k], 4)]
        if known is not None:
            row += [f'{base[k]:g}', f'{100.0 * (value / base[k] - 1.0):+.2f} %']
        rows.append([*row, pretty(one['unit'])])
    table = DataTable([*heads, 'Unit'], rows, words=(0, 1, 2, len(heads)))
    return Section('Parameters', [Paragraph(text), table])


def rigid_section(fit: RigidFit) -> Section:
    """Return the section with the parameters of the fit with rigid joints (step 1)."""
    estimate = fit.estimate
    rows = [
        (
            IN_WORDS[name.name],
            pretty(name.name),
            name.joint,
            *measured(value, HALF_WIDTH * std),
            pretty(name.unit),
        )
        for name, value, std in zip(
            estimate.parameters, estimate.values, estimate.std, strict=True
        )
    ]
    text = (
        f'Step 1, least squares below {CUTOFF:g} Hz. Motor and link inertia of joint 1 are '
        f'identifiable only as a sum, and so is the friction of motors and links. The relative '
        f'torque error is {fit.relative_error:.2f} %.'
    )
    heads = ('Parameter', 'Symbol', 'Joint', 'Estimate', '± 95 %', 'Unit')
    return Section('Rigid arm', [Paragraph(text), DataTable(heads, rows, words=(0, 1, 2, 5))])


#: Frequency ranges of the plots and of the comparison of responses [Hz].
_SHOWN_BAND, _COMPARED_BAND = (2.0, 100.0), (5.0, 60.0)
_SIZE = 'magnitude [dB re rad/(N m s)]'


def responses_section(result: TwoInertiaIdentification) -> Section:
    """Return the section with the frequency responses from motor torque to motor velocity."""
    text = (
        'Motor velocity per motor torque at each frequency. At the dip (antiresonance), the link '
        'swings on its spring; at the peak (resonance), motor and link swing against each other. '
        'Decoupled: without the torque of the other joint. Drag across a plot, or pinch it, to '
        'zoom; double-click or double-tap to reset.'
    )
    hint = (
        'Dashed lines: antiresonance and resonance of the joint alone. Errors are from 5 to 60 Hz.'
    )
    panels = [(joint, '', _joint(result, k)) for k, joint in enumerate(result.joints)]
    return Section(
        'Frequency responses', [Paragraph(text), Panels(panels), Paragraph(hint, 'hint')]
    )


def response_error(
    result: TwoInertiaIdentification, joint: int, *, decoupled: bool = True
) -> float:
    """Return the rms error [dB] of a joint's modelled frequency response, 5 to 60 Hz."""
    measured = result.measured[joint]
    seen = (measured.frequency >= _COMPARED_BAND[0]) & (measured.frequency <= _COMPARED_BAND[1])
    ideal = ideal_response(result.parameters, joint, measured.frequency[seen])[:, 0, 0]
    found = measured.decoupled if decoupled else measured.coupled
    return decibel_error(found[seen, 0], ideal)


def _joint(result: TwoInertiaIdentification, k: int) -> list[Templated]:
    """Return charts of the frequency response of joint k, with resonances and model errors."""
    measured = result.measured[k]
    seen = (measured.frequency >= _SHOWN_BAND[0]) & (measured.frequency <= _SHOWN_BAND[1])
    own = measured.frequency[seen]
    frequency = np.unique(np.concatenate([np.geomspace(*_SHOWN_BAND, 300), own]))
    points = np.full((2, len(frequency)), np.nan, complex)
    points[:, np.searchsorted(frequency, own)] = (
        measured.decoupled[seen, 0],
        measured.coupled[seen, 0],
    )
    linear = result.systems[k].response(frequency)[:, 0, 0]
    physical = ideal_response(result.parameters, k, frequency)[:, 0, 0]
    curves: list[tuple[str, npt.NDArray[np.complex128], Role, Kind]] = [
        ('measured, with the other joint', points[1], 'faint', 'points'),
        ('any linear model', linear, 'residual', 'line'),
        ('motor, spring and link', physical, 'predicted', 'line'),
        ('measured, decoupled', points[0], 'measured', 'points'),
    ]
    magnitude = [
        Series(name, 20.0 * np.log10(np.abs(x)), role, kind) for name, x, role, kind in curves
    ]
    phase = [
        Series(name, np.degrees(np.angle(x)), role, kind) for name, x, role, kind in curves[1:]
    ]
    low, high = (float(both[k]) for both in frequencies(result.parameters))
    marks = [
        (low, f'{low:.1f} Hz', True),
        (high, f'{high:.1f} Hz', False),
    ]
    shared: dict[str, Any] = {'link': 'frequency', 'logarithmic': True}
    facts = [
        ('Antiresonance, resonance of the joint', f'{low:.2f} Hz, {high:.2f} Hz'),
        ('Error of the joint model, decoupled', f'{response_error(result, k):.2f} dB rms'),
        (
            'Error of the joint model, with the other joint',
            f'{response_error(result, k, decoupled=False):.1f} dB rms',
        ),
    ]
    return [
        Chart(frequency, magnitude, '', _SIZE, height=260, marks=marks, **shared),
        Chart(frequency, phase, 'frequency [Hz]', 'phase [°]', height=150, **shared),
        FactList(facts),
    ]


def steps_section(tuning: Tuning) -> Section:
    """Return the section with measured and simulated link velocities after velocity steps."""
    before, after = tuning.rms
    text = (
        'Velocities of the links after steps of the reference. The rms residual is '
        f'{digits(before, 3)} rad/s before the tuning and {digits(after, 3)} rad/s after it, '
        'noise included.'
    )
    t = np.asarray(1e3 * tuning.steps.dt * np.arange(len(tuning.measured)), dtype=np.float64)
    panels = []
    for k, pose in enumerate(np.degrees(tuning.steps.q[:, 1])):
        reference = tuning.steps.reference[-1, k]
        charts = [
            Chart(
                t,
                [
                    Series('measured', tuning.measured[:, k, 2 + link], 'measured'),
                    Series('before tuning', tuning.before[:, k, 2 + link], 'residual'),
                    Series('after tuning', tuning.after[:, k, 2 + link], 'predicted'),
                    Series('reference', tuning.steps.reference[:, k, link], 'faint'),
                ],
                'time [ms]',
                f'link {link + 1} [rad/s]',
                height=180,
                link=f'step {k}',
            )
            for link in range(2)
        ]
        name = f'joint 2 at {pose:.0f}°, {reference[0]:g} and {reference[1]:g} rad/s reference'
        panels.append((name, '', charts))
    return Section('Step responses', [Paragraph(text), Panels(panels)])


SCHEMA = 'armid/elastic/1'
#: Parameters that step responses determine well, unlike friction and spring damping.
MAIN = ('alpha', 'beta', 'gamma', 'mm', 'kg')


def elastic_document(result: TwoInertiaIdentification, robot: str) -> dict[str, Any]:
    """Return the content of elastic.json for a two-link arm."""
    parameters, rigid = result.parameters, result.rigid.estimate
    names = parameter_names(result.joints)
    std = [None] * len(names) if result.tuning is None else list(result.tuning.estimate.std)
    frequency = np.geomspace(5.0, BAND[1], 200)
    antiresonance, resonance = frequencies(parameters)
    document: dict[str, Any] = {
        'schema': SCHEMA,
        'robot': robot,
        'rigid': {
            'relative_error_percent': result.rigid.relative_error,
            'parameters': parameter_table(rigid.parameters, rigid.values, list(rigid.std)),
        },
        'joints': [
            {
                'joint': joint,
                'antiresonance_hz': float(antiresonance[k]),
                'resonance_hz': float(resonance[k]),
                'interaction_gain': float(result.interaction_gain[k]),
                'subspaces_against_physical_db': decibel_error(
                    result.systems[k].response(frequency)[:, 0, 0],
                    ideal_response(parameters, k, frequency)[:, 0, 0],
                ),
                'coulomb_torque': float(parameters.joint_coulomb[k]),
            }
            for k, joint in enumerate(result.joints)
        ],
        'untuned': parameter_table(names, unpack(result.untuned), [None] * len(names)),
        'parameters': parameter_table(names, unpack(parameters), std),
    }
    if result.tuning is not None:
        before, after = result.tuning.rms
        document['tuning'] = {'rms_before': before, 'rms_after': after, 'unit': 'rad/s'}
        document['total_damping'] = total_damping(result)
    return document


def total_damping(result: TwoInertiaIdentification) -> list[dict[str, Any]]:
    """Return one row per joint: total damping dl + dm gear^2, and standard deviation."""
    assert result.tuning is not None
    estimate, gear = result.tuning.estimate, result.parameters.gear
    rows = []
    for k, joint in enumerate(result.joints):
        weights = np.zeros(len(estimate.values))
        weights[estimate.index('dl', joint)] = 1.0
        weights[estimate.index('dm', joint)] = gear[k] ** 2
        rows.append(
            {
                'name': 'dl + dm gear^2',
                'joint': joint,
                'value': float(weights @ estimate.values),
                'std': float(np.sqrt(weights @ estimate.covariance @ weights)),
                'unit': 'N m s/rad',
            }
        )
    return rows


def tuning_story(
    tuning: Tuning, start: TwoLinkParameters, truth: TwoLinkParameters
) -> dict[str, Any]:
    """
    Return the errors of parameters and velocities of a simulated arm before and after tuning.

    Returns
    -------
    dict
        Root mean square errors of the velocities against those of the true arm, without noise,
        and largest errors of a main parameter, at the start and at the end.

    """
    clean = velocities(tuning.steps, truth)
    main = np.array([name.name in MAIN for name in parameter_names(('', ''))])
    before, after = (
        float(np.sqrt(np.mean((one - clean) ** 2))) for one in (tuning.before, tuning.after)
    )
    worst, best = (
        float(100.0 * np.abs(unpack(found) / unpack(truth) - 1.0)[main].max())
        for found in (start, tuning.parameters)
    )
    return {
        'error_before': before,
        'error_after': after,
        'unit': 'rad/s',
        'factor': before / after,
        'main_parameters_percent_before': worst,
        'main_parameters_percent_after': best,
    }
