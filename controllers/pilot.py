"""The conical station's pilot: percepts and proprioception in, actuator commands out, no hidden state."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from auvdock.controllers.allocation import AllocationCfg, ThrustAllocator
from auvdock.controllers.autopilot import Autopilot, AutopilotCfg
from auvdock.controllers.axis_guidance import Place, axis_law, corridor_m
from auvdock.controllers.guidance import GuidanceCfg, sway_reach_m_s
from auvdock.controllers.modes import (
    ABORT,
    ACQUIRE,
    DOCKED,
    FAR,
    MID,
    NEAR,
    TERMINAL,
    Facts,
    ModeCfg,
    next_mode,
)
from auvdock.controllers.pilot_state import PilotState, Progress, Stage
from auvdock.controllers.rotating.config import RotatingControlCfg
from auvdock.controllers.steering import (
    SearchCfg,
    Sight,
    Steering,
    along_axis,
    back_off,
    search,
    search_pattern,
    towards_light,
    update_sight,
)
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import Bearing, Command, Percept, Proprioception
from auvdock.core.station import ConicalStationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.estimation.relative_state import FilterCfg, RelativeFilter, RelativeState
from auvdock.estimation.senses import Senses, Vector, read_senses

__all__ = ["ConicalPilot", "ControlCfg", "Pilot", "PilotState"]

S = TypeVar("S")


class Pilot(Protocol[S]):
    """Flies a vehicle. Pure: all that it remembers is in the state that it is handed and hands back."""

    def initial_state(self) -> S:
        """State before the first step."""
        ...

    def step(self, state: S, percept: Percept | None, proprioception: Proprioception) -> tuple[Command, S]:
        """One control period; `percept` is None when no new frame arrived."""
        ...


@dataclass(frozen=True)
class ControlCfg(Checked):
    """Everything that can be set about the pilot."""

    autopilot: AutopilotCfg = field(default_factory=AutopilotCfg)
    """Loops and their limits."""
    allocation: AllocationCfg = field(default_factory=AllocationCfg)
    """Wrench to actuators."""
    filter: FilterCfg = field(default_factory=FilterCfg)
    """Relative state."""
    guidance: GuidanceCfg = field(default_factory=GuidanceCfg)
    """Line of sight, speeds, corridor."""
    search: SearchCfg = field(default_factory=SearchCfg)
    """Looking around."""
    modes: ModeCfg = field(default_factory=ModeCfg)
    """Mode machine."""
    rotating: RotatingControlCfg = field(default_factory=RotatingControlCfg)
    """The way to the cone before the mouth, by a rotating beacon."""
    predicted_poses: bool = False
    """Also fuse poses that are predicted from tracks while lights are hidden (paper A, section 4.1), with their
    covariance, as if they were measured."""
    controller: str = "own"
    """"own", the station's pilot, or a pilot of yours as "package.module:Name" (`auvdock.controllers.named`)."""


class ConicalPilot:
    """Pilot of paper A's docking: far lamp, array pose, red lamps, tube; see `modes` for the stages."""

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
        self.autopilot = Autopilot(vehicle, cfg.autopilot, dt_s)
        self.allocator = ThrustAllocator(vehicle, cfg.allocation)
        self._R_body_camera = np.ascontiguousarray(camera.T_body_camera[:3, :3])
        lever = camera.T_body_camera[:3, 3]
        self._camera_to_nose: Vector = (vehicle.nose_x_m - float(lever[0]), -float(lever[1]), -float(lever[2]))
        layout = station.layout
        far = layout.indices("long_range")
        self._lamp_height_m = float(np.mean(layout.positions_m[list(far), 2])) if far else 0.0
        entrance = layout.indices("entrance")
        centre = layout.positions_m[list(entrance)].mean(axis=0) if entrance else np.array([-1.0, 0.0, 0.0])
        target: Vector = (float(centre[0]), float(centre[1]), float(centre[2]))
        self._filter = RelativeFilter(cfg.filter, camera.T_body_camera, dt_s, target_m=target)
        self._end_m = station.funnel.length_m + station.funnel.tube_length_m + 0.3
        self._has_entrance = bool(entrance)
        self.reach_m_s = sway_reach_m_s(vehicle, self.allocator, cfg.guidance.mid_speed_m_s, cfg.guidance.sway_share)
        self._law = axis_law(cfg.guidance, cfg.modes, station.funnel.length_m, self.reach_m_s, dt_s)
        self._pattern = search_pattern(cfg.search)
        self._idle = np.zeros(len(vehicle.actuators))

    def initial_state(self) -> PilotState:
        """Searching, with nothing known."""
        return PilotState(self.autopilot.initial_state())

    def step(
        self, state: PilotState, percept: Percept | None, proprioception: Proprioception
    ) -> tuple[Command, PilotState]:
        """One control period: estimate, judge the mode, steer, allocate."""
        senses = read_senses(proprioception)
        state, place, facts = self.observe(state, percept, senses)
        mode = next_mode(state.mode, facts, self.cfg.modes)
        if mode != state.mode:
            state = self.enter(state, mode, place, senses)
        return self.fly(state, place, senses)

    def observe(
        self, state: PilotState, percept: Percept | None, senses: Senses
    ) -> tuple[PilotState, Place | None, Facts]:
        """The first half of a control period: estimates and progress, and what the mode is judged by."""
        if state.stage.since_s is None:
            now_s, yaw_rad, depth_m = senses.time_s, senses.yaw_rad, senses.depth_m
            stage = state.stage._replace(since_s=now_s, anchor_rad=yaw_rad, anchor_depth_m=depth_m)
            state = state._replace(stage=stage, progress=Progress(best_s=now_s))
        before = state.relative
        relative = self._track(before, percept, senses)
        sight = self._look(state.sight, percept, senses)
        place = self.place(relative, senses) if relative is not None else None
        progress = self._progress(state, place, senses.time_s)
        state = PilotState(state.autopilot, relative, sight, state.stage, progress, state.line)
        jumped = relative is not None and before is not None and relative.restarts > before.restarts
        return state, place, self._facts(state, place, senses, jumped)

    def fly(self, state: PilotState, place: Place | None, senses: Senses) -> tuple[Command, PilotState]:
        """The second half: steer in the state's mode and command the actuators."""
        if state.mode == DOCKED:
            return Command(self._idle.copy(), mode=state.mode), state
        return self.act(state, self._steer(state, place, senses), place, senses)

    def _track(self, relative: RelativeState | None, percept: Percept | None, senses: Senses) -> RelativeState | None:
        """Relative state after this period."""
        pose = percept.pose if percept is not None else None
        if pose is not None and not (pose.measured or self.cfg.predicted_poses):
            pose = None
        if relative is None:
            return self._filter.start(pose, senses) if pose is not None else None
        entrance = percept.entrance if percept is not None and self._has_entrance else None
        return self._filter.advance(relative, senses, pose, entrance.ray_camera if entrance is not None else None)

    def _look(self, sight: Sight | None, percept: Percept | None, senses: Senses) -> Sight | None:
        """Last far light after this period; None percepts change nothing."""
        if percept is None:
            return sight
        bearing = percept.long_range
        if bearing is None:
            return sight._replace(frames=0) if sight is not None and sight.frames else sight
        azimuth, elevation = self.compass_direction(bearing, senses)
        if not math.isfinite(azimuth + elevation):
            return sight
        range_m = bearing.range_m if bearing.range_m is not None and math.isfinite(bearing.range_m) else None
        return update_sight(sight, senses.time_s, azimuth, elevation, range_m, self.cfg.guidance.sight_smoothing)

    def compass_direction(self, bearing: Bearing, senses: Senses) -> tuple[float, float]:
        """Compass azimuth, positive to port, and elevation of a bearing in rad."""
        east, north, up = senses.level_ray(senses.yaw_rad, self._R_body_camera, bearing.ray_camera)
        return math.atan2(north, east), math.atan2(up, math.hypot(east, north))

    def place(self, relative: RelativeState, senses: Senses) -> Place:
        """Where the nose is in approach axes."""
        (distance_m, y, up_m), axis_yaw_rad = relative.station_point(senses, self._camera_to_nose)
        # Flying in means looking along -x of the station: port is then -y.
        port_m = -y
        return Place(
            distance_m,
            port_m,
            up_m,
            axis_yaw_rad + math.pi,
            math.remainder(senses.yaw_rad - axis_yaw_rad - math.pi, math.tau),
            math.hypot(port_m, up_m),
        )

    def _progress(self, state: PilotState, place: Place | None, now_s: float) -> Progress:
        """Best distance, when it was reached, and since when the vehicle waits at the gate."""
        last = state.progress
        if place is None:
            return last
        best_m, best_s, gate_s = last
        modes, distance_m = self.cfg.modes, place.distance_m
        if distance_m < best_m - modes.progress_m:
            best_m, best_s = distance_m, now_s
        if state.mode != MID or distance_m > modes.gate_distance_m + 0.5:
            gate_s = None
        elif gate_s is None:
            gate_s = now_s
        return Progress(best_m, best_s, gate_s) if best_m != last.best_m or gate_s != last.gate_s else last

    def _facts(self, state: PilotState, place: Place | None, senses: Senses, jumped: bool) -> Facts:
        now, relative, sight, progress = senses.time_s, state.relative, state.sight, state.progress
        since_fix_s = distance_m = off_axis_m = allowed_m = heading_error_rad = sigma_m = since_sight_s = math.inf
        fixes = sights = 0
        range_m = None
        if relative is not None:
            fixes, since_fix_s, sigma_m = relative.fixes, relative.since_fix_s, relative.cross_track_sigma_m
        if place is not None:
            distance_m, off_axis_m = place.distance_m, place.off_axis_m
            allowed_m = corridor_m(distance_m, self._law)
            heading_error_rad = abs(place.offset_rad - state.line.offset_rad)
        if sight is not None:
            sights, since_sight_s = sight.frames, now - sight.time_s
            if since_sight_s < 1.0:
                range_m = sight.trusted_range_m(self.cfg.modes.min_blind_range_m)
        return Facts(
            latched=senses.latched,
            fixes=fixes,
            since_fix_s=since_fix_s,
            jumped=jumped,
            distance_m=distance_m,
            off_axis_m=off_axis_m,
            allowed_m=allowed_m,
            heading_error_rad=heading_error_rad,
            sigma_m=sigma_m,
            sights=sights,
            since_sight_s=since_sight_s,
            range_m=range_m,
            in_mode_s=now - (state.stage.since_s or 0.0),
            held_s=now - progress.gate_s if progress.gate_s is not None else 0.0,
            stalled_s=now - progress.best_s,
            missed=distance_m < -self._end_m,
            giving_up=state.stage.giving_up,
        )

    def enter(self, state: PilotState, mode: str, place: Place | None, senses: Senses) -> PilotState:
        """Book-keeping at a change of mode."""
        attempts, giving_up = state.stage.attempts, state.stage.giving_up
        if mode == ABORT:
            giving_up = attempts >= self.cfg.modes.max_attempts
            attempts = min(attempts + 1, self.cfg.modes.max_attempts)
        anchor = senses.yaw_rad
        if mode == ACQUIRE and place is not None:
            anchor = place.axis_yaw_rad + math.atan2(-place.port_m, max(place.distance_m, 0.1))
        elif mode == ACQUIRE and state.sight is not None:
            anchor = state.sight.azimuth_rad
        turn = math.remainder(anchor - senses.yaw_rad, math.tau)
        stage = Stage(
            mode=mode,
            since_s=senses.time_s,
            attempts=attempts,
            giving_up=giving_up,
            anchor_rad=anchor,
            anchor_depth_m=senses.depth_m,
            side=math.copysign(1.0, turn) if turn != 0.0 else state.stage.side,
        )
        progress = Progress(place.distance_m if place is not None else math.inf, senses.time_s)
        line = state.line if mode in (NEAR, TERMINAL) else state.line._replace(integrals=(0.0, 0.0))
        return state._replace(stage=stage, progress=progress, line=line)

    def _steer(self, state: PilotState, place: Place | None, senses: Senses) -> Steering:
        cfg, stage, mode = self.cfg, state.stage, state.mode
        current = state.autopilot.current_m_s
        in_mode_s = senses.time_s - (stage.since_s or 0.0)
        if mode == FAR and state.sight is not None:
            return towards_light(
                state.sight,
                self._lamp_height_m,
                senses,
                current,
                self.reach_m_s,
                cfg.modes.min_blind_range_m,
                cfg.guidance,
            )
        if mode in (MID, NEAR, TERMINAL) and place is not None and state.relative is not None:
            blind = state.relative.since_fix_s > 2.0 * cfg.modes.fresh_s
            at_gate = place.distance_m < cfg.modes.gate_distance_m
            return along_axis(
                place,
                state.line.integrals,
                mode == MID and (at_gate or (blind and place.distance_m < cfg.modes.commit_distance_m + 1.0)),
                mode != MID,
                cfg.guidance.lookahead_mid_m if mode == MID else cfg.guidance.lookahead_near_m,
                senses,
                current,
                self._law,
            )
        if mode == ABORT and place is not None:
            return back_off(place, senses, current, self.reach_m_s, cfg.guidance)
        hold = search(
            in_mode_s, stage.anchor_rad, stage.anchor_depth_m, stage.side, place is None, self._pattern, cfg.search
        )
        if mode == ABORT:
            point = hold.setpoint._replace(surge_m_s=-cfg.guidance.back_speed_m_s, heading_rad=stage.anchor_rad)
            return Steering(point)
        return hold

    def act(
        self, state: PilotState, steering: Steering, place: Place | None, senses: Senses
    ) -> tuple[Command, PilotState]:
        """Autopilot, allocation, and the log entry."""
        point = steering.setpoint
        wrench, loops = self.autopilot.advance(state.autopilot, point, senses)
        values, achieved = self.allocator.solve(wrench, senses.surge_water_m_s, moments_first=True)
        loops = self.autopilot.settle(loops, wrench, achieved)
        log = {
            "surge_m_s": point.surge_m_s,
            "sway_m_s": point.sway_m_s,
            "heave_m_s": point.heave_m_s,
            "pitch_rad": point.pitch_rad,
            "heading_rad": math.remainder(point.heading_rad, math.tau),
        }
        if point.depth_m is not None:
            log["depth_m"] = point.depth_m
        if place is not None:
            log["distance_m"], log["port_m"], log["up_m"] = place.distance_m, place.port_m, place.up_m
        after = PilotState(loops, state.relative, state.sight, state.stage, state.progress, steering.line)
        return Command(values, state.mode, log, state.stage.giving_up), after
