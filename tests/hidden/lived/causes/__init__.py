# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What may have happened to an arm between two days: one cause, drawn at ordinary size."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from tests.hidden.lived.causes import contact, drive, rigid, sensing
from tests.hidden.lived.causes.base import Cause

#: What may have happened, by the word that cases are made of.
CAUSES: Mapping[str, type[Cause]] = MappingProxyType(
    {
        'payload': rigid.Payload,
        'link': rigid.Link,
        'tilt': rigid.Tilt,
        'mounting': rigid.Wall,
        'coulomb': drive.Coulomb,
        'viscous': drive.Viscous,
        'stribeck': drive.Stribeck,
        'load_friction': drive.LoadFriction,
        'rotor': drive.Rotor,
        'gain': sensing.Gain,
        'offset': sensing.Offset,
        'delay': sensing.Delay,
        'encoder': sensing.Encoder,
        'spring': drive.Spring,
        'holding': contact.Holding,
        'pulling': contact.Pulling,
        'knocks': contact.Knocks,
        'bumps': drive.Bumps,
        'cubic_drag': drive.CubicDrag,
    }
)
