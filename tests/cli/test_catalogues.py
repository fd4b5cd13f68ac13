# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Lists fit a terminal of 80 columns, and no name in them is cut."""

from armid_ros.effects import CATALOGUE

from .conftest import armid


def test_effects_are_listed_with_whole_names():
    text = armid('effects').stdout
    assert max(map(len, text.splitlines())) <= 80
    for name, effect in CATALOGUE.items():
        assert f'{name}: ' in text
        for quantity in effect.quantities:
            whole = f'{quantity.name} [{quantity.unit}]' if quantity.unit else quantity.name
            assert whole in text
