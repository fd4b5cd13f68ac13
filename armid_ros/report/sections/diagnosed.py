# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The short sections of the page of a diagnosis: what was named, and where it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis, Finding
from armid_ros.diagnosis.verdict.document import Detectable
from armid_ros.diagnosis.verdict.where import Where
from armid_ros.diagnosis.verdict.words import by_cause, share_interval_in_words
from armid_ros.effects import CATALOGUE
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.charts import Chart, Series
from armid_ros.report.notation import digits, percent, pretty, probability, value_of
from armid_ros.report.page import Section

#: Joints that are shown.
_MOST = 3
#: Share of the power of a residual from which on its mean is said to be taken off.
_MEAN_SAID = 0.005


@dataclass(frozen=True)
class Shares(Section):
    """
    Shares of the held-out gap.

    Attributes
    ----------
    diagnosis : Diagnosis
        What was found; something was.

    """

    title: ClassVar[str] = 'What explains the gap'
    template: ClassVar[str] = 'shares.html'

    diagnosis: Diagnosis

    @property
    def bars(self) -> BarChart:
        """One bar a cause, and one for the rest, in per cent of the gap."""
        rows, taken = [], 0.0
        for group in by_cause(self.diagnosis.findings):
            one = group[0]
            where = ', '.join(one.place_of(joint) for joint in one.joints) or 'whole arm'
            names = ' and '.join(other.name.replace('_', ' ') for other in group)
            text = percent(one.share) + share_interval_in_words(one)
            share = max(one.share, 0.0)
            taken += share
            rows.append((f'{names}, {where}', [Bar(share, 'after', text)]))
        rest = max(1.0 - taken, 0.0)
        rows.append(('unexplained (noise included)', [Bar(rest, 'floor', percent(rest))]))
        return BarChart(rows, '', full=1.0)

    @property
    def data(self) -> str:
        """Return what the shares were measured on."""
        gap = self.diagnosis.gap
        if gap is not None and gap.predicted:
            return 'on recordings that were not used'
        return 'on parts of the recordings, each predicted from the others'


@dataclass(frozen=True)
class NamedParameters(Section):
    """
    Values with 95 % intervals.

    Attributes
    ----------
    findings : sequence of Finding
        What was named.

    """

    title: ClassVar[str] = 'Parameters'
    template: ClassVar[str] = 'named.html'

    findings: Sequence[Finding]

    @property
    def rows(self) -> list[tuple[str, str, str, str]]:
        """Effect, parameter, joint or segment, and value with its interval, as text."""
        return [
            (
                finding.name.replace('_', ' '),
                name.words,
                finding.place_of(name.joint) or 'whole arm',
                value_of(finding, name, value, std),
            )
            for finding in self.findings
            for name, value, std in zip(
                finding.parameters, finding.values, finding.std, strict=True
            )
        ]


@dataclass(frozen=True)
class EvidenceSection(Section):
    """
    Residuals without what was named.

    Attributes
    ----------
    places : sequence of Where
        Joints, the worst first.
    share_of : str
        What their shares are of.

    """

    title: ClassVar[str] = 'Where it shows'
    template: ClassVar[str] = 'evidence.html'

    places: Sequence[Where]
    share_of: str = 'the gap'

    @property
    def shown(self) -> Sequence[Where]:
        """Return the worst joints."""
        return self.places[:_MOST]

    def taken_off(self, place: Where) -> str:
        """Say which mean the curves are without; empty where it is next to nothing."""
        if not place.axes or place.mean_share < _MEAN_SAID:
            return ''
        return (
            f'The mean of the residual, {digits(place.mean)} {place.unit} or '
            f'{percent(place.mean_share)} of its power, is subtracted; shares are of the rest.'
        )

    def charts(self, place: Where) -> list[tuple[str, Chart]]:
        """Return a caption and a chart per quantity; the mean, common to all, is taken off."""
        varies = max(1.0 - place.mean_share, 1e-9)
        return [
            (
                f'{axis.name}: {percent(max(axis.share - place.mean_share, 0.0) / varies)} of the '
                'power',
                Chart(
                    axis.centres,
                    [Series('mean residual', axis.means - place.mean, 'before', 'trend')],
                    f'{axis.name} [{pretty(axis.unit)}]',
                    f'residual [{place.unit}]',
                    height=170,
                    symmetric=True,
                    legend=False,
                ),
            )
            for axis in place.axes
        ]


@dataclass(frozen=True)
class SmallPrint(Section):
    """
    Minor effects.

    Attributes
    ----------
    minor : sequence of Finding
        What is there beyond chance, and too small or not borne out by other data.
    patched : bool
        Whether it was added to the model all the same.
    named : bool
        Whether the headline names anything.

    """

    title: ClassVar[str] = 'Minor effects'
    template: ClassVar[str] = 'small_print.html'

    minor: Sequence[Finding]
    patched: bool = False
    named: bool = False

    @property
    def share(self) -> str:
        """Head of the column of shares: no gap is open where nothing was named."""
        return 'Share of the gap' if self.named else 'Share of the remaining error'

    @property
    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Effect, joints, first value, share and p, as text."""
        return [
            (
                one.name.replace('_', ' '),
                ', '.join(one.joints) or 'whole arm',
                value_of(one, one.parameters[0], one.values[0], one.std[0]) if one.values else '',
                percent(one.share),
                probability(one.p),
            )
            for one in self.minor
        ]


@dataclass(frozen=True)
class CouldBeSeen(Section):
    """
    Smallest sizes that show, by effect.

    Attributes
    ----------
    sizes : sequence of Detectable
        Of all effects on all joints, those of an effect together.

    """

    title: ClassVar[str] = 'Smallest detectable effects'
    template: ClassVar[str] = 'could_be_seen.html'

    sizes: Sequence[Detectable]

    @property
    def rows(self) -> list[tuple[str, str, str, str]]:
        """Effect, size where it shows best and where worst, and where it does not, as text."""
        rows = []
        for name in dict.fromkeys(size.name for size in self.sizes):
            own = [size for size in self.sizes if size.name == name]
            told = sorted((s for s in own if math.isfinite(s.size)), key=lambda s: s.size)
            best, worst = (_size(told[0]), _size(told[-1])) if told else ('', '')
            never = '; '.join(_place(s) for s in own if not math.isfinite(s.size))
            rows.append((name.replace('_', ' '), best, worst if worst != best else '', never))
        return rows


@dataclass(frozen=True)
class PatchSection(Section):
    """
    What was added to the model, to be read and to be copied.

    Attributes
    ----------
    findings : sequence of Finding
        What was named.
    text : str
        model.yaml.

    """

    title: ClassVar[str] = 'Patch'
    template: ClassVar[str] = 'patch.html'

    findings: Sequence[Finding]
    text: str

    @property
    def added(self) -> list[tuple[str, str]]:
        """Name of each effect, and what it is."""
        return [
            (f.name, CATALOGUE[f.name].summary if f.name in CATALOGUE else 'an effect of your own')
            for f in self.findings
        ]

    @property
    def yaml(self) -> str:
        """Return the effects of the patched model."""
        start = max(self.text.find('effects:'), 0)
        end = self.text.find('\nmisfit:')
        return self.text[start:end] if end > start else self.text[start:]


def _size(one: Detectable) -> str:
    unit = '' if one.parameter is None else pretty(one.parameter.unit)
    where = f' in {_place(one)}' if one.joints else ''
    return f'{digits(one.size)} {unit}'.strip() + where


def _place(one: Detectable) -> str:
    return ', '.join(one.joints) or 'the arm'
