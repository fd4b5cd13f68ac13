# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings as they are looked at: without damaged samples, and with what there is to say."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.damage import without_damage
from armid_ros.recording import given_twice, Recording


def mended(
    recordings: Sequence[Recording],
    validate: Sequence[Recording],
    baseline: Sequence[Recording],
    settings: DiagnosisSettings,
) -> tuple[list[Recording], list[Recording], list[Recording], list[str]]:
    """Return recordings without damaged samples, and what reading and mending did to them."""
    notes: list[str] = []
    whole: list[list[Recording]] = []
    for part in (recordings, validate, baseline):
        sound, repairs = without_damage(part, settings.signals) if part else ([], ())
        whole.append(sound)
        harmed_ones = [one for one in part if not one.report.unharmed]
        notes += [f'{one.source}: {one.report.describe()}' for one in harmed_ones]
        notes += map(str, repairs)
    notes += filter(None, [given_twice([*recordings, *baseline], validate)])
    return whole[0], whole[1], whole[2], notes
