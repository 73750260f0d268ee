"""The rotating beacon's pilot: finds it from any side, goes around to the front and hands over to the conical pilot."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from auvdock.controllers.axis_guidance import Place
from auvdock.controllers.modes import ABORT, ACQUIRE, DOCKED, FAR, MID, next_mode
from auvdock.controllers.pilot import ConicalPilot, ControlCfg, PilotState
from auvdock.controllers.rotating.modes import (
    APPROACH,
    CIRCLE,
    ROTATING_MODES,
    RotatingFacts,
    next_rotating_mode,
)
from auvdock.controllers.rotating.route import Leg, route
from auvdock.controllers.rotating.steering import look_around, steer_course
from auvdock.controllers.steering import Steering
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, AzimuthFix, Bearing, Command, Percept, Proprioception
from auvdock.core.station import ConicalStationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.estimation.beacon_filter import BeaconFilter, BeaconState, Sighting
from auvdock.estimation.senses import Senses, Vector, cross, read_senses

__all__ = ["RotatingPilot", "RotatingState"]

_TRAIL = 60
"""Control periods that are remembered, 2 s at 30 Hz: a fix tells of a moment that is past."""
_AGREE_RAD = 0.35
"""A pose whose axis differs more than this from the beacon's is none (ours)."""
_LAMP_RAD = 0.2
"""A fixed lamp that leads must be seen within this angle of the beacon's believed place (ours)."""


class Step(NamedTuple):
    """One entry of the trail: when, compass yaw, way over ground in compass axes, depth."""

    time_s: float
    yaw_rad: float
    x_m: float
    y_m: float
    depth_m: float


class Hunt(NamedTuple):
    """Progress of a search.

    Attributes:
        clock_s: time spent turning; it stands still during a hold.
        hold_s: when the present hold began, None without one.
        hold_rad: compass bearing of the light that is being watched.
        free_s: no new hold before the clock shows this.
    """

    clock_s: float = 0.0
    hold_s: float | None = None
    hold_rad: float = 0.0
    free_s: float = 0.0


class RotatingState(NamedTuple):
    """All that the pilot remembers; immutable.

    Attributes:
        flight: the conical pilot's state; its mode is the pilot's mode, whichever half is in charge.
        beacon: where the rotating beacon is, None before the first fix.
        trail: the last control periods.
        side: chosen side of the way around, 0.0 before.
        look_s: when the present look for the beacon began, None on the way.
        missed: the last look has found nothing.
        believed: the present search began with a beacon believed somewhere.
        hunt: progress of the present search.
    """

    flight: PilotState
    beacon: BeaconState | None = None
    trail: tuple[Step, ...] = ()
    side: float = 0.0
    look_s: float | None = None
    missed: bool = False
    believed: bool = False
    hunt: Hunt = Hunt()

    @property
    def mode(self) -> str:
        """The pilot's mode."""
        return self.flight.mode


class RotatingPilot:
    """Pilot of paper B's docking; see `auvdock.controllers.rotating.modes` for the stages.

    On a station without a rotating beacon it searches with the same turns for the fixed lamps, which are then all that
    it has: the comparison.
    """

    def __init__(
        self, cfg: ControlCfg, vehicle: VehicleCfg, station: ConicalStationCfg, camera: Camera, dt_s: float
    ) -> None:
        """Derive gains and precompute geometry.

        Args:
            cfg: settings.
            vehicle: what is published of the vehicle.
            station: what the vehicle has been told of the station.
            camera: the bow camera with its mounting.
            dt_s: control period.

        Raises:
            ConfigError: the loops cannot reach their margins.
        """
        self.cfg = cfg
        self.conical = ConicalPilot(cfg, vehicle, station, camera, dt_s)
        lever = camera.T_body_camera[:3, 3]
        self._lever: Vector = (float(lever[0]), float(lever[1]), float(lever[2]))
        self._beacon = station.rotating
        self._beacon_m = station.rotating.position_m if station.rotating is not None else (0.0, 0.0, 0.0)
        self._filter = BeaconFilter(cfg.rotating.filter, dt_s)
        self._camera = camera
        self._dt_s = dt_s

    def initial_state(self) -> RotatingState:
        """Searching, with nothing known."""
        return RotatingState(self.conical.initial_state())

    def step(
        self, state: RotatingState, percept: Percept | None, proprioception: Proprioception
    ) -> tuple[Command, RotatingState]:
        """One control period: estimate, judge the mode, steer, allocate."""
        senses = read_senses(proprioception)
        flight, place, facts = self.conical.observe(state.flight, percept, senses)
        state = self._reckon(state, senses)._replace(flight=flight)
        if percept is not None and percept.azimuth is not None and self._beacon is not None:
            state = self._sight(state, percept.azimuth, senses)
        mode = state.flight.mode
        if mode in ROTATING_MODES and not facts.latched:
            state, place = self._distrust(state, place, senses)
            wanted = next_rotating_mode(mode, self._facts(state, place, senses), self.cfg.rotating.modes)
        else:
            wanted = next_mode(mode, facts, self.cfg.modes)
            if wanted == FAR != mode and not self._trusts_lamp(state):
                wanted = ACQUIRE
            if mode != wanted and wanted == ACQUIRE:
                state = self._remember(state, place, senses)
        if wanted != mode:
            state = self._enter(state, wanted, place, senses)
        if wanted not in ROTATING_MODES:
            command, flight = self.conical.fly(state.flight, place, senses)
            return command, state._replace(flight=flight)
        if wanted == ACQUIRE:
            state = state._replace(hunt=self._watch(state, percept, senses))
        steering, state = self._steer(state, senses)
        command, flight = self.conical.act(state.flight, steering, place, senses)
        state = state._replace(flight=flight)
        return dataclasses.replace(command, setpoint=command.setpoint | self._believed(state)), state

    def _reckon(self, state: RotatingState, senses: Senses) -> RotatingState:
        """Dead reckoning of the camera in level compass axes."""
        spin = cross(senses.rate_rad_s, self._lever)
        ground = senses.ground_m_s
        body = (ground[0] + spin[0], ground[1] + spin[1], ground[2] + spin[2])
        east, north, _ = senses.level(senses.yaw_rad, body)
        last = state.trail[-1] if state.trail else Step(senses.time_s, senses.yaw_rad, 0.0, 0.0, senses.depth_m)
        now = Step(
            senses.time_s,
            senses.yaw_rad,
            last.x_m + east * self._dt_s,
            last.y_m + north * self._dt_s,
            senses.depth_m,
        )
        beacon = state.beacon
        if beacon is not None:
            beacon = self._filter.predict(beacon, (east, north), senses.ground_age_s)
        return state._replace(trail=(*state.trail[-_TRAIL:], now), beacon=beacon)

    def _sight(self, state: RotatingState, fix: AzimuthFix, senses: Senses) -> RotatingState:
        """Fuse a fix, which tells of where the vehicle was when the beam swept past."""
        then = min(state.trail, key=lambda step: abs(step.time_s - fix.time_s))
        now = state.trail[-1]
        bearing, elevation = self.conical.compass_direction(fix.bearing, senses._replace(yaw_rad=then.yaw_rad))
        sighting = Sighting(
            bearing,
            elevation,
            fix.azimuth_rad,
            fix.sigma_rad,
            then.depth_m,
            (now.x_m - then.x_m, now.y_m - then.y_m),
        )
        beacon = state.beacon
        beacon = self._filter.start(sighting) if beacon is None else self._filter.update(beacon, sighting)
        if beacon is not None and beacon.since_fix_s == 0.0:
            state = state._replace(missed=False, look_s=None)
        return state._replace(beacon=beacon)

    def _station_m(self, beacon: BeaconState) -> tuple[float, float]:
        """Camera in the station frame, x and y."""
        x, y = beacon.offset_m
        cosine, sine = math.cos(beacon.axis_yaw_rad), math.sin(beacon.axis_yaw_rad)
        return self._beacon_m[0] - (cosine * x + sine * y), self._beacon_m[1] - (-sine * x + cosine * y)

    def _distrust(
        self, state: RotatingState, place: Place | None, senses: Senses
    ) -> tuple[RotatingState, Place | None]:
        """Drop a relative state that began from a wrong pose: its axis contradicts the beacon's."""
        beacon, relative = state.beacon, state.flight.relative
        if relative is None or beacon is None or beacon.since_fix_s > self.cfg.rotating.modes.lost_s:
            return state, place
        turned = abs(math.remainder(relative.axis_yaw_rad - beacon.axis_yaw_rad, math.tau))
        stale = relative.since_fix_s > self.cfg.modes.pose_lost_s
        if turned > _AGREE_RAD or stale:
            return state._replace(flight=state.flight._replace(relative=None)), None
        return state, place

    def _facts(self, state: RotatingState, place: Place | None, senses: Senses) -> RotatingFacts:
        modes, flight, beacon = self.cfg.modes, state.flight, state.beacon
        relative, sight = flight.relative, flight.sight
        has_pose = (
            relative is not None
            and place is not None
            and relative.fixes >= modes.confirm_fixes
            and relative.since_fix_s <= modes.fresh_s
            and place.distance_m > 0.0
        )
        lamp = sight is not None and sight.frames >= self.cfg.rotating.modes.steady_sights
        lamp = lamp and self._trusts_lamp(state)
        in_mode_s = senses.time_s - (flight.stage.since_s or 0.0)
        if beacon is None:
            return RotatingFacts(has_beacon=self._beacon is not None, has_pose=has_pose, lamp=lamp, in_mode_s=in_mode_s)
        return RotatingFacts(
            has_beacon=self._beacon is not None,
            fixes=beacon.fixes,
            since_fix_s=beacon.since_fix_s,
            missed=state.missed,
            range_share=beacon.range_sigma_m / max(beacon.range_m, 1e-3) if flight.mode == APPROACH else 0.0,
            off_axis_rad=abs(beacon.azimuth_rad),
            cone_rad=self.cfg.rotating.route.cone_rad,
            ahead_m=self._station_m(beacon)[0] + 2.0 * beacon.range_sigma_m,
            has_pose=has_pose,
            lamp=lamp,
            in_mode_s=in_mode_s,
        )

    def _trusts_lamp(self, state: RotatingState) -> bool:
        """Whether the light that is seen lies where the beacon puts the station; without a beacon any light will do."""
        beacon, sight = state.beacon, state.flight.sight
        if beacon is None or sight is None or beacon.since_fix_s > self.cfg.rotating.modes.lost_s:
            return True
        return abs(math.remainder(sight.azimuth_rad - beacon.bearing_rad, math.tau)) < _LAMP_RAD

    def _remember(self, state: RotatingState, place: Place | None, senses: Senses) -> RotatingState:
        """The beacon's place by the array's last poses, for the search after the conical half has lost them."""
        relative = state.flight.relative
        if relative is None or place is None or self._beacon is None:
            return state
        bx, by = self._beacon_m[0] - relative.camera_m[0], self._beacon_m[1] - relative.camera_m[1]
        cosine, sine = math.cos(relative.axis_yaw_rad), math.sin(relative.axis_yaw_rad)
        offset = (cosine * bx - sine * by, sine * bx + cosine * by)
        depth = senses.depth_m + relative.camera_m[2] - self._beacon_m[2]
        sigma = max(0.3, relative.cross_track_sigma_m)
        return state._replace(beacon=self._filter.place(offset, relative.axis_yaw_rad, depth, sigma))

    def _enter(self, state: RotatingState, mode: str, place: Place | None, senses: Senses) -> RotatingState:
        """Book-keeping at a change of mode."""
        flight = self.conical.enter(state.flight, mode, place, senses)
        beacon = state.beacon
        if mode == ACQUIRE:
            anchor = beacon.bearing_rad if beacon is not None else senses.yaw_rad
            flight = flight._replace(stage=flight.stage._replace(anchor_rad=anchor))
            state = state._replace(believed=beacon is not None, hunt=Hunt())
        if mode in (FAR, MID, ABORT, DOCKED, ACQUIRE):
            state = state._replace(missed=False, look_s=None)
        return state._replace(flight=flight, beacon=beacon)

    def _steer(self, state: RotatingState, senses: Senses) -> tuple[Steering, RotatingState]:
        beacon, flight, cfg = state.beacon, state.flight, self.cfg.rotating
        if flight.mode == ACQUIRE or beacon is None:
            return self._search(state, senses), state
        current = flight.autopilot.current_m_s
        x, y = self._station_m(beacon)
        axis = beacon.axis_yaw_rad
        spread = min(1.0, beacon.range_sigma_m / max(beacon.range_m, 1.0))
        leg = route(x, y, state.side, cfg.route, caution_m=min(1.5 * spread, 0.6) * beacon.range_m)
        state = state._replace(side=leg.side)
        speed, depth = cfg.course.speed_m_s, beacon.beacon_depth_m + cfg.course.depth_below_beacon_m
        keep_in_view: float | None = beacon.bearing_rad
        if flight.mode == APPROACH:
            course = self._parallax_course(leg, beacon)
        elif flight.mode == CIRCLE:
            course = leg.course_rad + axis
            keep_in_view, state = self._look(state, beacon, senses)
            if keep_in_view is not None:
                speed = cfg.course.look_speed_m_s
        else:
            aim = max(cfg.course.lineup_least_m, cfg.course.lineup_share * abs(y))
            course = math.atan2(-y, -aim) + axis
            speed = min(speed, max(0.2, 0.12 * (x - cfg.modes.min_blind_m + 2.0)))
            depth = beacon.beacon_depth_m + self._beacon_m[2]
        if math.sqrt(beacon.depth_variance_m2) > 1.5:
            depth = flight.stage.anchor_depth_m
        steering = steer_course(course, keep_in_view, speed, depth, senses, current, self.conical.reach_m_s, cfg.course)
        return steering, state

    def _parallax_course(self, leg: Leg, beacon: BeaconState) -> float:
        """Compass course of the approach: across the line of sight, as the range shows only so, the beacon in view."""
        cfg = self.cfg.rotating.course
        off = math.remainder(leg.course_rad + beacon.axis_yaw_rad - beacon.bearing_rad, math.tau)
        off = leg.side * max(cfg.parallax_rad, min(cfg.view_rad, leg.side * off))
        return beacon.bearing_rad + off

    def _look(self, state: RotatingState, beacon: BeaconState, senses: Senses) -> tuple[float | None, RotatingState]:
        """On the way around: the beacon's bearing while the hull shall turn to it, None on the stride between looks."""
        cfg = self.cfg.rotating.course
        if state.look_s is None:
            if beacon.since_fix_s < cfg.max_blind_s:
                return None, state
            return beacon.bearing_rad, state._replace(look_s=senses.time_s)
        if senses.time_s - state.look_s > cfg.look_timeout_s:
            return beacon.bearing_rad, state._replace(look_s=None, missed=True)
        return beacon.bearing_rad, state

    def _search(self, state: RotatingState, senses: Senses) -> Steering:
        stage, beacon, cfg = state.flight.stage, state.beacon, self.cfg.rotating
        if beacon is not None and beacon.since_fix_s < cfg.modes.lineup_blind_s:
            # Found: wait for the next pass with the beacon in the middle of the image.
            return look_around(0.0, beacon.bearing_rad, senses.depth_m, 1.0, True, cfg.look)
        hunt = state.hunt
        if hunt.hold_s is not None:
            return look_around(0.0, hunt.hold_rad, stage.anchor_depth_m, 1.0, True, cfg.look)
        return look_around(hunt.clock_s, stage.anchor_rad, stage.anchor_depth_m, stage.side, state.believed, cfg.look)

    def _watch(self, state: RotatingState, percept: Percept | None, senses: Senses) -> Hunt:
        """Stop turning at the glimpse of a light: the next passes tell whether it is the beacon."""
        hunt, look = state.hunt, self.cfg.rotating.look
        if hunt.hold_s is not None:
            if senses.time_s - hunt.hold_s < look.hold_s:
                return hunt
            return hunt._replace(hold_s=None, free_s=hunt.clock_s + look.hold_gap_rad / look.turn_rate_rad_s)
        hunt = hunt._replace(clock_s=hunt.clock_s + self._dt_s)
        if percept is None or self._beacon is None or hunt.clock_s < hunt.free_s:
            return hunt
        seen = percept.detections
        blue = np.flatnonzero(seen.class_id == BLUE)
        if len(blue) == 0:
            return hunt
        best = int(blue[int(np.argmax(seen.score[blue]))])
        if float(seen.score[best]) < look.hold_score:
            return hunt
        x, y = self._camera.normalise(seen.centre_px[best : best + 1])[0].tolist()
        glimpse = Bearing(np.array([x, y, 1.0]), seen.centre_px[best], float(seen.score[best]))
        bearing, _ = self.conical.compass_direction(glimpse, senses)
        return hunt._replace(hold_s=senses.time_s, hold_rad=bearing) if math.isfinite(bearing) else hunt

    def _believed(self, state: RotatingState) -> dict[str, float]:
        """What is believed of the beacon, for the log."""
        beacon = state.beacon
        if beacon is None:
            return {}
        x, y = self._station_m(beacon)
        return {
            "station_x_m": x,
            "station_y_m": y,
            "range_sigma_m": beacon.range_sigma_m,
            "cross_sigma_m": beacon.cross_sigma_m,
            "azimuth_rad": beacon.azimuth_rad,
        }
