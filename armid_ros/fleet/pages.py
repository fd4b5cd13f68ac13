# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
HTML pages of a fleet: index.html with the health of all arms, and one page per arm.

Pages load no other files and use relative links, so the folder can be moved.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
import math
from typing import Any
from urllib.parse import quote

from armid_ros.changes.histories import ParameterHistory
from armid_ros.fleet.bags import BagFile, DAY_NS, file_name
from armid_ros.fleet.store import Store
from armid_ros.fleet.watch import (
    change_rows,
    day_text,
    parameter_label,
    RESIDUAL,
    Watch,
    WatchedArm,
)
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import DataTable, Fold, Paragraph, SmallMultiples, VerdictSection
from armid_ros.report.notation import counted, digits, pretty, with_interval
from armid_ros.report.page import Page, Section, Templated
from markupsafe import escape, Markup
import numpy as np

#: Verdicts of a diagnosis that name an effect.
_EXPLAINED = ('named', 'ambiguous', 'partial')

Diagnoses = Mapping[str, Mapping[str, Any]]


def write_pages(store: Store, found: Watch) -> None:
    """Write the pages of all arms, and index.html."""
    table = store.read_table('watch/diagnoses.parquet')
    diagnoses = {} if table is None else {row['arm']: row for row in table.to_pylist()}
    for arm in found.arms:
        store.write(f'pages/{file_name(arm.arm)}.html', _arm_page(found, arm, diagnoses))
    store.write('index.html', _overview(found, diagnoses))


def _overview(found: Watch, diagnoses: Diagnoses) -> str:
    """Return index.html with the health and the diagnosis of every arm."""
    heads = ('Arm', 'Health', 'Change', 'Bags', 'Refused', 'Error')
    rows = [_arm_row(arm, diagnoses.get(arm.arm)) for arm in found.arms]
    hint = (
        'Small curves: the changed parameter over time, on six standard deviations or more; a '
        'dashed line marks the change. Error: median of 100 |residual torque| / |torque| '
        'over the bags of an arm, each fitted by itself.'
    )
    sections = [_table('Arms', heads, rows, (3, 4, 5), hint)]
    refused = [row for arm in found.arms for row in arm.refused]
    most = 50
    if refused:
        more = len(refused) > most
        hint = f'{most} of {len(refused)}; all are in refused/.' if more else ''
        sections.append(_refused(refused[:most], hint))
    days = [day for arm in found.arms for one in arm.series[:1] for day in one.days[[0, -1]]]
    span = f'{day_text(min(days))} to {day_text(max(days))}' if days else ''
    bags = sum(len(arm.bags) for arm in found.arms)
    subtitle = ' · '.join(
        filter(None, (counted(len(found.arms), 'arm'), counted(bags, 'bag'), span))
    )
    return Page('A fleet over time', subtitle, _verdict(found, diagnoses), sections).html()


def _arm_page(found: Watch, arm: WatchedArm, diagnoses: Diagnoses) -> str:
    """Return the page of an arm: its changes, diagnosis, parameters over time, wear and bags."""
    texts = [pretty(row['text']) for row in change_rows(arm)]
    diagnosis = diagnoses.get(arm.arm)
    diagnosed = _diagnosed(arm, diagnosis)
    tone = 'good' if arm.health == 'healthy' and not diagnosed else 'fair'
    quiet = 'No parameter has changed by more than noise and the scatter between bags.'
    if arm.health == 'too few bags':
        quiet = f'Changes were not tested: {counted(len(arm.bags), "bag")} are too few.'
    if diagnosis is not None and diagnosed:
        quiet = pretty(diagnosis['summary'])
    sentences = [f'{text[0].upper()}{text[1:]}.' for text in texts[:1]] or [quiet]
    if diagnosis is not None and texts and diagnosis['verdict'] in _EXPLAINED:
        lead, stop, more = pretty(diagnosis['summary']).partition('. ')
        sentences = [lead + stop.rstrip(), *filter(None, [more]), *sentences]
    if len(texts) > 1:
        sentences.append(f'{counted(len(texts) - 1, "more parameter")} changed; see below.')
    word, step = diagnosed or arm.health, _step(arm, bool(diagnosis), diagnosed)
    sections = []
    if diagnosis is not None:
        report = f'../{quote(diagnosis["report"])}' if diagnosis['report'] else ''
        cells = (
            _link(report, diagnosis['verdict'].replace('_', ' ')),
            pretty(diagnosis['summary']),
        )
        sections.append(_table('Diagnosis', ('Verdict', 'Summary'), [cells]))
    order = {change.series.parameter: k for k, change in enumerate(arm.named)}
    shown = [one for one in arm.series if len(one.values)]
    shown.sort(key=lambda one: order.get(one.parameter, len(order)))
    cut = sum(one.parameter in order for one in shown)
    hint = (
        'Every point is a bag with its 95 % interval, in order of time, with a link to the bag '
        'below. A dashed line marks the change. Numbers after a name are the range of the '
        'vertical axis.'
    )
    first, rest = ([_curve(arm, one) for one in part] for part in (shown[:cut], shown[cut:]))
    curves: list[Templated] = [SmallMultiples(first)] if first else []
    if rest:
        line = f'{counted(len(rest), "parameter")} without a change'
        curves.append(Fold(line, [SmallMultiples(rest)]))
    sections.append(Section('Parameters over time', [Paragraph(hint, 'hint'), *curves]))
    rows, steps = [], {one.series.parameter for one in arm.named if one.kind == 'step'}
    for row in (one for one in arm.wear if (one['name'], one['joint']) not in steps):
        std = (row['upper'] - row['lower']) / (2.0 * HALF_WIDTH)
        unit = f'{row["unit"]} a month'
        trend = with_interval(row['per_month'], std, unit)
        rows.append((parameter_label(row['name'], row['joint']), trend))
    hint = (
        'Slope of a straight line through all bags with its 95 % interval, fitted separately. '
        'An interval that includes 0 shows no wear. Parameters with a sudden change have no trend.'
    )
    sections += [_table('Wear', ('Parameter', 'Trend'), rows, (1,), hint), _bags(arm)]
    if arm.refused:
        sections.append(_refused(arm.refused))
    subtitle = f'{counted(len(arm.bags), "bag")} · false discovery rate {found.alpha:g}'
    verdict = VerdictSection(word, tone, sentences, step=step)
    return Page(arm.arm, subtitle, verdict, sections).html()


def _step(arm: WatchedArm, is_diagnosed: bool, fault: str) -> str:
    """Return the advice on the page of an arm: what the user should do next."""
    if not (arm.named or fault):
        return 'After the next recordings, run armid fleet identify and armid fleet watch again.'
    if is_diagnosed:
        return 'Read the report of the diagnosis: it states what to inspect.'
    return f'armid fleet diagnose --arm {arm.arm} --out RESULTS'


def _verdict(found: Watch, diagnoses: Diagnoses) -> VerdictSection:
    """Return the first section of index.html: number of changed arms, and named effects."""
    counts = Counter(arm.health for arm in found.arms)
    blamed = [arm.arm for arm in found.arms if _diagnosed(arm, diagnoses.get(arm.arm))]
    ill = counts['changed'] + counts['wearing']
    tested = len(found.arms) - counts['too few bags']
    sentences = [f'No parameter changed in {tested} of {counted(len(found.arms), "arm")}.']
    longest = 60  # characters
    named = ', '.join(arm.arm for arm in found.arms if arm.health in ('changed', 'wearing'))
    if ill:
        which = f': {named}' if len(named) < longest else ''
        sentences = [
            f'{counted(ill, "arm")} of {len(found.arms)} changed{which}.',
            f'{counts["changed"]} changed suddenly, {counts["wearing"]} gradually. At most '
            f'{100.0 * found.alpha:g} % of the named arms are false alarms, on average.',
        ]
        explained = []  # effects that diagnoses name for changed arms
        for arm in found.arms:
            diagnosis = diagnoses.get(arm.arm)
            if arm.named and diagnosis is not None and diagnosis['verdict'] in _EXPLAINED:
                lead = pretty(diagnosis['summary']).partition('. ')[0].rstrip('.')
                day = change_rows(arm)[0]['first_day']
                since = f', since {day}' if arm.named[0].kind == 'step' else ''
                explained.append(f'{arm.arm}{since}: {lead}.')
        sentences[1:1] = explained[:3]
    if blamed:
        names = ', '.join(blamed)
        some = names if len(names) < longest else counted(len(blamed), 'arm')
        sentences.insert(0, f'The diagnosis found a fault in {some}.')
    beware = []
    if counts['too few bags']:
        beware.append(f'{counted(counts["too few bags"], "arm")} with too few bags to be tested')
    refused = sum(len(arm.refused) for arm in found.arms)
    if refused:
        beware.append(f'{counted(refused, "bag")} refused')
    grade = 'changes' if ill else 'diagnosed' if blamed else 'quiet'
    tone = 'fair' if ill or blamed else 'good'
    step = f'Open the page of {named}.' if ill and len(named) < longest else ''
    return VerdictSection(grade, tone, sentences, beware, step=step)


def _diagnosed(arm: WatchedArm, diagnosis: Mapping[str, Any] | None) -> str:
    """Return the verdict of a diagnosis that found a fault in an unchanged arm; otherwise ''."""
    if arm.named or diagnosis is None or diagnosis['verdict'] in ('consistent', 'failed'):
        return ''
    return str(diagnosis['verdict']).replace('_', ' ')


def _arm_row(arm: WatchedArm, diagnosis: Mapping[str, Any] | None) -> list[str]:
    """Return the cells of an arm's row in the table of the overview page."""
    page = f'pages/{quote(file_name(arm.arm))}.html'
    what = Markup('')
    if diagnosis is not None and diagnosis['verdict'] != 'failed':
        report = _link(diagnosis['report'], 'Diagnosis')
        lead, stop, _ = pretty(diagnosis['summary']).partition('. ')
        what = Markup('{}: {}').format(report, lead + stop.rstrip())
    for row in change_rows(arm)[:1]:
        bag = _link(f'{page}#{BagFile(arm.arm, row["bag"]).name}', 'bag')
        what += Markup('<br>' * bool(what) + '{} {}').format(pretty(row['text']), bag)
    for first in arm.named[:1]:
        series = first.series
        label, last = parameter_label(*series.parameter), digits(series.values[-1], 3)
        order = np.arange(len(series.values), dtype=float)
        title = f'{label}: {last} {pretty(series.unit)}'
        what += _drawing(order, series.values, series.std, first.index, title=title)[0]
    found = _diagnosed(arm, diagnosis)
    tone = 'wearing' if found else arm.health.split(' ')[0]
    mark = Markup('<span class="mark {}">{}</span>').format(tone, found or arm.health)
    return [
        _link(page, arm.arm),
        mark,
        what,
        str(len(arm.bags)),
        str(len(arm.refused) or ''),
        '' if arm.error is None else f'{digits(arm.error)} %',
    ]


def _curve(arm: WatchedArm, series: ParameterHistory) -> tuple[str, str, Markup, str]:
    links = []
    for day in series.days:
        nearest = min(arm.bags, key=lambda row: abs(row['start_ns'] / DAY_NS - day))
        links.append(f'#{BagFile(arm.arm, nearest["bag"]).name}')
    cuts = [one.index for one in arm.named if one.series.parameter == series.parameter]
    svg, ends = _drawing(series.days, series.values, series.std, sum(cuts), links)
    unit = pretty(series.unit)
    if series.name == RESIDUAL:  # the series contains logarithms
        ends, unit = (math.exp(ends[0]), math.exp(ends[1])), 'N m'
    shown = f'{digits(ends[0], 3)} to {digits(ends[1], 3)} {unit}'.rstrip()
    return parameter_label(*series.parameter), shown, svg, 'changed' if cuts else ''


def _bags(arm: WatchedArm) -> Section:
    rows = []
    for row in arm.bags:
        name = BagFile(arm.arm, row['bag']).name
        worst = ''
        if row['residual_std']:
            size, joint = max(zip(row['residual_std'], row['joints'], strict=True))
            worst = f'{digits(size)} ({joint})'
        error = row['relative_error_percent']
        start = row['start'].strftime('%Y-%m-%d %H:%M')
        rows.append(
            (
                Markup('<span id="{}">{}</span>').format(name, start),
                row['bag'].rstrip('/').rsplit('/', 1)[-1],
                f'{row["seconds"]:.0f} s',
                '' if error is None else f'{digits(error)} %',
                worst,
                '; '.join(row['notes']),
            )
        )
    heads = ('Start (UTC)', 'Bag', 'Length', 'Error', 'Largest residual [N m]', 'Notes')
    return _table('Bags', heads, rows, (2, 3, 4))


def _refused(rows: Sequence[Mapping[str, Any]], hint: str = '') -> Section:
    cells = [(str(row['arm']), row['bag'], row['reason']) for row in rows]
    return _table('Refused bags', ('Arm', 'Bag', 'Why'), cells, hint=hint)


def _table(
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[int] = (),
    hint: str = '',
) -> Section:
    """Return a section with a table, whose cells may contain links and curves."""
    words = [k for k in range(len(heads)) if k not in numbers]
    table = DataTable(heads, rows, words, 'fleet')
    return Section(title, [table, *([Paragraph(hint, 'hint')] if hint else [])])


def _link(target: str, text: str) -> Markup:
    """Return a text with a link to a page, or the text alone without a page (target '')."""
    return Markup('<a href="{}">{}</a>').format(target, text) if target else escape(text)


def _drawing(
    x: FloatArray,
    values: FloatArray,
    std: FloatArray,
    cut: int = 0,
    links: Sequence[str] = (),
    title: str = '',
) -> tuple[Markup, tuple[float, float]]:
    """Draw values over time as a line, or as points with links; return SVG and range of values."""
    # [px]; a large curve has intervals
    (width, height), wide = ((250, 74), HALF_WIDTH) if links else ((84, 20), 0.0)
    low, high = float(np.min(values - wide * std)), float(np.max(values + wide * std))
    least = max(6.0 * float(np.median(std)), 1e-3 * float(np.max(np.abs(values))), 1e-12)
    spare = max(0.0, 0.5 * (least - (high - low)))
    low, high = low - spare, high + spare
    across = 4.0 + (width - 8.0) * (x - x[0]) / (float(np.ptp(x)) or 1.0)
    scale = (height - 8.0) / (high - low)
    up = height - 4.0 - scale * (values - low)
    parts = [f'<title>{escape(title)}</title>'] if title else []
    if 0 < cut < len(x):
        at = 0.5 * (across[cut - 1] + across[cut])
        parts.append(f'<line class="cut" x1="{at:.1f}" x2="{at:.1f}" y1="0" y2="{height}"/>')
    for a, b, half, target in zip(across, up, wide * std * scale, links, strict=bool(links)):
        parts.append(
            f'<line class="interval" x1="{a:.1f}" x2="{a:.1f}" '
            f'y1="{b - half:.1f}" y2="{b + half:.1f}"/>'
        )
        parts.append(
            _link(target, Markup(f'<circle class="dot" cx="{a:.1f}" cy="{b:.1f}" r="2.6"/>'))
        )
    if not links:
        line = ' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(across, up, strict=True))
        parts.append(f'<polyline class="line" points="{line}"/>')
        parts.append(f'<circle class="dot" cx="{across[-1]:.1f}" cy="{up[-1]:.1f}" r="1.8"/>')
    svg = Markup(
        f'<svg class="spark" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img">{"".join(parts)}</svg>'
    )
    return svg, (low, high)
