# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which cases there are: what the kind and the number of a case stand for.

A kind is the name of a set, 'development', 'development_2' or 'locked', each with seeds and arms
of its own, and a question after a stroke: see README.md.

"""

from __future__ import annotations

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from tests.hidden.lived.arms import ARMS

SEEDS = {'development': 20261122, 'development_2': 48611307, 'locked': 90412753}
#: Names of sets when they were drawn: a locked set that was looked at often has another one now.
_SEEDED_AS = {'development_2': 'locked'}

KINDS = tuple(f'{name}{kind}' for name in SEEDS for kind in ('', '/exact', '/mounting', '/pairs'))

#: How many cases a kind has where nothing else is said.
COUNTS = {'': 96, '/exact': 36, '/mounting': 20, '/pairs': 28}

#: Gap of each class of size, from and to. A natural one is as large as such causes are: a payload
#: of 2 to 12 per cent of the arm's mass, a tilt of 1 to 10 degrees, a wall.
SIZES = {
    'clear': (3.0, 10.0),
    'medium': (1.0, 3.0),
    'small': (0.25, 1.0),
    'natural': None,
    'nothing': None,
}

#: Cause and class of size of the cases in their order, again and again; 'by turns' is clear in
#: two of four rounds, medium and small in the others.
ORDER = (
    ('payload', 'natural'),
    ('coulomb', 'by turns'),
    ('tilt', 'by turns'),
    ('none', 'nothing'),
    ('gain', 'by turns'),
    ('encoder', 'by turns'),
    ('holding', 'by turns'),
    ('delay', 'by turns'),
    ('mounting', 'natural'),
    ('viscous', 'by turns'),
    ('spring', 'by turns'),
    ('none', 'nothing'),
    ('offset', 'by turns'),
    ('payload', 'by turns'),
    ('rotor', 'by turns'),
    ('bumps', 'by turns'),
    ('pulling', 'by turns'),
    ('tilt', 'natural'),
    ('load_friction', 'by turns'),
    ('none', 'nothing'),
    ('stribeck', 'by turns'),
    ('link', 'by turns'),
    ('cubic_drag', 'by turns'),
    ('knocks', 'by turns'),
)
_TURNS = ('clear', 'clear', 'medium', 'small')

#: Motions of a case; each recording of 'mixed' has one of its own.
_STYLES = ('sines', 'dwells', 'wandering', 'periodic', 'mixed')

_EXACT = (
    ('payload', 'values'),
    ('payload', 'names'),
    ('none', 'values'),
    ('encoder', 'names'),
    ('none', 'names'),
    ('link', 'values'),
)
_PAIRS = (
    *('payload', 'coulomb', 'viscous', 'gain', 'tilt', 'encoder', 'spring', 'offset', 'rotor'),
    *('load_friction', 'stribeck', 'holding', 'delay', 'link'),
)


@dataclass(frozen=True)
class LivedSpec:
    """
    What a case is made of.

    Attributes
    ----------
    kind : str
        One of KINDS.
    index : int
        Number of the case.
    arm : str
        Name of the arm.
    cause : str
        Key of CAUSES, or 'none'.
    size : str
        Key of SIZES.
    wanted : float or None
        Gap that the cause is to have; None for as it is drawn.
    styles : dict of str to str
        Style of the motion of each run: day_1/0 to day_1/2, day_2/0 to day_2/2, held_out.
    exact : bool
        Whether description and friction are all there is.
    friction : {'unknown', 'values', 'names'}
        What the engineer's model has of the friction.
    gravity : tuple of float or None
        Gravity of day 2 where that is the question [m/s^2].
    seed : int
        Of everything that is drawn, but for what a pair has in common.
    shared_seed : int
        Of what a pair has in common: arm, instruments and cause.

    """

    kind: str
    index: int
    arm: str
    cause: str
    size: str
    wanted: float | None
    styles: dict[str, str]
    exact: bool
    friction: str
    gravity: tuple[float, float, float] | None
    seed: int
    shared_seed: int

    @property
    def second_of_pair(self) -> bool:
        """Whether its cause is that of the case before it."""
        return self.kind.endswith('/pairs') and self.index % 2 == 1

    @property
    def key(self) -> str:
        """Name of the case."""
        return f'{self.kind}/{self.index}'

    def rng(self, purpose: str, run: str = '') -> np.random.Generator:
        """Return the source of randomness of a purpose."""
        shared = purpose in ('arm', 'instruments', 'cause')
        seed = self.shared_seed if shared else self.seed
        return np.random.default_rng([seed, crc32(f'{purpose} {run}'.encode())])


def specify(kind: str, index: int) -> LivedSpec:
    """Return what a case is made of."""
    if kind not in KINDS or index < 0:
        raise ValueError(f'no case {index} of {kind!r}; kinds are {", ".join(KINDS)}')
    name, _, question = kind.partition('/')
    pair = index // 2 if question == 'pairs' else index
    seeded_as = f'{_SEEDED_AS.get(name, name)}{kind.removeprefix(name)}'
    seed = crc32(f'{SEEDS[name]} {seeded_as} {index}'.encode())
    shared = crc32(f'{SEEDS[name]} {seeded_as} shared {pair}'.encode())
    rng = np.random.default_rng(shared)
    arms = ARMS[name]
    arm = arms[(pair + pair // len(arms)) % len(arms)]
    cause, size, friction, gravity = _question(question, index)
    wanted = SIZES[size]
    gap = None if wanted is None else float(np.exp(rng.uniform(*np.log(wanted))))
    style = _STYLES[(index + index // len(_STYLES)) % len(_STYLES)]
    if question == 'pairs':
        style = ('periodic', 'dwells')[index % 2]
    exact = question == 'exact' or (question == 'mounting' and index % 2 == 0)
    days = ('day_2',) if question in ('exact', 'mounting') else ('day_1', 'day_2')
    runs = [f'{day}/{k}' for day in days for k in range(3)] + ['held_out']
    styles = {
        run: _STYLES[(k + index) % 4] if style == 'mixed' else style for k, run in enumerate(runs)
    }
    return LivedSpec(
        kind, index, arm, cause, size, gap, styles, exact, friction, gravity, seed, shared
    )


def _question(
    question: str, index: int
) -> tuple[str, str, str, tuple[float, float, float] | None]:
    """Return cause, size, what is known of the friction, and gravity."""
    if question == 'exact':
        cause, friction = _EXACT[index % len(_EXACT)]
        return cause, 'nothing' if cause == 'none' else 'natural', friction, None
    if question == 'mounting':
        return 'mounting', 'natural', 'unknown', sphere(index)
    if question == 'pairs':
        return _PAIRS[index // 2 % len(_PAIRS)], 'clear', 'unknown', None
    cause, size = ORDER[index % len(ORDER)]
    if size == 'by turns':
        size = _TURNS[(index // len(ORDER) + index) % len(_TURNS)]
    return cause, size, 'unknown', None


def sphere(index: int, count: int = 20) -> tuple[float, float, float]:
    """Return gravity in one of 20 even directions, of the earth and the moon by turns."""
    z = 1.0 - 2.0 * (index % count + 0.5) / count
    angle = index * np.pi * (3.0 - np.sqrt(5.0))
    magnitude = 9.81 if index % 4 < 2 else 1.62
    flat = magnitude * np.sqrt(1.0 - z * z)
    return float(flat * np.cos(angle)), float(flat * np.sin(angle)), float(magnitude * z)
