# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Combine decoded messages into a recording with one time base.

Messages with the same joints form a series. The series with the most samples gives the time base.
The other series are interpolated linearly, except over their gaps.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.joint_state.decoder import JointSamples
from armid_ros.recording.message_types import QUANTITIES
from armid_ros.recording.recording import Clock, GAP_PERIODS, ReadReport, Recording, TimeGap
from armid_ros.recording.source import IntArray
import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

# A larger backward step of the clock is a restart (a simulation reset, a bag played in a loop),
# not a late message.
RESTART_NS = 10**9
# A torque that varies less than this is uninitialised memory, not a measurement [N m].
NOTHING = 1e-9
#: Largest accepted share of samples that are not finite.
MAX_NOT_FINITE = 0.2


def gather(pieces: Sequence[JointSamples]) -> list[JointSamples]:
    """Concatenate samples with the same joints; return one item per set of joints."""
    by_joints: dict[tuple[str, ...], list[JointSamples]] = {}
    for piece in pieces:
        by_joints.setdefault(piece.joints, []).append(piece)
    gathered = []
    for parts in by_joints.values():
        series = _concatenated(parts)
        number = series.number
        if number is not None and not (np.diff(number) > 0).all():
            series = series.select(np.argsort(number, kind='stable'))
        gathered.append(series)
    return gathered


def clock_problem(
    stamps: IntArray, position: FloatArray | None, receive: IntArray | None = None
) -> str:
    """Return why time stamps are unusable, such as 'do not advance'; empty if usable."""
    first = int(np.argmax(stamps != 0))
    if first and np.count_nonzero(stamps[first:] == 0) <= 0.01 * len(stamps):
        stamps = stamps[first:]  # simulated time is zero until the first /clock
        position = None if position is None else position[first:]
    zero = int((stamps == 0).sum())
    if zero > 0.01 * len(stamps):
        return 'are zero' if zero == len(stamps) else f'are zero in {zero} of {len(stamps)}'
    steps = np.diff(stamps[stamps != 0] if zero else stamps)
    if len(steps) == 0:
        return ''
    repeated = steps == 0
    if position is not None and not zero and repeated.any():
        # A message that was recorded twice has equal values; this is no fault of the clock.
        at = np.flatnonzero(repeated)
        repeated[at] = (position[at] != position[at + 1]).any(axis=1)
    if repeated.mean() > 0.5:
        return 'do not advance'
    if (steps < 0).mean() > 0.1:
        return 'jump back and forth'
    if receive is not None and len(receive) > 2:
        span, received = (
            float(np.ptp(times[times != 0])) if times.any() else 0.0 for times in (stamps, receive)
        )
        if received > 0 and not 1e-3 * received < span < 1e3 * received:
            return f'span {span * 1e-9:.3g} s where reception took {received * 1e-9:.3g} s'
    return ''


def ordered(series: JointSamples, clock: Clock, counts: Counter[str]) -> JointSamples:
    """Return the longest section of samples without a clock restart, sorted by time."""
    if clock == 'receive':
        assert series.receive is not None
        series = replace(series, stamps=series.receive)
    stray = series.stamps == 0
    steps = np.abs(np.diff(series.stamps[~stray]))
    if len(steps) >= 4 and (steps > RESTART_NS).any():
        stamps = series.stamps[~stray]
        # fewer than half of five neighbours may be wrong
        median = median_filter(stamps, 5, mode='mirror')
        stray[~stray] = np.abs(stamps - median) > RESTART_NS + 2 * np.median(steps)
    if stray.any():
        counts['unstamped'] += int(stray.sum())
        series = series.select(~stray)
    run = longest_run(series.stamps)
    if run is not None:
        counts['restarted'] += len(series) - (run.stop - run.start)
        series = series.select(run)
    return _sorted(series, counts)


def merged(
    series: Sequence[JointSamples], joints: Sequence[str], counts: Counter[str]
) -> JointSamples:
    """Merge samples of different joints into samples of all joints at common times."""
    holders: dict[tuple[int, ...], list[str]] = {}
    for joint in joints:
        key = tuple(i for i, one in enumerate(series) if joint in one.joints)
        holders.setdefault(key, []).append(joint)
    groups = []
    for key, names in holders.items():
        group = _concatenated([series[i].columns(names) for i in key])
        if len(key) > 1:
            order = np.argsort(group.stamps, kind='stable')
            group = _sorted(group.select(order), counts)
        if len(group):
            groups.append(group)
    if len(groups) == 1 and len(groups[0].joints) == len(joints):
        return groups[0].columns(joints)
    base = max(groups, key=len)
    known = np.ones(len(base), np.bool_)
    exact = np.ones(len(base), np.bool_)
    parts = []
    for group in groups:
        part, valid, equal = _resampled(group, base.stamps)
        known &= valid
        exact &= equal
        parts.append(part)
    counts['incomplete'] += int((~known).sum())
    counts['merged'] += int(known.sum())
    counts['interpolated'] += int((known & ~exact).sum())
    values = tuple(
        _stacked([part.values[field] for part in parts], parts, axis=1) for field in range(3)
    )
    together = JointSamples(tuple(n for part in parts for n in part.joints), base.stamps, values)
    return together.columns(joints).select(known)


def _concatenated(parts: Sequence[JointSamples]) -> JointSamples:
    if len(parts) == 1:
        return parts[0]
    values = tuple(_stacked([part.values[field] for part in parts], parts) for field in range(3))
    receive, number = (
        np.concatenate([one for one in arrays if one is not None])
        if all(one is not None for one in arrays)
        else None
        for arrays in ([part.receive for part in parts], [part.number for part in parts])
    )
    stamps = np.concatenate([part.stamps for part in parts])
    return JointSamples(parts[0].joints, stamps, values, receive, number)


def _stacked(
    arrays: Sequence[FloatArray | None], parts: Sequence[JointSamples], axis: int = 0
) -> FloatArray | None:
    """Concatenate arrays of a quantity along time or joints; NaN replaces a missing array."""
    if all(values is None for values in arrays):
        return None
    filled = [
        np.full((len(part), len(part.joints)), np.nan) if values is None else values
        for values, part in zip(arrays, parts, strict=True)
    ]
    # consecutive rows of the same array are a single view of it
    base, begins = filled[0].base, [part.ctypes.data for part in filled]
    ends = [begin + part.nbytes for begin, part in zip(begins, filled, strict=True)]
    if (
        axis == 0
        and isinstance(base, np.ndarray)
        and all(part.base is base and part.shape[1:] == base.shape[1:] for part in filled)
        and begins[1:] == ends[:-1]
    ):
        first = (begins[0] - base.ctypes.data) // base.strides[0]
        return base[first : first + sum(map(len, filled))]
    return np.concatenate(filled, axis=axis)


def longest_run(stamps: IntArray) -> slice | None:
    """Return the slice of the longest section without a clock restart; None if no restart."""
    if len(stamps) < 3:
        return None
    steps = np.diff(stamps)
    down = steps < -RESTART_NS
    # The next message must also be earlier; otherwise a single message was late.
    down[:-1] &= stamps[2:] - stamps[:-2] < -RESTART_NS
    for back in np.flatnonzero((steps < 0) & ~down):
        # Late messages fill a gap, so that their number matches the sampling rate. After a clock
        # is set back, there are twice as many messages.
        first, last = stamps[back + 1], stamps[back]
        before = int(np.count_nonzero(stamps[: back + 1] >= first))
        after = int(np.argmax(np.append(stamps[back + 1 :], last + 1) > last))
        expected = float(last - first) / float(np.median(steps[steps > 0])) + 1.0
        down[back] = after >= 10 and before + after > 1.5 * expected
    if not down.any():
        return None
    bounds = [0, *(np.flatnonzero(down) + 1).tolist(), len(stamps)]
    begin = max(range(len(bounds) - 1), key=lambda i: bounds[i + 1] - bounds[i])
    return slice(bounds[begin], bounds[begin + 1])


def _sorted(series: JointSamples, counts: Counter[str]) -> JointSamples:
    """Sort samples by time; keep the first of samples with equal stamps."""
    steps = np.diff(series.stamps)
    if (steps > 0).all():
        return series
    latest = np.maximum.accumulate(series.stamps)
    late = int((series.stamps[1:] < latest[:-1]).sum())
    if late:
        counts['out_of_order'] += late
        series = series.select(np.argsort(series.stamps, kind='stable'))
    first = np.concatenate([[True], np.diff(series.stamps) > 0])
    counts['duplicates'] += int((~first).sum())
    return series if first.all() else series.select(first)


def _resampled(
    series: JointSamples, stamps: IntArray
) -> tuple[JointSamples, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Interpolate samples at N stamps; also return masks (N,) of valid and measured samples."""
    if len(series) == len(stamps) and np.array_equal(series.stamps, stamps):
        everywhere = np.ones(len(stamps), np.bool_)
        return series, everywhere, everywhere
    own = series.stamps
    after = np.clip(np.searchsorted(own, stamps), 0, len(own) - 1)
    equal = own[after] == stamps
    before = np.where(equal, after, np.maximum(after - 1, 0))
    width = own[after] - own[before]
    period = float(np.median(np.diff(own))) if len(own) > 1 else 0.0
    inside = (own[before] <= stamps) & (own[after] >= stamps)
    valid = equal | (inside & (width <= GAP_PERIODS * period))
    weight = np.where(equal, 0.0, (stamps - own[before]) / np.maximum(width, 1))[:, np.newaxis]
    values = tuple(
        None if v is None else v[before] + weight * (v[after] - v[before]) for v in series.values
    )
    return JointSamples(series.joints, stamps, values), valid, equal


def _finite(
    where: str, joints: tuple[str, ...], series: JointSamples, counts: Counter[str]
) -> tuple[JointSamples, tuple[str, ...], tuple[str, ...]]:
    """Drop samples with non-finite values; also return missing and non-finite quantities."""
    absent: list[str] = []
    quantities: list[FloatArray | None] = []
    for name, values in zip(QUANTITIES, series.values, strict=True):
        if values is None:
            missing = list(joints)
        else:
            # a joint without measurements has NaN in its first sample too
            suspect = np.flatnonzero(np.isnan(values[:1]).any(axis=0))
            missing = [joints[j] for j in suspect if np.isnan(values[:, j]).all()]
        if missing:
            everyone = len(missing) == len(joints)
            absent.append(name if everyone else f'{name} of {", ".join(missing)}')
        quantities.append(None if missing else values)
    if quantities[0] is None:
        raise RecordingError(f'{where}: the recording has no {absent[0]}; record all positions')
    bad, not_finite = np.zeros(len(series), np.bool_), []
    most = 1e15  # uninitialised memory can hold any number
    for name, values in zip(QUANTITIES, quantities, strict=True):
        # extremes of an array are NaN if one of its values is NaN
        if values is None or (values.min(initial=0.0) > -most and values.max(initial=0.0) < most):
            continue
        wrong = ~(np.abs(values) < most)
        bad |= wrong.any(axis=1)
        numbers = zip(joints, wrong.sum(axis=0).tolist(), strict=True)
        not_finite += [f'{name} of {joint} in {number}' for joint, number in numbers if number]
    dropped = int(bad.sum())
    if dropped > MAX_NOT_FINITE * len(series):
        raise RecordingError(
            f'{where}: {dropped} of {len(series)} samples have values that are not finite '
            f'({"; ".join(not_finite)}); record again'
        )
    counts['nan'] += dropped
    samples = JointSamples(joints, series.stamps, tuple(quantities))
    return (samples.select(~bad) if dropped else samples), tuple(absent), tuple(not_finite)


def unwrapped(q: FloatArray) -> tuple[FloatArray, list[int]]:
    """
    Remove jumps by full turns from joint positions; also return the indices of these joints.

    A joint is wrapped if its positions stay within one turn, and if each step above half a turn
    is about a full turn. The tolerance depends on the other steps of the joint.

    Parameters
    ----------
    q : ndarray, shape (N, n)
        Positions [rad or degrees].

    Returns
    -------
    q : ndarray, shape (N, n)
        Continuous positions, shifted by full turns to be near zero; the same object if no joint
        was wrapped.
    joints : list of int
        Indices of the wrapped joints.

    """
    turns = (2.0 * np.pi, 360.0)  # a turn in each unit of positions [rad, degrees]
    off_a_turn = 0.15  # largest deviation of a jump from a full turn, as a share of the turn
    least = (1.0 - off_a_turn) * turns[0]
    found: list[int] = []
    for joint in range(q.shape[1]) if np.ptp(q) >= least else ():  # usually less, and fast
        if np.ptp(q[:, joint]) < least:
            continue
        step = np.diff(q[:, joint])
        for turn in turns:
            far = np.abs(step) > 0.5 * turn
            off = np.abs(np.abs(step[far]) - turn)
            usual = np.max(np.abs(step[~far]), initial=0.0)
            within = np.ptp(q[:, joint]) <= turn * (1.0 + 1e-3)
            if (
                far.any()
                and within
                and np.all(off < min(off_a_turn * turn, 3.0 * usual + 1e-3 * turn))
            ):
                continuous = np.unwrap(q[:, joint], period=turn)
                middle = 0.5 * (continuous.min() + continuous.max())
                q = q.copy() if not found else q
                q[:, joint] = continuous - turn * np.round(middle / turn)
                found.append(joint)
                break
    return q, found


def assemble(
    where: str,
    joints: tuple[str, ...],
    pieces: list[JointSamples],
    counted: Mapping[str, Any],
    **attributes: Any,
) -> Recording:
    """
    Build a recording from samples that may be late, repeated, non-finite or split by joints.

    Parameters
    ----------
    where : str
        File and topic or column, for error messages.
    joints : tuple of str
        Joint names, in the order of the recording.
    pieces : list of JointSamples
        Samples in the order of storage. The list is emptied to free its memory.
    counted : mapping of str to value
        Attributes of the `ReadReport` so far, including ``messages``.
    **attributes
        Other attributes of the recording.

    Raises
    ------
    RecordingError
        If no clock is usable, or fewer than two samples remain.

    """
    gathered, counts = gather(pieces), Counter(unstamped=counted.get('unstamped', 0))
    pieces.clear()
    problems = (clock_problem(one.stamps, one.values[0], one.receive) for one in gathered)
    note = next((f'header stamps {problem}' for problem in problems if problem), '')
    clock: Clock = 'receive' if note else 'header'
    for states in gathered if clock == 'receive' else ():
        if states.receive is None:
            raise RecordingError(
                f'{where}: the time cannot be used, as {note}; choose another column of time with '
                '--time, or give the sampling rate with --rate'
            )
        problem = clock_problem(states.receive, states.values[0])
        if problem:
            raise RecordingError(
                f'{where}: the messages have no usable time, as {note} and times of reception '
                f'{problem}; record again'
            )
    series = merged([ordered(states, clock, counts) for states in gathered], joints, counts)
    samples, absent, not_finite = _finite(where, joints, series, counts)
    stamps = samples.stamps
    if len(stamps) < 2:
        lost = [f'{n} {name.replace("_", " ")}' for name, n in counts.items() if n]
        raise RecordingError(
            f'{where}: {len(stamps)} samples remain of {counted["messages"]} messages, but two '
            f'are needed ({", ".join(lost) or "the recording is too short"})'
        )
    q, dq, tau = samples.values
    assert q is not None
    q, wrapped = unwrapped(q)
    t = (stamps - stamps[0]) * 1e-9
    for array in (t, q, dq, tau):
        if array is not None:
            array.setflags(write=False)  # a read-only array is not copied by Recording
    found = {'not_finite': not_finite, 'absent': absent, 'clock_note': note, **counted, **counts}
    steps = np.diff(t)
    at = np.flatnonzero(steps > GAP_PERIODS * np.median(steps))
    report = ReadReport(
        **found,
        samples=len(samples),
        gaps=tuple(TimeGap(float(t[k]), float(steps[k])) for k in at),
        unwrapped=tuple(joints[k] for k in wrapped),
    )
    return Recording(
        joints=joints,
        t=t,
        q=q,
        dq=dq,
        tau=tau,
        start_ns=int(stamps[0]),
        clock=clock,
        report=report,
        **attributes,
    )
