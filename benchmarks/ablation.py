# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What each rule of the diagnosis earns: the score with it and without it.

    python -m benchmarks.ablation [--kind KIND] [--cases FIRST:LAST] [--only RULE ...]
        [--processes N]

A rule is one function of the search or the verdict; without the rule it answers as if nothing had
been asked. Kinds are those of benchmarks.lived that are there to choose by, or 'laboratory', the
slice of its development set.

"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
import os
from pkgutil import resolve_name
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks import hidden_effects
from benchmarks.lived import run, select
from benchmarks.lived_scoring import LivedJudged
from benchmarks.two_days import Answer, ask
from tests.hidden.lived.specification import KINDS
from tests.hidden.scoring import Judged
from tests.hidden.specification import CaseSpec

KIND, LABORATORY = 'development', 'laboratory'


@dataclass(frozen=True)
class Rule:
    """
    A rule of the diagnosis.

    Attributes
    ----------
    place : str
        Its function, below armid_ros.diagnosis, where it is looked up when it is asked.
    without : callable
        What answers instead.

    """

    place: str
    without: Callable[..., Any]

    @contextmanager
    def left_out(self) -> Iterator[None]:
        """Diagnose without the rule."""
        module, _, name = f'armid_ros.diagnosis.{self.place}'.partition(':')
        owner, _, attribute = name.rpartition('.')
        there = resolve_name(f'{module}:{owner}') if owner else resolve_name(module)
        with patch.object(there, attribute, self.without):
            yield


def _no(*_: object, **__: object) -> bool:
    return False


def _yes(*_: object, **__: object) -> bool:
    return True


RULES = {
    'own causes before a person': Rule('verdict.headline:_as_good', _no),
}
