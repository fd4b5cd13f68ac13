# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The pages of a fleet: index.html with all arms by their health, and one page an arm.

Pages load nothing and are linked by relative addresses, so a folder of them can be put anywhere.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import quote

from armid_ros.estimate import ParameterName
from armid_ros.fleet.bags import BagFile, file_name, folder_of
from armid_ros.fleet.changes import HistoryChange
from armid_ros.fleet.scatter import ParameterHistory
from armid_ros.fleet.sections import (
    ArmRow,
    Arms,
    Bags,
    Cell,
    Curve,
    curve,
    Headline,
    ParameterCurves,
    RefusedBags,
    spark,
    TableRow,
    Wear,
)
from armid_ros.fleet.store import Store
from armid_ros.fleet.watch import change_rows, day_text, RESIDUAL, Watch, WatchedArm, wear_rows
from armid_ros.report.families import full_label
from armid_ros.report.notation import counted, digits, with_interval
from armid_ros.report.page import Page, Section
from armid_ros.report.sections.frame import VerdictSection
from markupsafe import Markup

#: Parameters that have a column of curves in the overview.
_COLUMNS = 9
#: Refused bags that the overview lists.
_SHOWN = 50


def write_pages(store: Store, found: Watch) -> None:
    """Write index.html and the pages of all arms."""
    reports = set(store.names('reports/arm=*/*/report.html'))
    table = store.read_table('watch/diagnoses.parquet')
    diagnoses = {} if table is None else {row['arm']: row for row in table.to_pylist()}
    for arm in found.arms:
        page = arm_page(found, arm, reports, diagnoses.get(arm.arm))
        store.write(f'pages/{_file(arm.arm)}', page)
    store.write('index.html', overview(found, diagnoses))


def write_arm_page(store: Store, found: Watch, arm: WatchedArm) -> None:
    """Write the page of one arm anew, as when a bag of it has got a report."""
    reports = set(store.names(f'reports/{folder_of(arm.arm)}/*/report.html'))
    table = store.read_table('watch/diagnoses.parquet')
    rows = [] if table is None else table.to_pylist()
    diagnosis = next((row for row in rows if row['arm'] == arm.arm), None)
    store.write(f'pages/{_file(arm.arm)}', arm_page(found, arm, reports, diagnosis))


def overview(found: Watch, diagnoses: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the page with all arms, and what the diagnosis says of some."""
    columns = _columns(found)
    sections: list[Section] = [
        _verdict(found),
        Arms([_title(*one) for one in columns], _rows(found, columns, diagnoses)),
    ]
    refused = [row for arm in found.arms for row in arm.refused]
    if refused:
        rows = [_refused_row(row) for row in refused[:_SHOWN]]
        hint = f'{_SHOWN} of {len(refused)}; all are in refused/.' if len(refused) > _SHOWN else ''
        sections.append(RefusedBags(('Arm', 'Bag', 'Why'), rows, hint=hint))
    days = [day for arm in found.arms for one in arm.series[:1] for day in one.days[[0, -1]]]
    span = f'{day_text(min(days))} to {day_text(max(days))}' if days else ''
    bags = sum(len(arm.bags) for arm in found.arms)
    subtitle = ' · '.join(
        filter(None, (counted(len(found.arms), 'arm'), counted(bags, 'bag'), span))
    )
    return Page('A fleet over time', subtitle, sections, charts=False).html()


def arm_page(
    found: Watch,
    arm: WatchedArm,
    reports: set[str],
    diagnosis: Mapping[str, Any] | None = None,
) -> str:
    """Return the page of an arm; reports are the files that bags and diagnosis have."""
    texts = [row['text'] for row in change_rows(arm)]
    tone = {'changed': 'bad', 'wearing': 'fair', 'healthy': 'good'}.get(arm.health, 'fair')
    said = texts[:1] or ['No parameter has changed more than noise and other bags explain.']
    beware = [*texts[1:6]]
    if len(texts) > 6:
        beware.append(f'... and {len(texts) - 6} more')
    if abs(arm.unlike[1]) > 3.5:
        beware.append(
            f'{arm.unlike[0]} is {abs(arm.unlike[1]):.1f} deviations of the fleet '
            f'{"above" if arm.unlike[1] > 0 else "below"} that of its siblings'
        )
    sections: list[Section] = [
        VerdictSection(arm.health, tone, [f'{said[0][0].upper()}{said[0][1:]}'], beware),
        ParameterCurves([_curve(arm, one) for one in _ordered(arm)]),
        _wear(found, arm),
        _bags(arm, reports),
    ]
    if diagnosis is not None:
        link = f'../{quote(diagnosis["report"])}' if diagnosis['report'] else ''
        verdict = diagnosis['verdict'].replace('_', ' ')
        cells = [Cell(verdict, link), Cell(diagnosis['summary'])]
        sections.insert(1, Headline(('Verdict', 'Summary'), [TableRow(cells)]))
    if arm.refused:
        rows = [_refused_row(row) for row in arm.refused]
        sections.append(RefusedBags(('Arm', 'Bag', 'Why'), rows))
    subtitle = f'{counted(len(arm.bags), "bag")} · false discovery rate {found.alpha:g}'
    return Page(arm.arm, subtitle, sections, charts=False).html()


def _verdict(found: Watch) -> VerdictSection:
    counts = Counter(arm.health for arm in found.arms)
    ill = counts['changed'] + counts['wearing']
    first = (
        f'{counted(ill, "arm")} of {len(found.arms)} changed: '
        f'{counts["changed"]} from one bag to the next, {counts["wearing"]} little by little.'
        if ill
        else f'None of {counted(len(found.arms), "arm")} changed.'
    )
    rate = f'{100.0 * found.alpha:g} %'
    sentences = [first, *([f'False discovery rate: {rate} of the named arms.'] if ill else [])]
    beware = []
    if counts['too few bags']:
        beware.append(f'{counted(counts["too few bags"], "arm")} with too few bags to be tested')
    refused = sum(len(arm.refused) for arm in found.arms)
    if refused:
        beware.append(f'{counted(refused, "bag")} refused')
    return VerdictSection(
        'changes' if ill else 'quiet', 'fair' if ill else 'good', sentences, beware
    )


def _columns(found: Watch) -> list[tuple[str, str]]:
    """Return the parameters that have a column: those named most often, then of the effects."""
    named = Counter(one.series.parameter for arm in found.arms for one in arm.named[:1])
    order = [parameter for parameter, _ in named.most_common()]
    for arm in found.arms[:1]:
        order += [one.parameter for one in arm.series if one.name in found.wearing]
    return list(dict.fromkeys(order))[:_COLUMNS]


def _rows(
    found: Watch,
    columns: Sequence[tuple[str, str]],
    diagnoses: Mapping[str, Mapping[str, Any]],
) -> list[ArmRow]:
    rows = []
    for arm in found.arms:
        row, diagnosis = _row(arm, columns), diagnoses.get(arm.arm)
        if diagnosis is not None and diagnosis['verdict'] != 'failed':
            row = replace(row, diagnosis=diagnosis['summary'], diagnosis_link=diagnosis['report'])
        rows.append(row)
    return rows


def _row(arm: WatchedArm, columns: Sequence[tuple[str, str]]) -> ArmRow:
    by_parameter = {one.parameter: one for one in arm.series}
    rows = change_rows(arm)
    link = f'pages/{quote(_file(arm.arm))}'
    errors = sorted(e for row in arm.bags if (e := row['relative_error_percent']) is not None)
    first = arm.named[0] if arm.named else None
    return ArmRow(
        arm.arm,
        arm.health,
        rows[0]['text'] if rows else '',
        link,
        f'{link}#{_anchor(arm.arm, rows[0]["bag"])}' if rows else '',
        len(arm.bags),
        len(arm.refused),
        f'{digits(errors[len(errors) // 2])} %' if errors else '',
        Markup('') if first is None else _spark(first.series, arm.named),
        [_spark(by_parameter.get(parameter), arm.named) for parameter in columns],
    )


def _spark(series: ParameterHistory | None, named: Sequence[HistoryChange]) -> Markup:
    if series is None or len(series.values) < 2:
        return Markup('')
    title = f'{_title(*series.parameter)}: {digits(series.values[-1], 3)} {series.unit}'
    return spark(series.values, series.std, _cut(series, named), title)


def _cut(series: ParameterHistory, named: Sequence[HistoryChange]) -> int:
    return next((one.index for one in named if one.series.parameter == series.parameter), 0)


def _ordered(arm: WatchedArm) -> list[ParameterHistory]:
    """Return the series of an arm, those that have changed first."""
    first = {change.series.parameter: k for k, change in enumerate(arm.named)}
    return sorted(
        (one for one in arm.series if len(one.values)),
        key=lambda one: first.get(one.parameter, len(first)),
    )


def _curve(arm: WatchedArm, series: ParameterHistory) -> Curve:
    places = {row['start_ns']: row['bag'] for row in arm.bags}
    starts = sorted(places)
    links = []
    for day in series.days:
        nearest = min(starts, key=lambda ns: abs(ns / 86_400e9 - day))
        links.append(f'#{_anchor(arm.arm, places[nearest])}')
    svg, ends = curve(series.days, series.values, series.std, links, _cut(series, arm.named))
    shown = f'{digits(ends[0], 3)} to {digits(ends[1], 3)} {series.unit}'.rstrip()
    changed = any(one.series.parameter == series.parameter for one in arm.named)
    return Curve(_title(*series.parameter), shown, svg, changed)


def _wear(found: Watch, arm: WatchedArm) -> Wear:
    rows = [
        TableRow(
            [
                Cell(_title(row['name'], row['joint'])),
                Cell(
                    with_interval(
                        row['per_month'],
                        (row['upper'] - row['lower']) / 3.92,
                        f'{row["unit"]} a month',
                    )
                ),
            ]
        )
        for row in wear_rows(Watch((arm,), found.spread, found.wearing, found.alpha))
    ]
    hint = 'Slope of a straight line through all bags with its 95 % interval, each by itself.'
    return Wear(('Parameter', 'Trend'), rows, (1,), hint)


def _bags(arm: WatchedArm, reports: set[str]) -> Bags:
    rows = []
    for row in arm.bags:
        name = _anchor(arm.arm, row['bag'])
        report = f'reports/{folder_of(arm.arm)}/{name}/report.html'
        link = f'../{quote(report)}' if report in reports else ''
        worst = ''
        if row['residual_std']:
            joint, size = max(
                zip(row['joints'], row['residual_std'], strict=True), key=lambda one: one[1]
            )
            worst = f'{digits(size)} ({joint})'
        error = row['relative_error_percent']
        cells = [
            Cell(row['start'].strftime('%Y-%m-%d %H:%M')),
            Cell(row['bag'].rstrip('/').rsplit('/', 1)[-1], link),
            Cell(f'{row["seconds"]:.0f} s'),
            Cell('' if error is None else f'{digits(error)} %'),
            Cell(worst),
            Cell('; '.join(row['notes'])),
        ]
        rows.append(TableRow(cells, name))
    heads = ('Start (UTC)', 'Bag', 'Length', 'Error', 'Largest residual [N m]', 'Notes')
    hint = (
        'A bag with a link has a report of its own. That of any other is made by '
        f'`armid fleet report --out RESULTS --arm {arm.arm} --bag NAME`; without --bag, those '
        'beside its change and the latest.'
    )
    return Bags(heads, rows, (2, 3, 4), hint)


def _refused_row(row: dict[str, str]) -> TableRow:
    return TableRow([Cell(str(row['arm'])), Cell(row['bag']), Cell(row['reason'])])


def _title(name: str, joint: str) -> str:
    if name == RESIDUAL:
        return f'log residual, {joint}'
    if name.isidentifier() and '_' in name:
        return f'{name.replace("_", " ")}, {joint}'
    return full_label(ParameterName(name, joint, ''))


def _anchor(arm: str, url: str) -> str:
    return BagFile(arm, url).name


def _file(arm: str) -> str:
    return f'{file_name(arm)}.html'
