# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two links on springs: frequency responses and step responses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.interaction import coupled_response, decibel_error
from armid_ros.papers.elastic.identification.physical import frequencies, ideal_response
from armid_ros.papers.elastic.identification.three_steps import TwoInertiaIdentification
from armid_ros.papers.elastic.identification.tuning import Tuning
from armid_ros.report.blocks import ContentSection, FactList, PageBlock, Panels, Paragraph
from armid_ros.report.charts import Chart, Mark, Role, Series
from armid_ros.report.notation import digits
import numpy as np
import numpy.typing as npt

#: Frequency ranges of the plots and of the comparison of responses [Hz].
_SHOWN, _COMPARED = (2.0, 100.0), (5.0, 60.0)
_ROLES: tuple[Role, Role] = ('residual', 'predicted')
_SIZE = 'magnitude [dB re rad/(N m s)]'


def responses_section(result: TwoInertiaIdentification) -> ContentSection:
    """Return a section with responses from motor torque to motor velocity of both joints."""
    text = (
        'From motor torque to motor velocity. The torque between the links is a second input. '
        'Each joint then responds like one motor and one link on a spring. Drag across a plot, or '
        'pinch it, to zoom; double-click or double-tap to see it all.'
    )
    hint = (
        'The response of the whole arm is the mean over the poses of joint 2 in the recording, '
        'with the other motor free. Dashed lines are the frequencies of the joint alone. Errors '
        'are those from 5 to 60 Hz.'
    )
    panels = [panel for k in range(2) for panel in _joint(result, k)]
    return ContentSection(
        'Frequency responses', [Paragraph(text), Panels(panels), Paragraph(hint, 'hint')]
    )


def decibels_apart(result: TwoInertiaIdentification, joint: int) -> float:
    """Return the difference of measured and model responses of a joint, 5 to 60 Hz [dB]."""
    measured = result.measured[joint]
    seen = (measured.frequency >= _COMPARED[0]) & (measured.frequency <= _COMPARED[1])
    ideal = ideal_response(result.parameters, joint, measured.frequency[seen])[:, 0, 0]
    return decibel_error(measured.decoupled[seen, 0], ideal)


def _joint(
    result: TwoInertiaIdentification, k: int
) -> Iterator[tuple[str, str, Sequence[PageBlock]]]:
    """Yield panels of one joint: decoupled, and from motor torque alone."""
    measured, joint, parameters = result.measured[k], result.joints[k], result.parameters
    seen = (measured.frequency >= _SHOWN[0]) & (measured.frequency <= _SHOWN[1])
    own = measured.frequency[seen]
    frequency = np.unique(np.concatenate([np.geomspace(*_SHOWN, 300), own]))
    decoupled = ideal_response(parameters, k, frequency)[:, 0, 0]
    subspaces = result.systems[k].response(frequency)[:, 0, 0]
    coupled = coupled_response(parameters, result.angles, frequency)[:, k]
    at = np.searchsorted(frequency, own)
    points, alone = np.full((2, len(frequency)), np.nan, complex)
    points[at], alone[at] = measured.decoupled[seen, 0], measured.coupled[seen, 0]
    low, high = (float(both[k]) for both in frequencies(parameters))
    marks = [
        Mark(low, f'antiresonance {low:.1f} Hz', before=True),
        Mark(high, f'resonance {high:.1f} Hz'),
    ]
    modelled = [('subspace model', subspaces), ('physical model', decoupled)]
    within = (own >= _COMPARED[0]) & (own <= _COMPARED[1])
    rows = at[within]
    errors = (
        decibels_apart(result, k),
        decibel_error(alone[rows], decoupled[rows]),
        decibel_error(alone[rows], coupled[rows]),
    )
    size, compared = np.abs(alone[rows]), own[within]
    lowest = int(np.argmin(size))
    dip, peak = compared[lowest], compared[lowest + int(np.argmax(size[lowest:]))]
    decoupled_charts = (
        _chart(frequency, points, modelled, _decibel, _SIZE, 260, marks),
        _chart(frequency, points, modelled, _degrees, 'phase [°]', 150, marks, last=True),
    )
    yield joint, 'decoupled', decoupled_charts
    whole = [('whole arm, modelled', coupled), ('this joint', decoupled)]
    alone_chart = _chart(frequency, alone, whole, _decibel, _SIZE, 220, marks, last=True)
    facts = [
        ('Antiresonance, resonance of the joint', f'{low:.2f} Hz, {high:.2f} Hz'),
        ('Measured minimum and maximum, coupled', f'{dip:.1f} Hz, {peak:.1f} Hz'),
        ('Joint model, decoupled: error', f'{errors[0]:.2f} dB rms'),
        ('Joint model, coupled: error', f'{errors[1]:.1f} dB rms'),
        ('Whole-arm model, coupled: error', f'{errors[2]:.1f} dB rms'),
    ]
    yield joint, 'coupled: from motor torque alone', (alone_chart, FactList(facts))


def _chart(
    frequency: FloatArray,
    points: npt.NDArray[np.complex128],
    curves: Sequence[tuple[str, npt.NDArray[np.complex128]]],
    part: Callable[[npt.NDArray[np.complex128]], FloatArray],
    ylabel: str,
    height: int,
    marks: Sequence[Mark],
    *,
    last: bool = False,
) -> Chart:
    series = [
        Series(label, part(values), role)
        for (label, values), role in zip(curves, _ROLES, strict=True)
    ]
    return Chart(
        frequency,
        [*series, Series('measured', part(points), 'measured', 'points')],
        'frequency [Hz]' if last else '',
        ylabel,
        height=height,
        link='frequency',
        marks=marks if ylabel == _SIZE else [Mark(mark.x) for mark in marks],
        logarithmic=True,
        legend=ylabel == _SIZE,
    )


def _decibel(values: npt.NDArray[np.complex128]) -> FloatArray:
    return np.asarray(20.0 * np.log10(np.abs(values)))


def _degrees(values: npt.NDArray[np.complex128]) -> FloatArray:
    return np.asarray(np.degrees(np.angle(values)))


def steps_section(tuning: Tuning) -> ContentSection:
    """Return a section with link velocities after reference steps, before and after tuning."""
    before, after = tuning.rms
    text = (
        'Velocities of the links after steps of the reference. Before tuning '
        f'{digits(before, 3)} rad/s rms is left unexplained, after it {digits(after, 3)} rad/s, '
        'noise included.'
    )
    t = np.asarray(1e3 * tuning.steps.dt * np.arange(len(tuning.measured)), dtype=np.float64)
    panels = []
    for k, pose in enumerate(np.degrees(tuning.steps.q[:, 1])):
        asked = tuning.steps.reference[-1, k]
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
        name = f'joint 2 at {pose:.0f}°, {asked[0]:g} and {asked[1]:g} rad/s reference'
        panels.append((name, '', charts))
    return ContentSection('Step responses', [Paragraph(text), Panels(panels)])
