# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What may have happened to an arm between two days: one cause, drawn at ordinary size."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from tests.hidden.lived.causes.base import Cause
from tests.hidden.lived.causes.contact import Holding, Knocks, Pulling
from tests.hidden.lived.causes.drive import (
    Bumps,
    Coulomb,
    CubicDrag,
    LoadFriction,
    Rotor,
    Spring,
    Stribeck,
    Viscous,
)
from tests.hidden.lived.causes.rigid import Link, Payload, Tilt, Wall
from tests.hidden.lived.causes.sensing import Delay, Encoder, Gain, Offset

#: What may have happened, by the word that cases are made of.
CAUSES: Mapping[str, type[Cause]] = MappingProxyType(
    {
        'payload': Payload,
        'link': Link,
        'tilt': Tilt,
        'mounting': Wall,
        'coulomb': Coulomb,
        'viscous': Viscous,
        'stribeck': Stribeck,
        'load_friction': LoadFriction,
        'rotor': Rotor,
        'gain': Gain,
        'offset': Offset,
        'delay': Delay,
        'encoder': Encoder,
        'spring': Spring,
        'holding': Holding,
        'pulling': Pulling,
        'knocks': Knocks,
        'bumps': Bumps,
        'cubic_drag': CubicDrag,
    }
)
