# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with more effects, each translated into effects of the catalogue."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.arm.arm_model import ArmModel
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray


def with_named(arm: ArmModel, effect: Effect, values: FloatArray) -> ArmModel:
    """Return the arm with an effect added; its values add to existing ones."""
    there = place_in(arm, effect)
    if there is None:
        words = effect.named_as(values, arm)
        if all(said.linear and place_in(arm, said) for said, _ in words):
            for said, theirs in words:
                arm = with_named(arm, said, theirs)
            return arm
        return arm.with_effect(effect, values)
    position, rows = there
    changed = arm.values[position].copy()
    changed[rows] += values
    return replace(arm, values=(*arm.values[:position], changed, *arm.values[position + 1 :]))


def place_in(arm: ArmModel, effect: Effect) -> tuple[int, list[int]] | None:
    """Return the index of an effect and rows of its parameters; None if any is missing."""
    wanted = [(p.name, p.joint) for p in effect.parameters(arm.robot)]
    for position, own in enumerate(arm.effects):
        if isinstance(effect, type(own)) and not own.shapes and not own.points:
            names = [(p.name, p.joint) for p in own.parameters(arm.robot)]
            if set(wanted) <= set(names):
                return position, [names.index(name) for name in wanted]
    return None


def in_words(arm: ArmModel) -> ArmModel:
    """
    Return the arm with its effects translated into those of the catalogue.

    An effect that only a search uses, such as a gravity vector, becomes several effects: a tilted
    base and the magnitude of gravity.

    """
    said = replace(arm, effects=(), values=())
    for effect, values in zip(arm.effects, arm.values, strict=True):
        words = effect.named_as(values, arm)
        if len(words) == 1 and words[0][0] == effect:
            said = said.with_effect(effect, values)
            continue
        for word, theirs in words:
            said = with_named(said, word, theirs)
    return said
