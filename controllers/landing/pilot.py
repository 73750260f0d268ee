"""The landing station's pilot: percepts and proprioception in, actuator commands out, no hidden state."""

from __future__ import annotations

import math

import numpy as np

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.autopilot import Autopilot, AutopilotSetpoint
from auvdock.controllers.landing.belief import BeliefReader
from auvdock.controllers.landing.config import LandingControlCfg
from auvdock.controllers.landing.guidance import Flat, Place, corridor_m, station_keeping
from auvdock.controllers.landing.modes import ABORT, DESCEND, DOCKED, SEARCH, TOUCHDOWN, LandingFacts, next_landing_mode
from auvdock.controllers.landing.state import LandingState
from auvdock.controllers.landing.steering import Demand, Situation, demand
from auvdock.core.camera import Camera
from auvdock.core.contracts import Bearing, Command, Percept, Proprioception
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.estimation.senses import Senses, read_senses

__all__ = ["LandingPilot"]

_SINKING_M_S = 0.03
"""A demand for a slower descent than this does not count as sinking."""


class LandingPilot:
    """Pilot of paper C's docking: above the station, down along its vertical, into the guides; see `modes`.

    It steers four degrees of freedom, ξ, η, ζ and ψ; roll and pitch are kept level. It knows at which pose the vehicle
    is seated from the vehicle's seat (the axis of hull or keel) and the height of the guides' seat above the platform.
    """

    def __init__(
        self, cfg: LandingControlCfg, vehicle: VehicleCfg, station: LandingStationCfg, camera: Camera, dt_s: float
    ) -> None:
        """Derive gains and precompute geometry.

        Args:
            cfg: settings.
            vehicle: what is published of the vehicle.
            station: what the vehicle has been told of the station; its depth is on the chart.
            camera: the belly camera with its mounting.
            dt_s: control period.

        Raises:
            ConfigError: the loops cannot reach their margins.
        """
        self.cfg = cfg
        self.autopilot = Autopilot(vehicle, cfg.autopilot, dt_s)
        self.allocator = ThrustAllocator(vehicle, cfg.allocation)
        self._dt_s = dt_s
        self._reader = BeliefReader(vehicle, station, camera, cfg.position_walk_m_rs, dt_s)
        self._R_body_camera = np.ascontiguousarray(camera.T_body_camera[:3, :3])
        self._seat_up_m = float(vehicle.seat_body_m[2])
        self._camera_up_m = float(camera.T_body_camera[2, 3])
        self._seat_height_m = station.guide.seat_height_m
        self._platform_depth_m = station.depth_m
        self._idle = np.zeros(len(vehicle.actuators))

    def initial_state(self) -> LandingState:
        """Searching, with nothing known."""
        return LandingState(
            mode=SEARCH,
            since_s=None,
            attempts=1,
            giving_up=False,
            belief=None,
            lost=False,
            autopilot=self.autopilot.initial_state(),
            track_m=(0.0, 0.0),
            spot_m=None,
            sights=0,
            sight_s=-math.inf,
            integral_m_s=(0.0, 0.0),
            anchor_m=(0.0, 0.0),
            anchor_height_m=0.0,
            anchor_rad=0.0,
            inside_s=None,
            best_m=math.inf,
            best_s=0.0,
        )

    def step(
        self, state: LandingState, percept: Percept | None, proprioception: Proprioception
    ) -> tuple[Command, LandingState]:
        """One control period: estimate, judge the mode, steer, allocate; `percept` should be a `LandingPercept`."""
        senses = read_senses(proprioception)
        if state.since_s is None:
            height = self._height_by_pressure(senses)
            state = state._replace(since_s=senses.time_s, anchor_height_m=height, anchor_rad=senses.yaw_rad)
        before = state.belief
        state = self._look(self._reckon(state, percept, senses), percept, senses)
        belief = state.belief
        place = belief.place if belief is not None else None
        height = place.height_m if place is not None else self._height_by_pressure(senses)
        jumped = before is not None and belief is not None and belief.restarts > before.restarts
        facts = self._facts(state, height, senses, jumped)
        mode = next_landing_mode(state.mode, facts, self.cfg.modes)
        if mode != state.mode:
            state = self._enter(state, mode, height, senses)
        if mode == DOCKED:
            return Command(self._idle.copy(), mode=mode), state
        now = self._situation(state, place, height, senses)
        wanted = demand(now, self.cfg.guidance, self.cfg.modes, self.cfg.search)
        state = self._progress(state, place, height, wanted, senses.time_s)
        clear = height > self.cfg.modes.standoff_m - 0.1 or now.in_mode_s > self.cfg.modes.abort_timeout_s
        return self._act(state, wanted, place, senses, state.giving_up and mode == ABORT and clear)

    def _reckon(self, state: LandingState, percept: Percept | None, senses: Senses) -> LandingState:
        """The belief of this period, and dead reckoning of the way flown."""
        east, north, _ = senses.level(senses.yaw_rad, senses.ground_m_s)
        track = state.track_m[0] + east * self._dt_s, state.track_m[1] + north * self._dt_s
        # A perception that does not say how it fares is not lost: the age of its last pose decides alone.
        lost = percept.status == "lost" if isinstance(percept, LandingPercept) else percept is None and state.lost
        return state._replace(belief=self._reader.advance(state.belief, percept, senses), track_m=track, lost=lost)

    def _look(self, state: LandingState, percept: Percept | None, senses: Senses) -> LandingState:
        """Remember where the station is: from the belief, or from the direction to its lights."""
        bearing = percept.long_range if percept is not None else None
        if percept is not None:
            state = state._replace(sights=state.sights + 1 if bearing is not None else 0)
        if bearing is not None:
            state = state._replace(sight_s=senses.time_s)
        belief = state.belief
        if belief is not None and belief.fixes >= self.cfg.modes.confirm_fixes:
            dx, dy = _turned((-belief.place.ahead_m, -belief.place.port_m), belief.axis_yaw_rad)
            return state._replace(spot_m=(state.track_m[0] + dx, state.track_m[1] + dy))
        spot = self._below(bearing, senses) if bearing is not None else None
        if spot is None:
            return state
        seen = state.track_m[0] + spot[0], state.track_m[1] + spot[1]
        last = state.spot_m
        if last is not None:
            seen = last[0] + 0.2 * (seen[0] - last[0]), last[1] + 0.2 * (seen[1] - last[1])
        return state._replace(spot_m=seen)

    def _below(self, bearing: Bearing, senses: Senses) -> Flat | None:
        """Where a ray from the camera meets the platform's depth, relative to the vehicle, compass axes."""
        east, north, up = senses.level_ray(senses.yaw_rad, self._R_body_camera, bearing.ray_camera)
        if not math.isfinite(east + north + up):
            return None
        height = self._platform_depth_m - senses.depth_m + self._camera_up_m
        if up > -0.3 or height < 0.1:
            return None
        return -east / up * height, -north / up * height

    def _height_by_pressure(self, senses: Senses) -> float:
        """Height of the seat above its place from the pressure gauge and the station's charted depth."""
        return self._platform_depth_m - self._seat_height_m - senses.depth_m + self._seat_up_m

    def _facts(self, state: LandingState, height_m: float, senses: Senses, jumped: bool) -> LandingFacts:
        now, belief = senses.time_s, state.belief
        place = belief.place if belief is not None else None
        return LandingFacts(
            latched=senses.latched,
            fixes=belief.fixes if belief is not None else 0,
            since_fix_s=belief.since_fix_s if belief is not None else math.inf,
            lost=state.lost,
            jumped=jumped,
            sigma_m=math.sqrt(belief.variance_m2) if belief is not None else math.inf,
            height_m=height_m,
            offset_m=place.offset_m if place is not None else math.inf,
            heading_error_rad=abs(place.heading_rad) if place is not None else math.inf,
            allowed_m=corridor_m(height_m, self.cfg.guidance),
            sights=state.sights,
            since_sight_s=now - state.sight_s,
            in_mode_s=now - (state.since_s or 0.0),
            inside_s=now - state.inside_s if state.inside_s is not None else 0.0,
            stalled_s=now - state.best_s if math.isfinite(state.best_m) else 0.0,
            giving_up=state.giving_up,
        )

    def _enter(self, state: LandingState, mode: str, height_m: float, senses: Senses) -> LandingState:
        """Book-keeping at a change of mode."""
        attempts, giving_up = state.attempts, state.giving_up
        if mode == ABORT:
            giving_up = attempts >= self.cfg.modes.max_attempts or state.mode == SEARCH
            attempts = min(attempts + 1, self.cfg.modes.max_attempts)
        return state._replace(
            mode=mode,
            since_s=senses.time_s,
            attempts=attempts,
            giving_up=giving_up,
            anchor_m=state.track_m,
            anchor_height_m=height_m,
            anchor_rad=senses.yaw_rad,
            inside_s=None,
            best_m=math.inf,
            best_s=senses.time_s,
        )

    def _situation(self, state: LandingState, place: Place | None, height_m: float, senses: Senses) -> Situation:
        belief, track, spot = state.belief, state.track_m, state.spot_m
        return Situation(
            mode=state.mode,
            place=place,
            height_m=height_m,
            to_station_m=(spot[0] - track[0], spot[1] - track[1]) if spot is not None else None,
            from_anchor_m=(track[0] - state.anchor_m[0], track[1] - state.anchor_m[1]),
            anchor_height_m=state.anchor_height_m,
            anchor_rad=state.anchor_rad,
            axis_yaw_rad=belief.axis_yaw_rad if belief is not None else None,
            since_fix_s=belief.since_fix_s if belief is not None else math.inf,
            lost=state.lost,
            in_mode_s=senses.time_s - (state.since_s or 0.0),
        )

    def _progress(
        self, state: LandingState, place: Place | None, height_m: float, wanted: Demand, now_s: float
    ) -> LandingState:
        """Note how long the vehicle has been inside the corridor, and how long it has sunk without getting lower."""
        modes = self.cfg.modes
        inside = (
            place is not None
            and place.offset_m <= corridor_m(height_m, self.cfg.guidance)
            and abs(place.heading_rad) <= math.radians(modes.max_heading_deg)
        )
        inside_s = (state.inside_s if state.inside_s is not None else now_s) if inside else None
        best_m, best_s = state.best_m, state.best_s
        sinking = state.mode in (DESCEND, TOUCHDOWN) and wanted.heave_m_s < -_SINKING_M_S
        if not sinking:
            best_m, best_s = math.inf, now_s
        elif height_m < best_m - modes.progress_m:
            best_m, best_s = height_m, now_s
        return state._replace(inside_s=inside_s, best_m=best_m, best_s=best_s)

    def _act(
        self, state: LandingState, wanted: Demand, place: Place | None, senses: Senses, giving_up: bool
    ) -> tuple[Command, LandingState]:
        """Station keeping, autopilot, allocation, and the log entry."""
        (vx, vy), integral = station_keeping(
            wanted.error_m, state.integral_m_s, wanted.max_speed_m_s, self.cfg.guidance, self._dt_s
        )
        ahead, port = _turned((vx, vy), -senses.yaw_rad)
        point = AutopilotSetpoint(ahead, port, wanted.heave_m_s, 0.0, wanted.heading_rad)
        wrench, loops = self.autopilot.advance(state.autopilot, point, senses)
        values, achieved = self.allocator.solve(wrench, senses.surge_water_m_s, moments_first=True)
        loops = self.autopilot.settle(loops, wrench, achieved)
        log = {
            "surge_m_s": ahead,
            "sway_m_s": port,
            "heave_m_s": wanted.heave_m_s,
            "heading_rad": math.remainder(wanted.heading_rad, math.tau),
        }
        if place is not None:
            log["xi_m"], log["eta_m"], log["zeta_m"] = place.ahead_m, place.port_m, place.height_m
            log["psi_rad"] = place.heading_rad
        state = state._replace(autopilot=loops, integral_m_s=integral if wanted.integrate else state.integral_m_s)
        return Command(values, mode=state.mode, setpoint=log, giving_up=giving_up), state


def _turned(flat: Flat, angle_rad: float) -> Flat:
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    return cosine * flat[0] - sine * flat[1], sine * flat[0] + cosine * flat[1]
