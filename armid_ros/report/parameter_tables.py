# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Labels of parameters, and tables of parameters by link and by effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import re

from armid_ros.arm import ArmModel
from armid_ros.estimate import Estimate, measured, name_in_words, ParameterName, symbol_in_words
from armid_ros.identification import Fit, Identification, Score
from armid_ros.identification.fitting.identifiability import HALF_WIDTH, Unidentified
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import (
    Cells,
    DataTable,
    FactList,
    Fold,
    IntervalTrack,
    Legend,
    Paragraph,
    TableCell,
)
from armid_ros.report.notation import counted, digits, pretty, robot_label
from armid_ros.report.page import Section, Templated
import numpy as np

#: A parameter of a rigid body, and the number of its link.
_SYMBOL = re.compile(r'\b(m[xyz]?|I[xyz]{2})(\d+)\b')
#: Heads of the columns of friction, and the parameters in the columns.
_FRICTION = {'viscous': 'viscous_coefficient', 'Coulomb': 'coulomb_torque'}


def full_label(name: ParameterName, links: Sequence[str] = ()) -> str:
    """
    Return a parameter's name in words, with its link or joint.

    Parameters
    ----------
    name : ParameterName
        A parameter of a link or of an effect.
    links : sequence of str
        Names of the links in the order of their numbers; without them a link is that of its joint.

    Returns
    -------
    str
        'moment of inertia about z of forearm', with '+ others' for the first one of a linear
        combination; or 'Coulomb torque of elbow'.

    """
    if name.rigid:
        words, link = _words_and_link(name, links)
        label = f'{words} of {link or f"the link of {name.joint}"}'
        return f'{label} + others' if grouping(name) else label
    return f'{name.words} of {name.joint}' if name.joint else name.words


def _words_and_link(name: ParameterName, links: Sequence[str]) -> tuple[str, str]:
    """Return the first parameter of a linear combination in words, and its link."""
    symbol, number = _SYMBOL.findall(name.name)[0]
    known = 0 < int(number) <= len(links)
    return symbol_in_words(symbol), links[int(number) - 1] if known else ''


def grouping(name: ParameterName, links: Sequence[str] = ()) -> str:
    """Return a base parameter's linear combination as text; '' for a single parameter."""
    if ' ' not in name.name:
        return ''

    def named(found: re.Match[str]) -> str:
        number = int(found[2])
        return f'{found[1]} of {links[number - 1]}' if 0 < number <= len(links) else found[0]

    return _SYMBOL.sub(named, name.name)


def arm_facts(arm: ArmModel, robot: str) -> list[tuple[str, str]]:
    """Return names and values of facts on an arm: robot, joints, gravity, effects."""
    gravity = ', '.join(f'{g:.4g}' for g in arm.robot.gravity)
    return [
        ('Robot', robot_label(robot) if robot == '-' else robot),
        ('Joints', ', '.join(arm.robot.joints)),
        ('Gravity', f'({gravity}) m/s²'),
        ('Effects', ', '.join(name_in_words(effect.name) for effect in arm.effects) or 'none'),
    ]


def parameter_folds(
    names: tuple[ParameterName, ...],
    heads: Sequence[str],
    cells: Callable[[int], Cells],
    links: Sequence[str] = (),
    *,
    changed: Sequence[bool] | None = None,
    order: Callable[[int], float] = float,
) -> list[Fold]:
    """
    Return foldable tables of parameters, one per link and one per parameter of effects.

    Parameters
    ----------
    names : tuple of ParameterName
        The parameters.
    heads : sequence of str
        Heads of the columns after those that name the parameter.
    cells : callable
        Function that returns the cells of these columns for the index of a parameter.
    links : sequence of str
        Names of the links, in the order of their numbers.
    changed : sequence of bool, optional
        Whether each parameter changed; then tables without change are closed.
    order : callable
        Function that returns the sorting key of a row for the index of a parameter.

    """
    tables: dict[str, list[int]] = {}
    for k, name in enumerate(names):
        title = f'{name_in_words(name.name).capitalize()} [{pretty(name.unit)}]'
        if name.rigid:
            link = _words_and_link(name, links)[1]
            title = f'Link of {name.joint}{f" ({link})" if link else ""}'
        tables.setdefault(title, []).append(k)
    folds = []
    for title, members in tables.items():
        rigid = names[members[0]].rigid
        rows: list[Cells] = []
        for k in sorted(members, key=order):
            name = names[k]
            lead: Cells = (name.joint or name.name,)
            if rigid:
                label = _words_and_link(name, links)[0]
                lead = (
                    TableCell(label, 'words', grouping(name, links)),
                    TableCell(pretty(name.unit), 'unit'),
                )
            rows.append((*lead, *cells(k)))
        columns = ('Parameter', 'Unit', *heads) if rigid else ('Joint', *heads)
        words = (0, 1) if rigid else (0,)
        filled = [c for c in range(len(columns)) if any(row[c] != '' for row in rows)]
        kind = 'parameters' if len(heads) < 5 else 'parameters described'
        table = DataTable(
            [columns[c] for c in filled], [[row[c] for c in filled] for row in rows], words, kind
        )
        count, shown = str(len(members)), True
        if changed is not None:
            some = sum(changed[k] for k in members)
            count, shown = f'{some} of {count} changed', some > 0
        folds.append(Fold(f'{title}: {count}', [table], shown))
    return folds


def estimate_text(value: float, std: float) -> tuple[str, str]:
    """Format a value and its 95 % half-width, or 'includes 0' for insignificant values."""
    number, reach = measured(value, HALF_WIDTH * std)
    return (number if not std or abs(value) > HALF_WIDTH * std else 'includes 0'), reach


def parameter_section(
    estimate: Estimate,
    described: FloatArray,
    unidentified: Sequence[Unidentified] = (),
    links: Sequence[str] = (),
    reference: str = 'description',
) -> Section:
    """
    Return the section with all estimated parameters and their reference values.

    Parameters
    ----------
    estimate : Estimate
        P parameters.
    described : ndarray, shape (P,)
        Values of the description; zero for effects that it lacks.
    unidentified : sequence of Unidentified
        Parameters that the data do not determine.
    links : sequence of str
        Names of the links, in the order of their numbers.
    reference : str
        Name of ``described``: 'description', or 'truth' of a simulated arm.

    """
    names, values = estimate.parameters, estimate.values
    reach = HALF_WIDTH * estimate.std
    known = [name.rigid or bool(value) for name, value in zip(names, described, strict=True)]
    changed = np.array(known) & (np.abs(values - described) > reach)

    def cells(k: int) -> Cells:
        number, half = estimate_text(float(values[k]), float(estimate.std[k]))
        sure = number != 'includes 0'
        return (
            TableCell(number, '' if sure else 'unknown'),
            half,
            f'{digits(100.0 * float(reach[k]) / abs(float(values[k])))} %' if sure else '> 100 %',
            TableCell(f'{described[k]:.3g}' if known[k] else 'none', 'changed' * bool(changed[k])),
            IntervalTrack(
                float(values[k]), float(reach[k]), float(described[k]) if known[k] else None
            ),
        )

    count = int(changed.sum())
    blocks: list[Templated] = [
        Paragraph(
            f'The {reference} has values for {sum(known)} of these '
            f'{counted(len(names), "parameter")}; {count} of them {"is" if count == 1 else "are"} '
            'outside the 95 % interval of the estimate (in bold). Each row has its own scale, '
            'with zero in the middle.'
        ),
        Legend([('after', 'estimate with its 95 % interval'), ('tick', reference)]),
        *parameter_folds(names, ('Estimate', '± 95 %', 'Relative', reference, ''), cells, links),
    ]
    lost: dict[str, list[str]] = {}
    for one in unidentified:
        if one.parameter not in names:
            reason = one.reason[:1].upper() + one.reason[1:]
            lost.setdefault(reason, []).append(full_label(one.parameter, links))
    if lost:
        rows = [(reason, ', '.join(some)) for reason, some in lost.items()]
        blocks.append(Fold('Not identified', [FactList(rows)], opened=True))
    return Section('Parameters', blocks)


def joint_columns(
    result: Identification, description: ArmModel, held_out: Sequence[Fit]
) -> dict[str, list[str]]:
    """
    Return table columns by head: error, friction and deviation from the URDF of each joint.

    Parameters
    ----------
    result : Identification
        The identified model.
    description : ArmModel
        The model before.
    held_out : sequence of Fit
        Predictions of held-out recordings; without any, the errors are those of the fit.

    """
    estimate, joints = result.estimate, result.arm.robot.joints
    errors = Score.of(held_out or result.training).joint_relative_error_percent
    head = 'error' if held_out else 'error (fit)'
    columns = {'joint': list(joints), head: [f'{digits(error)} %' for error in errors]}
    for head, parameter in _FRICTION.items():
        own = [k for k, one in enumerate(estimate.parameters) if one.name == parameter]
        units = {estimate.parameters[k].unit for k in own}
        cells = dict.fromkeys(joints, '-')
        for k in own:
            number, reach = estimate_text(float(estimate.values[k]), float(estimate.std[k]))
            name = estimate.parameters[k]
            unit = '' if len(units) == 1 else f' {pretty(name.unit)}'
            cells[name.joint] = f'{number.replace("includes 0", "0")} ± {reach}{unit}'
        if own:
            unit = f' [{pretty(units.pop())}]' if len(units) == 1 else ''
            columns[f'{head}{unit}'] = [cells[joint] for joint in joints]
    unlike = not_as_described(result, description)
    columns['not as URDF'] = [f'{differ} of {count}' for differ, count in unlike.values()]
    return columns


def not_as_described(result: Identification, description: ArmModel) -> dict[str, tuple[int, int]]:
    """
    Return two numbers of inertial parameters for each joint: not as described, and all.

    Parameters
    ----------
    result : Identification
        The identified model.
    description : ArmModel
        The model before.

    Returns
    -------
    dict of str to (int, int)
        Parameters with the described value outside the 95 % interval, and all parameters.

    """
    estimate, described = result.estimate, result.base.values(description.theta)
    differs = np.abs(estimate.values - described) > HALF_WIDTH * estimate.std
    found = {}
    for joint in result.arm.robot.joints:
        own = [k for k, one in enumerate(estimate.parameters) if one.rigid and one.joint == joint]
        found[joint] = int(differs[own].sum()), len(own)
    return found
