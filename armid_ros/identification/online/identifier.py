# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Online identification: an estimate that is updated with one joint state at a time.

Only some joint states become a regression row. A row is processed in two steps. Its prediction by
the previous estimate is computed at once. The update with the row waits for the next joint state,
which usually becomes no row. No joint state therefore needs both steps. Reading the estimate runs
a pending update first.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, ClassVar

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.online.background import Background
from armid_ros.identification.online.change import Change, change_candidates
from armid_ros.identification.online.change_watch import ChangeWatch, NuisanceRows, Row
from armid_ros.identification.online.checks import MissingSamples, StreamChecks
from armid_ros.identification.online.recursive import (
    check_forgetting,
    RecursiveLeastSquares,
    WeightedSample,
)
from armid_ros.identification.online.robust_covariance import RobustCovariance
from armid_ros.identification.online.settings import OnlineSample, OnlineSettings
from armid_ros.identification.rows.causal import (
    CausalFilter,
    CausalMotion,
    check_gap,
    RowNoise,
    sensor_noise,
    TripleLag,
)
from armid_ros.identification.samples.spikes import SpikeGate
from armid_ros.identification.samples.straight_line import StreamSample
from armid_ros.model import BaseParameters, regressor
from armid_ros.motion import FloatArray, Motion
import numpy as np
import numpy.typing as npt

__all__ = ['OnlineIdentifier', 'OnlineSample', 'OnlineSettings']

#: Lower bound of a divisor.
_SMALLEST = float(np.finfo(float).tiny)


class OnlineIdentifier:
    """
    Recursive estimator of base and effect parameters, while the arm moves.

    Parameters
    ----------
    arm : ArmModel
        Robot and effects; the effects have to be linear in their parameters.
    settings : OnlineSettings, optional
        Filters, weights, forgetting.
    rng : numpy.random.Generator
        Generator of the random states from which base parameters are found.

    Raises
    ------
    IdentificationError
        If a setting is out of range or does not fit the arm.

    Attributes
    ----------
    base : BaseParameters
        The estimated base parameters.
    latest : tuple of OnlineSample
        Torque predictions of the last update; several if earlier joint states had to wait.

    Examples
    --------
    >>> import armid_ros as ar
    >>> import numpy as np
    >>> run = ar.read_recording('monday', 'my_arm.urdf')
    >>> arm = ar.ArmModel.of('my_arm.urdf', effects='viscous_friction,coulomb_friction')
    >>> online = ar.OnlineIdentifier(arm, rng=np.random.default_rng(0))
    >>> for t, q, tau in zip(run.t, run.q, run.tau, strict=True):
    ...     _ = online.update(t, q, None, tau)
    >>> estimate = online.estimate()
    >>> print(estimate.values[estimate.index('viscous_coefficient', 'elbow')].round(1))
    0.3

    """

    #: Settings that can change without a restart.
    CHANGEABLE: ClassVar = ('forgetting', 'max_gap', 'false_alarm_time')

    def __init__(
        self,
        arm: ArmModel,
        settings: OnlineSettings | None = None,
        *,
        rng: np.random.Generator,
    ) -> None:
        settings = settings or OnlineSettings()
        robot = arm.robot
        past = [effect.name for effect in arm.effects if not effect.instantaneous]
        if past:
            raise IdentificationError(
                f'the effect {past[0]} depends on earlier motion, so it cannot be identified '
                'online; identify it from a recording'
            )
        self.arm, self.settings = arm, settings
        self.base: BaseParameters = arm.base_parameters(rng)
        self._kept = np.array([-1, *self.base.independent]) + 1  # torque and base columns
        self._searches = settings.false_alarm_time is not None  # for changes, at any time
        held = {joint for e in arm.effects if e.holds_at_rest for joint in e.joints}
        self._held = np.array([joint in held for joint in robot.joints])
        self.reset()

    def reset(self) -> None:
        """Clear the estimate and all counters; keep the settings."""
        arm, robot, settings = self.arm, self.arm.robot, self.settings
        self._filter = CausalFilter(
            robot.n_joints,
            settings.cutoff,
            max_gap=settings.max_gap,
            measured_velocity=settings.measured_velocity,
        )
        self._gate = SpikeGate(
            robot.prismatic,
            'qvt' if settings.measured_velocity else 'qt',
            torque_limit=robot.torque_limit,
        )
        self._checks = StreamChecks(robot, self._gate)
        self._missing = MissingSamples()
        self._row_filter = TripleLag(settings.cutoff)
        self._row_period = 1.0 / settings.row_rate
        self._work = Background()
        self._due = 0.0  # number of pieces of background work that are due
        self._had_row = False
        self._estimator = RecursiveLeastSquares(
            self.base.parameters,
            sensor_noise(robot, settings.torque_noise),
            forgetting=settings.forgetting,
            start=self.base.values(arm.theta),
            scale_covariance=settings.torque_noise is None,
        )
        window = max(1, round(4.0 / self._row_period))  # 4 s, beyond the correlation of errors
        self._scores = RobustCovariance(window, settings.forgetting, self._work)
        self._watch = None
        if self._searches and (candidates := change_candidates(arm, self.base)):
            watched = self._estimator, NuisanceRows(arm, settings.cutoff), candidates
            self._watch = ChangeWatch(*watched, settings.false_alarm_time, self._work)
        self._pending: tuple[Row, FloatArray] | None = None  # with its innovation
        self._n_changes = 0
        self.latest: tuple[OnlineSample, ...] = ()
        # of residuals: weighted squares, and their weights
        self._squares, self._counts = np.zeros((2, robot.n_joints))
        # largest negligible error of each signal: positive for torques, else 0
        self._negligible = np.zeros((2 + settings.measured_velocity) * robot.n_joints)
        self._generation = -1
        self._last_row: float | None = None
        self._last_moving = np.full(robot.n_joints, -np.inf)
        self._last_useless = self._last_moving.copy()  # last rest, or start of the row filter
        self._noise: RowNoise | None = None

    def update(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> OnlineSample | None:
        """
        Update the estimate with a joint state; return the torque prediction if the state is used.

        Parameters
        ----------
        t : float
            Stamp [s].
        q, tau : array_like, shape (n,)
            Measured position [rad or m] and torque [N m or N], in the order of the robot.
        dq : array_like, shape (n,), or None
            Measured velocity; not used unless `measured_velocity` is set.

        Returns
        -------
        OnlineSample or None
            Torque prediction; None between used samples, while the filters settle, and for a
            joint state that is left out.

        """
        added = self._add_pending_row()
        signal = self._filter.signal(t, q, dq, tau)
        self.latest = ()
        if signal is not None:
            self._missing.take(t, self._filter.period)
            good = self._gate.take(t, signal, self._negligible)
            found = [self._process(sample) for sample in good]
            self.latest = tuple(one for one in found if one is not None)
        # background work runs with samples that need no other work, if there are any
        period = self._filter.period or 0.0
        if self.latest:
            busy = not self._had_row
        else:
            # samples per row from which the update with a row has a sample to itself. With fewer
            # samples, the update shares its sample with pieces of background work.
            busy = added and 4.0 * period <= self._row_period
        # at least 400 pieces per second; at 200 rows per second, up to 280 are needed
        self._due = min(self._due, 2.0) + 400.0 * period
        if not busy:
            self._add_pending_row()
            if not self._gate.settle():  # a full window would always end with a row
                pieces = max(1, int(self._due))
                self._work.advance(pieces)
                self._due = max(0.0, self._due - pieces)
        self._had_row = bool(self.latest)
        return self.latest[-1] if self.latest else None

    def __getstate__(self) -> dict[str, Any]:
        """Finish pending computations, which cannot be copied; return the state for a copy."""
        self._add_pending_row()
        self._work.finish()
        return self.__dict__

    def _process(self, sample: StreamSample) -> OnlineSample | None:
        """Filter a valid joint state; return the torque prediction, or None if not used."""
        if sample.begins:
            self._filter.restart('position_step')
        self._checks.take(sample.t)
        motion = self._filter.advance(sample.t, sample.x)
        if motion is None:
            return None
        if self._filter.generation != self._generation:
            # the row filter restarts together with the motion filter
            self._row_filter.reset()
            self._add_pending_row()
            self._scores.interrupt()
            if self._watch is not None:
                self._watch.interrupt()
            self._generation = self._filter.generation
            period, pole = self._filter.period, self._filter.pole
            assert period is not None and pole is not None
            self._noise = RowNoise.of(period, pole, self._row_filter.pole)
            self._last_row = None
            self._last_moving[:] = -np.inf
            self._last_useless[:] = motion.t
        # a joint below this velocity [rad/s or m/s] for longer than this time [s] is at rest; a
        # reversal is shorter. Dry friction may hold a joint at rest with any torque, so its torque
        # is not used.
        moving = np.abs(motion.dq) >= 0.01
        self._last_moving[moving] = motion.t
        if not all(moving.tolist()):
            resting = motion.t - self._last_moving > 0.1
            self._last_useless[resting & self._held] = motion.t
        begins = self._last_row is None
        step = self._row_period if self._last_row is None else motion.t - self._last_row
        if step < self._row_period - 0.5 * (self._filter.period or 0.0):
            return None
        self._last_row = motion.t
        # after ten time constants of the row filter, the effect of its start or of a rest is 3e-3
        used = motion.t - self._last_useless > 10.0 / self._row_filter.pole
        usable = not (self._checks.error or self._checks.silent)
        return self._new_row(motion, step, used & usable, begins)

    def estimate(self) -> Estimate:
        """Return the estimate of base parameters, with a covariance for autocorrelated errors."""
        self._add_pending_row()
        estimate = self._estimator.estimate
        covariance = self._scores.covariance(self._estimator.root)
        return estimate if covariance is None else replace(estimate, covariance=covariance)

    def model(self) -> ArmModel:
        """Return the arm model with the estimate; unidentified parameters keep their values."""
        self._add_pending_row()
        return self.arm.with_theta(self.base.lift(self._estimator.values, self.arm.theta))

    def check(self, settings: OnlineSettings) -> None:
        """
        Raise an error if settings cannot be changed while the arm moves; see `use`.

        Raises
        ------
        IdentificationError
            If the settings need a restart, or are out of range.

        """
        for setting in fields(settings):
            same = getattr(settings, setting.name) == getattr(self.settings, setting.name)
            if setting.name not in self.CHANGEABLE and not same:
                raise IdentificationError(
                    f'the setting {setting.name} cannot change now; restart the identification'
                )
        if not self._searches and settings.false_alarm_time is not None:
            raise IdentificationError(
                'false_alarm_time cannot be set now, as change detection was off at the start; '
                'restart the identification'
            )
        check_forgetting(settings.forgetting)
        check_gap(settings.max_gap)

    def use(self, settings: OnlineSettings) -> None:
        """
        Change settings during the identification, and keep the estimate.

        Parameters
        ----------
        settings : OnlineSettings
            New settings, which may differ only in those of `CHANGEABLE`.

        Raises
        ------
        IdentificationError
            If the settings need a restart, or are out of range.

        """
        self.check(settings)
        self.settings = settings
        self._filter.max_gap = settings.max_gap
        self._add_pending_row()
        self._estimator.forgetting = self._scores.forgetting = settings.forgetting
        if self._watch is not None:
            self._watch.use(settings.false_alarm_time, settings.forgetting)

    @property
    def changes(self) -> tuple[Change, ...]:
        """Return the detected changes since the last reset, oldest first."""
        return () if self._watch is None else tuple(self._watch.changes)

    @property
    def condition_number(self) -> float:
        """Return the condition number of the weighted regressor; this takes a millisecond."""
        self._add_pending_row()
        return self._estimator.condition_number

    @property
    def samples(self) -> int:
        """Return the number of samples that the estimator has used."""
        self._add_pending_row()
        return self._estimator.samples

    @property
    def missing(self) -> int:
        """Return the number of missing joint states, computed from the timestamps."""
        return self._missing.count

    @property
    def rejected(self) -> Mapping[str, int]:
        """Number of joint states that the filters rejected, by reason."""
        return Counter(self._filter.rejected) + self._gate.rejected

    @property
    def error(self) -> str:
        """Fault that prevents identification, such as zero torques; empty if there is none."""
        return self._checks.error

    @property
    def spikes(self) -> Mapping[tuple[str, str], int]:
        """Number of joint states rejected because of a spike, by joint and signal."""
        joints = self.arm.robot.joints
        signals = ('position', *(['velocity'] * self.settings.measured_velocity), 'effort')
        names = [(joint, signal) for signal in signals for joint in joints]
        return {names[k]: count for k, count in self._gate.spikes.items()}

    @property
    def restarts(self) -> Mapping[str, int]:
        """Number of filter restarts, by reason; see CausalFilter."""
        return self._filter.restarts

    @property
    def delay(self) -> float | None:
        """Return the delay of the filters [s]; None until the sampling period is known."""
        pole = self._filter.pole
        return None if pole is None else 3.0 / pole + self._row_filter.delay

    def _new_row(
        self, motion: CausalMotion, step: float, used: npt.NDArray[np.bool_], begins: bool
    ) -> OnlineSample:
        """Return the torque prediction of a filtered joint state; store its regression row."""
        state = (motion.q[None], motion.dq[None], motion.ddq[None])
        one = Motion(self.arm.robot.joints, np.array([motion.t]), *state)
        rigid, effects = regressor(self.arm.robot, one)[0], self.arm.effect_columns(one)[0]
        columns = np.concatenate([motion.tau[:, np.newaxis], rigid, effects], axis=1)
        used_columns = columns.take(self._kept, axis=1)
        filtered = self._row_filter.update(step, used_columns.reshape(-1))[2]
        noise = self._noise
        assert noise is not None
        gain, independent = noise.gain, noise.independent(min(step, self._row_period))
        stamp = motion.t - (self.delay or 0.0)
        row = (filtered / gain).reshape(used_columns.shape)
        sample = WeightedSample(row[:, 1:], row[:, 0], np.asarray(used * independent))
        self._add_pending_row()
        predicted = sample.rows @ self._estimator.values
        self._pending = Row(stamp, sample, motion, step, gain, begins), sample.tau - predicted
        return OnlineSample(stamp, sample.tau * gain, predicted * gain, used)

    def _add_pending_row(self) -> bool:
        """Update the estimate with a pending regression row; return whether a row was pending."""
        if self._pending is None:
            return False
        (row, innovation), self._pending = self._pending, None
        sample, estimator = row.sample, self._estimator
        if self._watch is None:
            estimator.update(*sample)
        else:
            self._watch.update(row)
            for change in self._watch.changes[self._n_changes :]:
                self._scores.allow_change(change.changed_directions, estimator.values)
                self._n_changes += 1
        residual = sample.tau - sample.rows @ estimator.values
        self._squares = (
            estimator.forgetting * self._squares + sample.weights * innovation * residual
        )
        self._counts = estimator.forgetting * self._counts + sample.weights
        known = np.maximum(self._counts, _SMALLEST)
        deviation = np.sqrt(np.maximum(self._squares, 0.0) / known)
        assert self._noise is not None
        np.multiply(deviation, self._noise.single, out=self._negligible[-len(deviation) :])
        self._scores.add(sample, estimator.scale(sample.weights), estimator.values)
        return True
