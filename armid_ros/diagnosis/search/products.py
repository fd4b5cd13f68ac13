# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Products of the columns of a problem, a small matrix for each block of its rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.rows import Problem
from armid_ros.diagnosis.search.candidates import Group
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Products:
    """
    Products of the columns of a problem, block by block.

    Attributes
    ----------
    free : ndarray, shape (B, f, f)
        Of the free columns with each other.
    aim : ndarray, shape (B, f)
        Of the free columns with the residual.
    border : ndarray, shape (B, f, C)
        Of the free columns with those of the groups.
    target : ndarray, shape (B, C)
        Of the columns of the groups with the residual.
    diagonal : ndarray, shape (B, C)
        Squares of the columns of the groups.
    own : tuple of ndarray, each (B, p, p)
        Of the columns of each group with each other.
    power : ndarray, shape (B,)
        Squares of the residual.

    """

    free: FloatArray
    aim: FloatArray
    border: FloatArray
    target: FloatArray
    diagonal: FloatArray
    own: tuple[FloatArray, ...]
    power: FloatArray


def products(problem: Problem, free: Sequence[int], groups: Sequence[Group]) -> Products:
    """Multiply columns; those of the groups are the first of the problem."""
    chosen = list(free)
    size = max((group.columns.stop for group in groups), default=0)
    blocks = int(problem.block.max()) + 1
    parts: list[list[FloatArray]] = [[] for _ in range(6)]
    own: list[list[FloatArray]] = [[] for _ in groups]
    for block in range(blocks):
        rows = problem.block == block
        y = problem.y[rows].ravel()
        x = problem.x[rows].reshape(len(y), problem.x.shape[2])
        f, c = x[:, chosen], x[:, :size]
        values = f.T @ f, f.T @ y, f.T @ c, c.T @ y, np.einsum('ij,ij->j', c, c), y @ y
        for part, value in zip(parts, values, strict=True):
            part.append(value)
        for products_of, group in zip(own, groups, strict=True):
            span = group.columns
            inner = c[:, span]
            one = group.size == 1
            products_of.append(values[4][span][:, np.newaxis] if one else inner.T @ inner)
    stacked = [np.array(part) for part in parts]
    return Products(
        stacked[0],
        stacked[1].reshape(blocks, -1),
        stacked[2].reshape(blocks, len(chosen), size),
        stacked[3].reshape(blocks, -1),
        stacked[4].reshape(blocks, -1),
        tuple(np.array(part) for part in own),
        stacked[5],
    )


def with_group(known: Products, problem: Problem, beside: FloatArray, own: FloatArray) -> Products:
    """
    Return the products of one group beside what is free.

    Parameters
    ----------
    known : Products
        Of what is free.
    problem : Problem
        The rows.
    beside : ndarray, shape (R, n, f)
        Columns that are free.
    own : ndarray, shape (R, n, p)
        Columns of the group.

    """
    blocks, size = len(known.power), own.shape[2]
    border = np.empty((blocks, beside.shape[2], size))
    target, inner = np.empty((blocks, size)), np.empty((blocks, size, size))
    for block in range(blocks):
        rows = problem.block == block
        x = own[rows].reshape(-1, size)
        border[block] = beside[rows].reshape(len(x), -1).T @ x
        target[block] = x.T @ problem.y[rows].ravel()
        inner[block] = x.T @ x
    return replace(
        known,
        border=border,
        target=target,
        diagonal=np.diagonal(inner, axis1=1, axis2=2),
        own=(inner,),
    )
