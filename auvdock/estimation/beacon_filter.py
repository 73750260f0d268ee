"""Where the rotating beacon is and which way its station faces: azimuth fixes fused with compass and DVL.

One sight of the beacon gives a direction and an azimuth, and no range. Range comes with the vehicle's own motion across
the line of sight. A bank of extended Kalman filters, each begun at another range, keeps the uncertainty honest until
then (Peach 1995, "Bearings-only tracking using a set of range-parameterised extended Kalman filters").

The state of each filter is (b_x, b_y, ψ_s): beacon relative to the camera in level compass axes, and compass yaw of the
station's x axis. In these axes dead reckoning is linear: b ← b − displacement over ground. A fix measures
β = atan2(b_y, b_x) and A = β + π − ψ_s. Each filter's arithmetic is filterpy's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, Positive
from auvdock.numeric.motion import stale_walk_m2_s

__all__ = ["BeaconFilter", "BeaconFilterCfg", "BeaconState", "Hypothesis", "Sighting"]

_POSE_SIGMA_RAD = 0.02
"""Standard deviation of the axis that the array's poses leave behind (ours)."""


@dataclass(frozen=True)
class BeaconFilterCfg(Checked):
    """Noise levels and ranges of the filter bank; all ours."""

    min_range_m: Positive = 6.0
    """Nearest range that a first sight may have."""
    max_range_m: Positive = 75.0
    """Farthest one."""
    hypotheses: Count = 7
    """Filters of the bank, at ranges in geometric progression."""
    bearing_floor_rad: Positive = 0.006
    """Standard deviation of a compass bearing to the beacon: compass noise, tilt, centre of a haloed spot."""
    azimuth_floor_rad: Positive = 0.008
    """Added to a fix's own standard deviation: errors of successive turns are alike."""
    position_walk_m_rs: Positive = 0.03
    """Dead reckoning: standard deviation of position after 1 s, growing with the square root of time."""
    heading_walk_rad_rs: Positive = 0.001
    """The same for the bearing of the station's axis."""
    elevation_floor_rad: Positive = 0.012
    """Standard deviation of the beacon's elevation: inclinometer bias, centre of a haloed spot."""
    depth_walk_m_rs: Positive = 0.01
    """Walk of the beacon's depth as the pressure gauge counts it."""
    gate: Positive = 18.4
    """Greatest squared Mahalanobis distance of an accepted fix: 99.99 % of χ² with 2 degrees of freedom."""
    restart_after: Count = 4
    """So many refused fixes in a row start the bank anew: the estimate, not the fixes, is then wrong."""
    finer: Positive = 0.4
    """Two refused fixes in a row are enough if they are so much finer than the finest that the bank rests on: a few
    dim frames at the edge of the beam make a coarse fix whose error is not random."""
    drop_weight: Positive = 1e-3
    """A hypothesis below this weight is dropped."""

    def __post_init__(self) -> None:
        """Refuse ranges out of order."""
        if self.min_range_m >= self.max_range_m:
            raise ConfigError("min_range_m", self.min_range_m, "less than max_range_m")


class Sighting(NamedTuple):
    """One azimuth fix in level compass axes, brought to the present.

    Attributes:
        bearing_rad: compass bearing of the beacon.
        elevation_rad: positive up.
        azimuth_rad: of the camera in the station frame about the beacon.
        sigma_rad: standard deviation of that.
        depth_m: depth of the camera at the time.
        moved_m: (2,) way over ground since that time, compass axes.
    """

    bearing_rad: float
    elevation_rad: float
    azimuth_rad: float
    sigma_rad: float
    depth_m: float
    moved_m: tuple[float, float] = (0.0, 0.0)


class Hypothesis(NamedTuple):
    """One filter of the bank.

    Attributes:
        weight: its probability.
        mean: (b_x, b_y, ψ_s).
        covariance: (3, 3); never written to.
    """

    weight: float
    mean: tuple[float, float, float]
    covariance: Array


class BeaconState(NamedTuple):
    """Estimate at one moment.

    Attributes:
        bank: hypotheses as of the last fix, their means dead-reckoned to the present by `moved_m`.
        moved_m: way over ground since the last fix, compass axes.
        since_fix_s: time since the last accepted fix.
        stale_m2: variance of the way since then for want of fresh velocities, along each axis.
        fixes: accepted since the bank began.
        refused: since the last accepted one.
        restarts: how often the bank began anew.
        beacon_depth_m: depth of the beacon.
        depth_variance_m2: its variance.
        range_sigma_m: standard deviation along the line of sight as of the last fix.
        cross_sigma_m: standard deviation across it.
        finest_rad: least standard deviation of the fixes that the bank rests on.
        mean_m: mean of the bank's places, as of the last fix.
        axis_yaw_rad: mean compass yaw of the station's x axis, in (-π, π].
    """

    bank: tuple[Hypothesis, ...]
    moved_m: tuple[float, float]
    since_fix_s: float
    fixes: int
    refused: int
    restarts: int
    beacon_depth_m: float
    depth_variance_m2: float
    range_sigma_m: float = math.inf
    cross_sigma_m: float = math.inf
    finest_rad: float = math.inf
    mean_m: tuple[float, float] = (0.0, 0.0)
    axis_yaw_rad: float = 0.0
    stale_m2: float = 0.0

    @property
    def offset_m(self) -> tuple[float, float]:
        """Mean of the beacon's place relative to the camera, compass axes."""
        return self.mean_m[0] - self.moved_m[0], self.mean_m[1] - self.moved_m[1]

    @property
    def range_m(self) -> float:
        """Horizontal distance to the mean place."""
        return math.hypot(*self.offset_m)

    @property
    def bearing_rad(self) -> float:
        """Compass bearing of the mean place."""
        x, y = self.offset_m
        return math.atan2(y, x)

    @property
    def azimuth_rad(self) -> float:
        """Azimuth of the camera in the station frame about the beacon, in (-π, π]."""
        return math.remainder(self.bearing_rad + math.pi - self.axis_yaw_rad, math.tau)

    @property
    def covariance(self) -> Array:
        """(3, 3) of (b_x, b_y, ψ_s) over the whole bank, as of the last fix."""
        mean = np.array([*self.mean_m, self.axis_yaw_rad])
        total = np.zeros((3, 3))
        for h in self.bank:
            gap = np.array(h.mean) - mean
            gap[2] = math.remainder(gap[2], math.tau)
            total += h.weight * (h.covariance + np.outer(gap, gap))
        return total


class BeaconFilter:
    """Start, predict and update as pure functions of `BeaconState`."""

    def __init__(self, cfg: BeaconFilterCfg, dt_s: float) -> None:
        """Lay out the bank.

        Args:
            cfg: noise levels.
            dt_s: control period.
        """
        self._cfg = cfg
        self._dt_s = dt_s
        ratio = (cfg.max_range_m / cfg.min_range_m) ** (1.0 / cfg.hypotheses)
        self._ranges = tuple(cfg.min_range_m * ratio ** (k + 0.5) for k in range(cfg.hypotheses))
        # Neighbours stand two standard deviations apart, so that their sum is even in ln(range).
        self._spread = 0.5 * math.log(ratio) * 1.2

    def start(self, sighting: Sighting, restarts: int = 0) -> BeaconState | None:
        """A bank from one sight, all ranges equally likely in ln(range); None if the sight is not finite."""
        if not all(math.isfinite(value) for value in sighting[:5]):
            return None
        cfg = self._cfg
        cosine, sine = math.cos(sighting.bearing_rad), math.sin(sighting.bearing_rad)
        along = np.array([cosine, sine, 0.0])
        across = np.array([-sine, cosine, 0.0])
        psi = math.remainder(sighting.bearing_rad + math.pi - sighting.azimuth_rad, math.tau)
        variance = sighting.sigma_rad**2 + cfg.azimuth_floor_rad**2
        bank: list[Hypothesis] = []
        for range_m in self._ranges:
            covariance = (self._spread * range_m) ** 2 * np.outer(along, along)
            # Bearing noise moves the place sideways and turns the axis with it.
            lean = range_m * across + np.array([0.0, 0.0, 1.0])
            covariance += cfg.bearing_floor_rad**2 * np.outer(lean, lean)
            covariance[2, 2] += variance
            mean = (
                range_m * cosine - sighting.moved_m[0],
                range_m * sine - sighting.moved_m[1],
                psi,
            )
            bank.append(Hypothesis(1.0 / len(self._ranges), mean, covariance))
        middle = sum(self._ranges) / len(self._ranges)
        depth = sighting.depth_m - middle * math.tan(sighting.elevation_rad)
        spread = 0.6 * middle * math.tan(sighting.elevation_rad)
        variance_m2 = spread**2 + (middle * cfg.elevation_floor_rad) ** 2
        state = BeaconState(tuple(bank), (0.0, 0.0), 0.0, 1, 0, restarts, depth, variance_m2)
        return _measured(state._replace(finest_rad=sighting.sigma_rad))

    def place(self, offset_m: tuple[float, float], axis_yaw_rad: float, depth_m: float, sigma_m: float) -> BeaconState:
        """A bank of one from a known place, as the array's poses give it; `sigma_m` is its standard deviation."""
        covariance = np.diag([sigma_m**2, sigma_m**2, _POSE_SIGMA_RAD**2])
        mean = (offset_m[0], offset_m[1], axis_yaw_rad)
        bank = (Hypothesis(1.0, mean, covariance),)
        state = BeaconState(bank, (0.0, 0.0), 0.0, 1, 0, 0, depth_m, sigma_m**2)
        return _measured(state._replace(finest_rad=_POSE_SIGMA_RAD))

    def predict(
        self, state: BeaconState, ground_compass_m_s: tuple[float, float], ground_age_s: float = 0.0
    ) -> BeaconState:
        """Dead reckoning over one control period with the velocity over ground in level compass axes, and its age."""
        x, y = state.moved_m
        moved = (x + ground_compass_m_s[0] * self._dt_s, y + ground_compass_m_s[1] * self._dt_s)
        stale_m2 = state.stale_m2 + stale_walk_m2_s(ground_age_s) * self._dt_s
        return state._replace(moved_m=moved, since_fix_s=state.since_fix_s + self._dt_s, stale_m2=stale_m2)

    def update(self, state: BeaconState, sighting: Sighting) -> BeaconState:
        """Fuse a fix, or refuse it as an outlier; after `restart_after` refusals in a row begin anew from it."""
        if not all(math.isfinite(value) for value in sighting[:5]):
            return state
        cfg = self._cfg
        since = state.since_fix_s
        walk = cfg.position_walk_m_rs**2 * since + state.stale_m2
        process = np.diag([walk, walk, cfg.heading_walk_rad_rs**2 * since])
        noise = np.diag([cfg.bearing_floor_rad**2, sighting.sigma_rad**2 + cfg.azimuth_floor_rad**2])
        # Place of the vehicle when the beam passed: `sighting.moved_m` of the way since the last fix came later.
        way = (state.moved_m[0] - sighting.moved_m[0], state.moved_m[1] - sighting.moved_m[1])
        updated: list[tuple[float, Hypothesis]] = []
        nearest = math.inf
        for h in state.bank:
            distance, log_chance, after = _update(h, way, process, noise, sighting)
            nearest = min(nearest, distance)
            updated.append((log_chance, after))
        if nearest > cfg.gate:
            enough = 2 if sighting.sigma_rad < cfg.finer * state.finest_rad else cfg.restart_after
            if state.refused + 1 >= enough:
                fresh = self.start(sighting, state.restarts + 1)
                if fresh is not None:
                    return fresh
            return state._replace(refused=state.refused + 1)
        top = max(log_chance for log_chance, _ in updated)
        chances = [h.weight * math.exp(max(log_chance - top, -700.0)) for log_chance, h in updated]
        total = sum(chances)
        kept = [(c / total, h) for c, (_, h) in zip(chances, updated, strict=True) if c / total >= cfg.drop_weight]
        total = sum(chance for chance, _ in kept)
        late = sighting.moved_m
        bank = tuple(
            Hypothesis(chance / total, (h.mean[0] - late[0], h.mean[1] - late[1], h.mean[2]), h.covariance)
            for chance, h in kept
        )
        after = state._replace(
            bank=bank,
            moved_m=(0.0, 0.0),
            since_fix_s=0.0,
            stale_m2=0.0,
            fixes=state.fixes + 1,
            refused=0,
            finest_rad=min(state.finest_rad, sighting.sigma_rad),
        )
        return self._depth(_measured(after), sighting, since)

    def _depth(self, state: BeaconState, sighting: Sighting, since_s: float) -> BeaconState:
        """Scalar Kalman update of the beacon's depth: z = depth − R tan(elevation)."""
        cfg = self._cfg
        range_m, slope = state.range_m, math.tan(max(-1.2, min(1.2, sighting.elevation_rad)))
        measured = sighting.depth_m - range_m * slope
        noise = (range_m * cfg.elevation_floor_rad) ** 2 + (state.range_sigma_m * slope) ** 2
        variance = state.depth_variance_m2 + cfg.depth_walk_m_rs**2 * since_s
        gain = variance / (variance + noise)
        return state._replace(
            beacon_depth_m=state.beacon_depth_m + gain * (measured - state.beacon_depth_m),
            depth_variance_m2=(1.0 - gain) * variance,
        )


def _measured(state: BeaconState) -> BeaconState:
    """The state with the bank's moments; worked out once a fix, since they are asked for in every control period."""
    first = state.bank[0].mean[2]
    turned = sum(h.weight * math.remainder(h.mean[2] - first, math.tau) for h in state.bank)
    state = state._replace(
        mean_m=(sum(h.weight * h.mean[0] for h in state.bank), sum(h.weight * h.mean[1] for h in state.bank)),
        axis_yaw_rad=math.remainder(first + turned, math.tau),
    )
    x, y = state.offset_m
    length = math.hypot(x, y)
    if length < 1e-6:
        return state._replace(range_sigma_m=math.inf, cross_sigma_m=math.inf)
    axes = np.array([[x, -y], [y, x]]) / length
    along, across = np.diag(axes.T @ state.covariance[:2, :2] @ axes).tolist()
    return state._replace(range_sigma_m=math.sqrt(max(along, 0.0)), cross_sigma_m=math.sqrt(max(across, 0.0)))


def _update(
    h: Hypothesis, way: tuple[float, float], process: Array, noise: Array, sighting: Sighting
) -> tuple[float, float, Hypothesis]:
    """One filter's squared Mahalanobis distance, log likelihood and posterior with its old weight."""
    kalman = ExtendedKalmanFilter(dim_x=3, dim_z=2)
    kalman.x = np.array([h.mean[0] - way[0], h.mean[1] - way[1], h.mean[2]])
    kalman.P, kalman.Q = h.covariance, process
    kalman.predict()
    # A bearing error enters the azimuth only through ψ_s: the two measurements are independent of each other.
    fix = np.array([sighting.bearing_rad, sighting.azimuth_rad])
    kalman.update(fix, _slopes, _angles, noise, residual=_turn)
    x, y, psi = kalman.x.tolist()
    distance = float(kalman.y @ kalman.SI @ kalman.y)
    # ln N(y; 0, S) but for a constant; filterpy's own goes through SciPy and costs as much as all the rest.
    log_chance = -0.5 * (distance + math.log(float(np.linalg.det(kalman.S))))
    return distance, log_chance, Hypothesis(h.weight, (x, y, math.remainder(psi, math.tau)), kalman.P)


def _angles(state: Array) -> Array:
    """(2,) bearing and azimuth of a state (3,)."""
    bearing = math.atan2(state[1], state[0])
    return np.array([bearing, bearing + math.pi - state[2]])


def _slopes(state: Array) -> Array:
    """(2, 3) ∂ `_angles` / ∂ state."""
    x, y, _ = state.tolist()
    square = max(x * x + y * y, 1.0)
    return np.array([[-y / square, x / square, 0.0], [-y / square, x / square, -1.0]])


def _turn(measured: Array, expected: Array) -> Array:
    """(2,) differences of angles, within ±π."""
    return np.array([math.remainder(a - b, math.tau) for a, b in zip(measured, expected, strict=True)])
