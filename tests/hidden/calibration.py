# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sizes of the hidden effects, so that each causes the gap that its case asks for."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
import json
import multiprocessing
import os
from pathlib import Path
from typing import Any

import numpy as np

from tests.hidden.cases import Draft, draft_gap, draw, gap_size, simulate, SIZES, TRAINING
from tests.hidden.specification import CaseSpec

#: How far the gap may be from what was asked for, as a factor, and how often it is tried.
CLOSE_ENOUGH, TRIALS = 1.25, 9

#: Factor by which a gap may miss its class, and how often effects are drawn to reach it.
CLASS_WIDTH, ATTEMPTS = 1.4, 5

#: What effects of ordinary size come to, more or less.
ORDINARY_GAP = 20.0

_SMALLEST_FACTOR = 1e-3


def calibrate(spec: CaseSpec) -> dict[str, Any]:
    """
    Find the factor of each effect of a case, by itself in the arm, and the gap it causes.

    Where an effect of sensible size cannot cause the gap, instruments and effects are drawn
    anew; the attempt that comes closest is taken.

    """
    best: tuple[float, dict[str, Any]] = (np.inf, {})
    for attempt in range(ATTEMPTS):
        draft = draw(spec, attempt)
        entries = [_calibrate_one(draft, k) for k in range(len(draft.effects))]
        errors = [
            abs(np.log(entry['gap'] / gap)) for entry, gap in zip(entries, spec.gaps, strict=True)
        ]
        if max(errors) < best[0]:
            best = max(errors), {'draw': attempt, 'effects': entries}
        if best[0] < np.log(CLASS_WIDTH):
            break
    return best[1]


def calibrate_all(specs: Iterable[CaseSpec], processes: int = 2, path: Path = SIZES) -> None:
    """Find the sizes of all cases that have none, and write them down as they come."""
    sizes = json.loads(path.read_text()) if path.exists() else {}
    missing = {s.sized_as: s for s in specs if s.effects and s.sized_as not in sizes}
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        results = zip(missing, pool.map(calibrate, missing.values()), strict=True)
        for count, (key, size) in enumerate(results, start=1):
            sizes[key] = size
            told = ', '.join(
                f'{entry["gap"]:.3g} of {gap:.3g}'
                for entry, gap in zip(size['effects'], missing[key].gaps, strict=True)
            )
            print(f'{count}/{len(missing)} {key}: {told}', flush=True)
            _write(sizes, path)


def _write(sizes: dict[str, dict[str, Any]], path: Path) -> None:
    lines = [f'  {json.dumps(key)}: {json.dumps(sizes[key])}' for key in sorted(sizes)]
    beside = path.with_suffix('.part')
    beside.write_text('{\n' + ',\n'.join(lines) + '\n}\n')
    os.replace(beside, path)


def _calibrate_one(draft: Draft, k: int) -> dict[str, float]:
    effect, wanted = draft.effects[k], np.log(draft.spec.gaps[k])
    most = float(np.log(effect.largest_factor))
    trials: list[tuple[float, float]] = []
    size = min(0.5 * (wanted - np.log(ORDINARY_GAP)), most)
    for _ in range(TRIALS):
        gap = np.log(_gap_of(draft, k, float(np.exp(size))))
        trials.append((size, gap))
        if abs(gap - wanted) < np.log(CLOSE_ENOUGH):
            break
        following = _next(trials, wanted, most)
        if abs(following - size) < 1e-3:
            break
        size = following
    size, gap = min(trials, key=lambda trial: abs(trial[1] - wanted))
    return {'factor': float(f'{np.exp(size):.6g}'), 'gap': float(f'{np.exp(gap):.4g}')}


def _next(trials: list[tuple[float, float]], wanted: float, most: float) -> float:
    """Return the logarithm of the next factor: between the nearest trials, or beyond them."""
    below = [trial for trial in trials if trial[1] < wanted]
    above = [trial for trial in trials if trial[1] >= wanted]
    if below and above:
        (x0, y0), (x1, y1) = max(below, key=lambda t: t[1]), min(above, key=lambda t: t[1])
        share = np.clip((wanted - y0) / (y1 - y0), 0.1, 0.9)
        return float(x0 + share * (x1 - x0))
    x, y = min(trials, key=lambda trial: abs(trial[1] - wanted))
    following = x + np.clip((wanted - y) / 2.0, -2.5, 2.5)
    return float(np.clip(following, np.log(_SMALLEST_FACTOR), most))


def _gap_of(draft: Draft, k: int, factor: float) -> float:
    """Return the gap that effect k alone causes at a factor; huge where the arm cannot go on."""
    effect = draft.effects[k].scaled(factor)
    known = {name: values.copy() for name, values in draft.known.items()}
    alone = replace(draft, effects=(effect,), known=known)
    try:
        bags = simulate(alone, TRAINING, 1 if effect.repeats else 2)
        gap = gap_size(draft_gap(alone, bags), alone.effects)
    except FloatingPointError:
        return 1e9
    return max(gap, 1e-9)
