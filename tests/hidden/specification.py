# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which cases there are: lists made from specification.json, the same ones every time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
import json
from pathlib import Path
from types import MappingProxyType
from zlib import crc32

import numpy as np

from tests.hidden import friction, load, outside, sensing, springs
from tests.hidden.base import HiddenEffect

#: Everything that can be hidden, by name: the classes with a name, in the order of their files.
HIDDEN: Mapping[str, type[HiddenEffect]] = MappingProxyType(
    {
        one.name: one
        for module in (friction, sensing, load, springs, outside)
        for one in vars(module).values()
        if getattr(one, '__module__', '') == module.__name__ and hasattr(one, 'name')
    }
)
#: Names that the diagnosis can give.
CATALOGUED = tuple(name for name, effect in HIDDEN.items() if effect.in_catalogue)
#: Names of what it should call unknown.
OUTSIDE_NAMES = tuple(name for name, effect in HIDDEN.items() if not effect.in_catalogue)

SETS = ('development', 'development_2', 'development_3', 'locked')

SPECIFICATION = Path(__file__).with_name('specification.json')

#: What is not hidden together with something else: it acts on the whole arm, changes what the
#: other one looks like, or differs from period to period.
_ALONE = {
    'payload',
    'link_inertia',
    'gravity_magnitude',
    'base_tilt',
    'time_delay',
    'torque_drift',
    'thermal_friction',
    'human_interaction',
    'interface_slack',
    'actuator_saturation',
    'encoder_offset',
}


@dataclass(frozen=True)
class CaseSpec:
    """
    What a case is made of.

    Attributes
    ----------
    key : str
        Name, unique, such as 'development/coulomb_friction/0.5-0'.
    kind : {'single', 'free', 'pair', 'outside', 'removed'}
        'removed' is a single effect with its name taken out of the library.
    machine : str
        Robot and gravity.
    effects : tuple of str
        Names of the hidden effects.
    gaps : tuple of float
        Excess loss that each of them alone is to cause; a class of size times a spread.
    exact : bool
        Whether the nominal rigid parameters and known drives are the true ones.
    bare : bool
        Whether the arm is without friction, so that the known drives are rotor inertias only.
    noise : float
        Factor on the torque noise.
    seed : int
        Of everything that is drawn.

    """

    key: str
    kind: str
    machine: str
    effects: tuple[str, ...]
    gaps: tuple[float, ...]
    exact: bool
    bare: bool
    noise: float
    seed: int

    @property
    def sized_as(self) -> str:
        """Return the key under which the sizes of its effects are kept."""
        return self.key.removesuffix('/removed')


@cache
def case_list(name: str) -> tuple[CaseSpec, ...]:
    """Return all cases of a set, one of `SETS`."""
    rules = json.loads(SPECIFICATION.read_text())[name]
    rng = np.random.default_rng(rules['seed'])
    machines, spread = rules['machines'], rules['spread']
    seeded_as = rules.get('seeded_as', name)  # the name of the set when it was drawn
    cases: list[CaseSpec] = []

    def add(kind: str, label: str, effects: tuple[str, ...], gaps: tuple[float, ...], noise=1.0):
        key = f'{name}/{label}'
        classes = [HIDDEN[effect] for effect in effects]
        exact = any(c.rigid for c in classes) or len(cases) % 2 == 0
        needs = {need for c in classes for need in c.needs}
        bare = bool(rng.random() < 0.25) and needs <= {'rotor_inertia'}
        sizes = tuple(float(gap * spread ** rng.uniform(-1.0, 1.0)) for gap in gaps)
        machine = machines[int(rng.integers(len(machines)))]
        seed = crc32(f'{rules["seed"]} {seeded_as}/{label}'.encode())
        cases.append(CaseSpec(key, kind, machine, effects, sizes, exact, bare, noise, seed))

    for effect in CATALOGUED:
        for gap in rules['gaps']:
            for k in range(rules['singles']):
                add('single', f'{effect}/{gap:g}-{k}', (effect,), (gap,))
    for k in range(rules['effect_free']):
        noise = float(np.exp(rng.uniform(np.log(0.3), np.log(3.0)))) if k % 3 else 1.0
        add('free', f'free/{k}', (), (), noise)
    together = [effect for effect in CATALOGUED if effect not in _ALONE]
    for k in range(rules['pairs']):
        pair = tuple(str(effect) for effect in rng.choice(together, 2, replace=False))
        add('pair', f'pair/{k}', pair, tuple(rng.choice([5.0, 20.0], 2).tolist()))
    for effect in OUTSIDE_NAMES:
        for k in range(rules['outside']):
            add('outside', f'{effect}/{k}', (effect,), (rules['gaps'][1 + k % 2],))
    large = [case for case in cases if case.kind == 'single' and '/20-0' in case.key]
    for case in large:
        if not HIDDEN[case.effects[0]].rigid:  # link inertias can make any of those
            cases.append(replace(case, kind='removed', key=f'{case.key}/removed'))
    return tuple(cases)


def find_case(key: str) -> CaseSpec:
    """Return the case of a key."""
    cases = case_list(key.partition('/')[0])
    return next(case for case in cases if case.key == key)
