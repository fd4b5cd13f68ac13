# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The nuisance parameters of a comparison: body, friction, and the discrepancy of the model.

For recording k, in weighted rows, in each joint

    y_k = X_k b + B_k (d0 + d_k) + Z_k (g0 + [k is of the diagnosed day] g + u_k) + e_k

with the body b (prior: the description), the discrepancy d0 that all recordings share and d_k of
one motion (Kennedy and O'Hagan, Bayesian calibration of computer models, 2001), and the values g
of a cause. For given amplitudes of d0, d_k and e_k, all variables are Gaussian. Each d_k is
therefore integrated out of the normal equations of its recording.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import described_precision, excited
from armid_ros.diagnosis.data.days import Rows
from armid_ros.diagnosis.data.discrepancy import discrepancy_columns
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.setting import Marginal, MotionDiscrepancy, Setting
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import linalg

#: Least prior precision over the squares of a column, so that the equations can be solved.
_MIN_PRECISION = 1e-12
#: Relative prior error of a described value of an effect, or of a torque in unvisited states.
#: Errors of values in the laboratory reach 0.1, and friction of an arm changes by 0.2 in a day.
_RELATIVE_PRIOR_STD = 0.25


@dataclass(frozen=True)
class Nuisance:
    """
    Regression columns of nuisance parameters: rigid body, friction and discrepancy.

    Attributes
    ----------
    rows : Rows
        The data.
    arm : ArmModel
        The model, with friction in all joints, given or not.
    base : BaseParameters
        The r parameters b of its body and friction.
    prior_precision : ndarray, shape (r, r)
        Prior precision of b.
    unset : ndarray of bool, shape (r,)
        Whether each of b has no given value.
    columns : tuple of ndarray, each (n, M, q)
        Weighted columns of each recording: body, and the discrepancy of one joint after the other.
    residual : tuple of ndarray, each (n, M)
        Weighted residual of the model.
    column_products : (ndarray, shape (K, q, q), ndarray, shape (K, q))
        Products of these columns with each other and with the residual, in each recording.
    accepted : tuple of Cause
        Accepted causes.

    """

    rows: Rows
    arm: ArmModel
    base: BaseParameters
    prior_precision: FloatArray
    unset: npt.NDArray[np.bool_]
    columns: tuple[FloatArray, ...]
    residual: tuple[FloatArray, ...]
    column_products: tuple[FloatArray, FloatArray]
    accepted: tuple[Cause, ...] = ()

    @classmethod
    def of(
        cls,
        rows: Rows,
        arm: ArmModel,
        rng: np.random.Generator,
        known: FloatArray | None = None,
        constant: Sequence[int] = (),
        gravity: FloatArray | None = None,
    ) -> Nuisance:
        """
        Compute the nuisance columns of the data.

        Parameters
        ----------
        rows : Rows
            The data.
        arm : ArmModel
            The model.
        rng : numpy.random.Generator
            Draws the random states from which base parameters are found.
        known : ndarray, shape (P, P), optional
            Information on the first parameters of the arm, added to that of its description.
        constant : sequence of int
            Parameters of the arm that are not fitted, as an accepted cause changes them.
        gravity : ndarray, shape (3,), optional
            Gravity that acts on errors of the body, if it is another than in the model [m/s^2]:
            the torque is bilinear in gravity and body.

        """
        free = np.setdiff1d(np.arange(len(arm.parameters)), constant)
        felt = arm if gravity is None else replace(arm, robot=arm.robot.with_gravity(gravity))
        base, columns = excited(felt, felt.base_parameters(rng, free), rows.data)
        prior_precision = described_precision(base, arm, known)
        rigid = len(arm.robot.rigid_parameters)
        values = arm.theta[base.independent]
        unset = (base.independent >= rigid) & (values == 0.0)  # noqa: RUF069 - no given value
        given = (base.independent >= rigid) & ~unset
        prior_precision[given, given] += (_RELATIVE_PRIOR_STD * values[given]) ** -2.0
        joints = range(arm.robot.n_joints)
        functions = discrepancy_columns(rows.data, arm)
        both = [np.concatenate(pair, axis=2) for pair in zip(columns, functions, strict=True)]
        rest = [part.residual(arm)[:, :, np.newaxis] for part in rows.data]
        weighted = rows.weighted(both, joints)
        residual = [x[:, :, 0] for x in rows.weighted(rest, joints)]
        size = weighted[0].shape[2]
        pairs = [(x.reshape(-1, size), y.ravel()) for x, y in zip(weighted, residual, strict=True)]
        return cls(
            rows,
            arm,
            base,
            prior_precision,
            unset,
            tuple(weighted),
            tuple(residual),
            (np.array([x.T @ x for x, _ in pairs]), np.array([x.T @ y for x, y in pairs])),
        )

    @property
    def rank(self) -> int:
        """Return the number of columns of the rigid body."""
        return self.base.rank

    @cached_property
    def discrepancy(self) -> npt.NDArray[np.intp]:
        """Columns of the discrepancy of each joint, shape (n, f)."""
        size = self.columns[0].shape[2]
        return np.arange(self.rank, size).reshape(len(self.columns[0]), -1)

    @cached_property
    def acting(self) -> list[list[tuple[npt.NDArray[np.intp], FloatArray]]]:
        """Columns that act on each joint in each recording: their indices, and values (M, c)."""
        body = np.arange(self.rank)
        places = [np.concatenate([body, own]) for own in self.discrepancy]
        return [
            [(place, x[:, place]) for place, x in zip(places, columns, strict=True)]
            for columns in self.columns
        ]

    @cached_property
    def count(self) -> npt.NDArray[np.intp]:
        """Return the number of informative entries of each recording, (K,)."""
        folds = [part.fold for part in self.rows.data]
        return np.bincount(folds, [np.count_nonzero(w) for w in self.rows.weight]).astype(int)

    @cached_property
    def square(self) -> FloatArray:
        """Products of all columns of each recording, (K, q + a, q + a); causes are last."""
        if not self.accepted:
            return self.column_products[0]
        border = np.concatenate([self._acting(x) * x.products for x in self.accepted], axis=2)
        pairs = [self._acting(x) * self._among_accepted(x) for x in self.accepted]
        within = np.concatenate(pairs, axis=2)
        below = np.concatenate([border.swapaxes(1, 2), within], axis=2)
        return np.concatenate(
            [np.concatenate([self.column_products[0], border], axis=2), below], axis=1
        )

    @cached_property
    def cross(self) -> FloatArray:
        """Products of all columns of each recording with its residual, (K, q + a)."""
        aims = [one.aim * self._acting(one)[:, :, 0] for one in self.accepted]
        return np.concatenate([self.column_products[1], *aims], axis=1)

    @cached_property
    def power(self) -> FloatArray:
        """Sum of squares of the weighted residual, for each recording, (K,)."""
        return np.array([np.sum(own**2) for own in self.residual])

    def _among_accepted(self, cause: Cause) -> FloatArray:
        """Return the cross products of accepted causes with a cause, (K, a, p)."""
        parts = [self._acting(one) * one.products_with(cause) for one in self.accepted]
        return np.concatenate(parts, axis=1)

    def _acting(self, cause: Cause) -> FloatArray:
        """Return 1 for each recording in which an accepted cause acts, otherwise 0, (K, 1, 1)."""
        return cause.acts(self.rows.today).astype(float)[:, np.newaxis, np.newaxis]

    def products(self, cause: Cause) -> FloatArray:
        """Return the cross products of all columns with a cause, (K, q + a, p)."""
        if not self.accepted:
            return cause.products
        return np.concatenate([cause.products, self._among_accepted(cause)], axis=1)

    def and_cause(self, cause: Cause, size: float = 1.0) -> Nuisance:
        """Return the nuisance parameters with a cause added, with its deviation in its unit."""
        return replace(self, accepted=(*self.accepted, replace(cause, size=size)))

    def without(self, name: int) -> Nuisance:
        """Return the nuisance parameters without one of the accepted causes."""
        return replace(self, accepted=(*self.accepted[:name], *self.accepted[name + 1 :]))

    def with_residual(self, residual: Sequence[FloatArray]) -> Nuisance:
        """Return the nuisance parameters for another weighted residual, (n, M) per recording."""
        pairs = zip(self.columns, residual, strict=True)
        aims = np.array([x.reshape(-1, x.shape[2]).T @ y.ravel() for x, y in pairs])
        accepted = tuple(one.aimed_at(residual) for one in self.accepted)
        return replace(
            self,
            residual=tuple(residual),
            column_products=(self.column_products[0], aims),
            accepted=accepted,
        )

    @property
    def spans(self) -> list[slice]:
        """Return the indices of the values of each accepted cause among all parameters."""
        size = self.columns[0].shape[2]
        counts = [len(one.unit) for one in self.accepted]
        stops = size + np.cumsum(counts, dtype=int)
        return [slice(s - count, s) for count, s in zip(counts, stops.tolist(), strict=True)]

    @cached_property
    def reach(self) -> FloatArray:
        """
        Return the factor of the discrepancy in states that the first day did not reach, (n, f).

        The misfit limits the discrepancy in visited states only. In other states, the
        discrepancy may be a share of the torque.

        """
        before = self.rows.before
        if not before:
            return np.ones(self.discrepancy.shape)
        then, now = (
            np.mean([np.diag(x)[self.discrepancy] for x in part], axis=0)
            for part in (self.square[:before], self.square[before:])
        )
        most = np.maximum(_RELATIVE_PRIOR_STD * self.rows.torque / self.rows.amplitude[0], 1.0)
        with np.errstate(divide='ignore', invalid='ignore'):
            more = np.sqrt(np.where(now > 0.0, now / then, 1.0))
        return np.asarray(np.clip(more, 1.0, most[:, np.newaxis]))

    def prior(self, setting: Setting) -> tuple[npt.NDArray[np.intp], FloatArray]:
        """Return the indices of the fitted parameters, and the precision of their prior."""
        unit = self.rows.amplitude[0]
        rigid = self.base.independent < len(self.arm.robot.rigid_parameters)
        scale = np.where(rigid, setting.body or 1.0, 1.0)
        squares = np.diagonal(self.column_products[0], axis1=1, axis2=2).sum(axis=0)[: self.rank]
        body = self.prior_precision / np.outer(scale, scale)
        body += _MIN_PRECISION * np.diag(np.where(squares > 0.0, squares, 1.0))
        size = max(setting.shared, _MIN_PRECISION) * unit[:, np.newaxis] * self.reach
        of_causes = [one.size * one.unit for one in self.accepted]
        others = np.concatenate([size.ravel(), *of_causes]) ** -2.0
        whole = linalg.block_diag(body, np.diag(others))
        fitted = np.ones(len(whole), dtype=bool)
        fitted[: self.rank] = (setting.body > 0.0) | self.unset
        fitted[self.discrepancy.ravel()] = setting.shared > 0.0
        used = np.flatnonzero(fitted)
        return used, whole[np.ix_(used, used)]

    def rows_of(self, k: int) -> FloatArray:
        """Return the weighted columns of all parameters in a recording, (M, n, q + a)."""
        joints, rows, _ = self.columns[k].shape
        blocks = [self.columns[k]]
        for one in self.accepted:
            own = np.zeros((joints, rows, len(one.unit)))
            if one.acts(self.rows.today)[k]:
                own[list(one.joints)] = one.columns[k]
            blocks.append(own)
        return np.concatenate(blocks, axis=2).swapaxes(0, 1)

    def marginal(
        self,
        setting: Setting,
        among: Sequence[int] | None = None,
        less: tuple[int, FloatArray, FloatArray] | None = None,
    ) -> Marginal:
        """Return the posterior under one setting; see `marginals`."""
        return self.marginals([setting], among, less)[0]

    def marginals(
        self,
        settings: Sequence[Setting],
        among: Sequence[int] | None = None,
        less: tuple[int, FloatArray, FloatArray] | None = None,
    ) -> list[Marginal]:
        """
        Integrate out the discrepancies d_k once, and fit the other parameters in each setting.

        Parameters
        ----------
        settings : sequence of Setting
            Amplitudes of discrepancy and noise, which differ in those of the priors alone.
        among : sequence of int, optional
            The recordings that are fitted; all by default.
        less : (int, ndarray, shape (S, q + a), ndarray, shape (S,)), optional
            A recording, with columns and residual of those of its rows that are left out.

        """
        fitted = list(range(len(self.columns)) if among is None else among)
        square, cross, count = self.square[fitted], self.cross[fitted], self.count[fitted].sum()
        scale, power = settings[0].precision, float(self.power[fitted].sum())
        if less is not None:
            k, x, y = less
            square[fitted.index(k)] -= x.T @ x
            cross[fitted.index(k)] -= x.T @ y
            count, power = count - len(y), power - float(y @ y)
        priors = [self.prior(one) for one in settings]
        used = priors[0][0]
        known = square.sum(axis=0)[np.ix_(used, used)] * scale
        vector = cross.sum(axis=0)[used] * scale
        loss, motion = 0.5 * power * scale, None
        normaliser = -float(count) / settings[0].lasting * np.log(settings[0].noise)
        if settings[0].own:
            place, functions = self.discrepancy, self.discrepancy.shape[1]
            size = settings[0].own * np.array(self.rows.amplitude)[fitted]
            precision = square[:, place[:, :, np.newaxis], place[:, np.newaxis, :]] * scale
            precision += np.eye(functions) * size[:, :, np.newaxis, np.newaxis] ** -2.0
            covariance = np.asarray(np.linalg.inv(precision))
            border = square[:, place.ravel()][:, :, used] * scale
            regressed = covariance @ border.reshape(*precision.shape[:3], -1)
            regressed = regressed.reshape(border.shape)
            aim = cross[:, place] * scale
            known -= border.reshape(-1, len(used)).T @ regressed.reshape(-1, len(used))
            vector -= aim.ravel() @ regressed.reshape(-1, len(used))
            loss -= 0.5 * float(np.einsum('kjf,kjfg,kjg->', aim, covariance, aim))
            normaliser -= 0.5 * float(np.linalg.slogdet(precision)[1].sum())
            normaliser -= functions * float(np.log(size).sum())
            motion = MotionDiscrepancy(covariance, aim, regressed)
        found = []
        for setting, (_, prior) in zip(settings, priors, strict=True):
            lower = np.asarray(np.linalg.cholesky(prior + known))
            values = linalg.cho_solve((lower, True), vector)
            left = loss - 0.5 * float(vector @ values)
            evidence = 0.5 * float(np.linalg.slogdet(prior)[1]) + setting.prior + normaliser - left
            evidence -= float(np.sum(np.log(np.diag(lower))))
            found.append(Marginal(setting, used, lower, values, evidence, left, motion))
        return found

    def whole(self, under: Marginal) -> tuple[FloatArray, FloatArray]:
        """Return means and covariance of all parameters; zero for those that are not fitted."""
        size = self.cross.shape[1]
        covariance = np.zeros((size, size))
        covariance[np.ix_(under.used, under.used)] = under.root.T @ under.root
        return self.means(under), covariance

    def means(self, under: Marginal) -> FloatArray:
        """Return the means of all parameters under a setting; zero where not fitted."""
        values = np.zeros(self.cross.shape[1])
        values[under.used] = under.values
        return values

    def residual_at(self, values: FloatArray, k: int) -> FloatArray:
        """Return the weighted residual of a recording, which includes d_k, (n, M)."""
        columns = self.columns[k]
        residual = self.residual[k] - columns @ values[: columns.shape[2]]
        for one, span in zip(self.accepted, self.spans, strict=True):
            if one.acts(self.rows.today)[k]:
                residual[list(one.joints)] -= one.columns[k] @ values[span]
        return residual

    def squares_of_today(self, under: Marginal) -> float:
        """Return the sum of squares of the weighted residual of the diagnosed day."""
        values, today = self.means(under), np.flatnonzero(self.rows.today).tolist()
        return float(sum(np.sum(self.residual_at(values, k) ** 2) for k in today))

    def noise_at(self, values: FloatArray, setting: Setting, k: int) -> FloatArray:
        """Return the weighted residual of a recording minus its fitted d_k, (n, M)."""
        residual = self.residual_at(values, k)
        if not setting.own:
            return residual
        size = setting.own * self.rows.amplitude[k]
        for joint, place in enumerate(self.discrepancy):
            functions = self.columns[k][joint][:, place]
            precision = setting.precision * functions.T @ functions
            precision += np.eye(len(place)) * size[joint] ** -2.0
            aim = setting.precision * functions.T @ residual[joint]
            residual[joint] -= functions @ np.linalg.solve(precision, aim)
        return residual

    def lasting(self, under: Marginal, recordings: Sequence[int], least: float) -> float:
        """
        Return for how many rows the residual is correlated, the median over joints [rows].

        It is the sum of the correlations at all lags, up to the first one below 0.05.

        """
        lengths = []
        values = self.means(under)
        for k in recordings:
            for x in self.noise_at(values, under.setting, k):
                x = x[np.abs(x) > 0.0]
                if len(x) >= 60:  # three times the largest lag
                    correlation = np.array([x[lag:] @ x[:-lag] for lag in range(1, 20)]) / (x @ x)
                    below = correlation < 0.05
                    count = int(np.argmax(below)) if below.any() else len(correlation)
                    lengths.append(1.0 + 2.0 * float(correlation[:count].sum()))
        return max(float(np.median(lengths)) if lengths else least, 1.0)
