# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the options say of the columns of tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_ros.cli.signatures.columns import META
from armid_ros.errors import RecordingError
from armid_ros.recording import Recording
from armid_ros.recording.anything import read_anything
from armid_ros.recording.settings import DEFAULT, ReadSettings
from armid_ros.recording.tables import ColumnSettings, numbers, TablePlan
from armid_ros.recording.tables.settings import number
from armid_ros.robots import Robot
import click

_SHOWN = 'armid.columns.shown'


def settings() -> ColumnSettings:
    """Return what the options of the running command say."""
    context = click.get_current_context(silent=True)
    said = context.meta.get(META, {}) if context is not None else {}
    if not said:
        return ColumnSettings()
    return ColumnSettings(
        time=said['time'],
        position=said['position'],
        velocity=said['velocity'],
        effort=said['effort'],
        time_unit=said['time_unit'],
        rate_hz=said['rate'],
        degrees=said['degrees'],
        position_scale=numbers(said['position_scale']),
        effort_scale=numbers(said['effort_scale']),
        zero=numbers(said['zero']),
        gear=numbers(said['gear']),
        coupling=tuple(_coupling(text) for text in said['coupling']),
        rename=said['rename'],
        episode=said['episode'],
    )


def read(
    paths: Sequence[Path],
    robot: Robot,
    topic: str | None,
    reading: ReadSettings = DEFAULT,
) -> list[Recording]:
    """Read bags and tables; guesses are shown on stderr, those of equal files once."""
    said = settings()
    context = click.get_current_context(silent=True)
    shown: set[str] = set() if context is None else context.meta.setdefault(_SHOWN, set())

    def show(plan: TablePlan) -> None:
        lines = plan.lines()
        body = '\n'.join(lines[1:])
        if plan.guessed or plan.notes:
            click.echo('\n'.join(lines) if body not in shown else f'{lines[0]}, alike', err=True)
        shown.add(body)

    _no_pairs(paths, said.rename)
    return [
        read_anything(
            path,
            joints=robot.joints,
            slides=list(robot.prismatic),
            topic=topic,
            columns=said,
            show=show,
            settings=reading,
        )
        for path in paths
    ]


def _no_pairs(paths: Sequence[Path], rename: Sequence[tuple[str, str]]) -> None:
    """Refuse a pair of names that was taken as a recording, as it has no option of its own."""
    for path in paths if rename else ():
        if ':' in path.name and not path.exists():
            raise RecordingError(
                f"there is no recording '{path}'; names to exchange need an option for each pair: "
                f"--rename '{rename[-1][0]}:{rename[-1][1]}' --rename '{path}'"
            )


def _coupling(text: str) -> tuple[str, str, float]:
    pair, equals, ratio = text.partition('=')
    motor, comma, joint = pair.partition(',')
    if not equals or not comma:
        raise RecordingError(f"--coupling '{text}' has to be MOTOR,JOINT=RATIO, as in 6,5=32")
    return motor.strip(), joint.strip(), number(ratio)
