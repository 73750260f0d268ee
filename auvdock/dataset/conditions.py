"""What a scene is drawn as: a station and a camera; then, condition by condition, water, lamps, nuisances, range."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from auvdock.core.beacons import BeaconCfg
from auvdock.core.calibrated_camera import CalibratedCameraCfg, make_calibrated_camera
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.landing_station import LandingStationCfg, load_landing_station
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.station import ConicalStationCfg, FunnelCfg, load_conical_station
from auvdock.core.transforms import make_transform
from auvdock.core.vehicle import load_vehicle
from auvdock.dataset.config import DatasetCfg
from auvdock.dataset.known_camera import known
from auvdock.dataset.plan import SceneSpec
from auvdock.optics.faults import FaultCfg
from auvdock.optics.lamp import LampCfg
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.nuisance import LEVELS, PARTS, NuisanceCfg
from auvdock.optics.settings import ExposureCfg, ImagingCfg
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import load_water, with_attenuation
from auvdock.sim.docks import make_dock
from auvdock.sim.scene import build_model

__all__ = ["KINDS", "Condition", "Kind", "Stage", "draw_condition", "set_stage"]

Kind = Literal["array", "rotating_front", "rotating_side", "landing", "unlit_funnel", "unlit_platform"]
"""What a scene shows."""
KINDS: tuple[Kind, ...] = ("array", "rotating_front", "rotating_side", "landing", "unlit_funnel", "unlit_platform")
"""All of them; `unlit` is shared out evenly between its two."""

_STEP_S = 1.0 / 120.0
"""Of a model that is only looked at."""
_ROOM_FOR_SCATTERING = 0.8
"""Greatest share of c that absorption at 450 nm may have."""
_FORWARD, _UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Stage:
    """What stays in a scene.

    Attributes:
        kind: what it shows.
        station: geometry and lights before a condition changes their power.
        camera: the camera.
        model: the MuJoCo model whose station and floor are drawn.
        lights: number of lights that shine on the ring or platform.
    """

    kind: Kind
    station: ConicalStationCfg | LandingStationCfg
    camera: Camera
    model: Any
    lights: int

    @property
    def is_platform(self) -> bool:
        """A platform seen from above, not a funnel."""
        return isinstance(self.station, LandingStationCfg)


@dataclass(frozen=True, eq=False)
class Condition:
    """What a scene is seen in for some frames.

    Attributes:
        setup: all that the optics is made from; its sensor is free of noise, `imaging` is not.
        imaging: the camera as an instrument.
        c_per_m: attenuation at 450 nm.
        band: borders of c · range.
    """

    setup: OpticalSetup
    imaging: ImagingCfg
    c_per_m: float
    band: tuple[float, float]


def set_stage(cfg: DatasetCfg, spec: SceneSpec, rng: np.random.Generator) -> Stage:
    """Draw station and camera."""
    shares = cfg.scenes
    weights = [shares.array, shares.rotating_front, shares.rotating_side, shares.landing]
    weights += [0.5 * shares.unlit] * 2
    kind = KINDS[_chosen(weights, spec.place[0])]
    depth_m = _log_uniform(shares.depth_m, rng)
    vehicle = load_vehicle("remus_hybrid")
    if kind in ("landing", "unlit_platform"):
        platform = dataclasses.replace(load_landing_station(), depth_m=max(depth_m, cfg.range.most_height_m + 1.0))
        model = build_model(vehicle, make_dock(platform, vehicle), _STEP_S)
        return Stage(kind, platform, _belly(rng), model, len(platform.beacons))
    count = cfg.lights.counts[int(spec.place[1] * len(cfg.lights.counts))]
    station = _funnel(cfg, depth_m, count, rng)
    if kind in ("rotating_front", "rotating_side"):
        station = dataclasses.replace(station, rotating=RotatingBeaconCfg())
    model = build_model(vehicle, make_dock(station, vehicle), _STEP_S)
    return Stage(kind, station, _bow(cfg, rng), model, count)


def draw_condition(cfg: DatasetCfg, spec: SceneSpec, stage: Stage, rng: np.random.Generator) -> Condition:
    """Draw water and range, lamps and what is wrong with them, nuisances, and the camera as an instrument."""
    c_per_m, band = _turbidity(cfg, spec, stage, rng)
    waters = [load_water(name) for name in cfg.water.names]
    fitting = [water for water in waters if water.absorption_per_m[0] <= _ROOM_FOR_SCATTERING * c_per_m]
    water = with_attenuation(fitting[int(rng.integers(len(fitting)))], c_per_m)
    station, dead = _lamps(cfg, stage, rng)
    nuisance = _nuisance(cfg, rng)
    imaging = _instrument(cfg, stage, rng)
    shone = float(rng.random())
    lamp_w = float(np.exp(rng.uniform(math.log(5.0), math.log(40.0))))
    share = 1.0 if stage.kind.startswith("unlit") else 0.8 if stage.is_platform else cfg.nuisance.lamp_share
    setup = OpticalSetup(
        camera=stage.camera,
        water=water,
        layout=station.layout,
        T_world_station=make_transform(np.eye(3), np.array([0.0, 0.0, -station.depth_m])),
        imaging=dataclasses.replace(imaging, noise=False),
        nuisance=nuisance,
        rotating=station.rotating if isinstance(station, ConicalStationCfg) else None,
        lamp=LampCfg(power_w=lamp_w) if shone < share else None,
        tag=station.tag if isinstance(station, LandingStationCfg) else None,
        faults=FaultCfg(dead_lights=dead),
        seen_from="above" if stage.is_platform else "front",
    )
    return Condition(setup, imaging, c_per_m, band)


def _turbidity(
    cfg: DatasetCfg, spec: SceneSpec, stage: Stage, rng: np.random.Generator
) -> tuple[float, tuple[float, float]]:
    """Attenuation c at 450 nm, and a band of c · range that this water has within reach."""
    reach, edges = cfg.range, cfg.range.edges
    most_m = reach.most_height_m if stage.is_platform else reach.most_m
    low_c, high_c = cfg.water.attenuation_per_m
    shares = reach.platform if stage.is_platform else reach.test if spec.split == "test" else reach.train
    at = _chosen(shares, float(rng.random()))
    low, high = edges[at], edges[at + 1]
    # Clear enough that some of the band lies farther than the nearest place, turbid enough that all lies within reach.
    least, most = max(low_c, high / most_m), min(high_c, 0.5 * high / reach.least_m)
    least, most = min(least, high_c), max(most, low_c)
    return _log_uniform((min(least, most), max(least, most)), rng), (low, high)


def _funnel(cfg: DatasetCfg, depth_m: float, count: int, rng: np.random.Generator) -> ConicalStationCfg:
    lights, preset = cfg.lights, load_conical_station()
    radius_m = float(rng.uniform(*lights.ring_radius_m))
    keep_far, keep_red = rng.random(2) < (lights.far_share, lights.red_share)
    beacons = tuple(
        _lifted(beacon, radius_m - preset.funnel.mouth_radius_m)
        for beacon in preset.beacons
        if (beacon.role == "long_range" and keep_far) or (beacon.role == "entrance" and keep_red)
    )
    return dataclasses.replace(
        preset,
        depth_m=depth_m,
        array_count=max(count, 4),
        funnel=FunnelCfg(mouth_radius_m=radius_m),
        beacons=beacons,
    )


def _lifted(beacon: BeaconCfg, up_m: float) -> BeaconCfg:
    """The far lamp stays as far above a wider or narrower mouth; entrance lamps stay at the throat."""
    if beacon.role != "long_range":
        return beacon
    x, y, z = beacon.position_m
    return dataclasses.replace(beacon, position_m=(x, y, z + up_m))


def _lamps(
    cfg: DatasetCfg, stage: Stage, rng: np.random.Generator
) -> tuple[ConicalStationCfg | LandingStationCfg, tuple[str, ...]]:
    """The station with its lamps' powers and beams drawn, and the names of those that do not shine."""
    lights, station = cfg.lights, stage.station
    power_w = _log_uniform(lights.power_w, rng)
    beam_deg = float(rng.uniform(*lights.beam_angle_deg))
    gain = power_w / 10.0
    beacons = tuple(dataclasses.replace(beacon, power_w=beacon.power_w * gain) for beacon in station.beacons)
    if isinstance(station, LandingStationCfg):
        beacons = tuple(dataclasses.replace(beacon, beam_angle_deg=max(beam_deg, 60.0)) for beacon in beacons)
        lit = dataclasses.replace(station, beacons=beacons)
        names = [beacon.name for beacon in beacons]
        spare: list[str] = []
    else:
        lit = dataclasses.replace(station, beacons=beacons, array_power_w=power_w, array_beam_angle_deg=beam_deg)
        names = [beacon.name for beacon in lit.layout.beacons]
        # A ring has at least four lamps; of fewer lights the others are dead.
        spare = names[: max(4 - stage.lights, 0)]
    broken = rng.random(len(names)) < lights.dead_share
    if stage.kind.startswith("unlit"):
        return lit, tuple(names)
    return lit, tuple(name for name, is_broken in zip(names, broken, strict=True) if is_broken or name in spare)


def _nuisance(cfg: DatasetCfg, rng: np.random.Generator) -> NuisanceCfg:
    weights = [getattr(cfg.nuisance, level) for level in LEVELS]
    levels = {part: LEVELS[_chosen(weights, float(rng.random()))] for part in PARTS}
    return dataclasses.replace(NuisanceCfg(), **levels)


def _instrument(cfg: DatasetCfg, stage: Stage, rng: np.random.Generator) -> ImagingCfg:
    draw = cfg.camera
    base = landing_imaging() if stage.is_platform else ImagingCfg()
    wanted = base.exposure.saturated_share if stage.is_platform else _log_uniform(cfg.exposure.saturated_share, rng)
    exposure: ExposureCfg = dataclasses.replace(base.exposure, saturated_share=wanted)
    return dataclasses.replace(
        base,
        lens_sigma_px=float(rng.uniform(*draw.lens_sigma_px)),
        f_number=float(rng.uniform(*draw.f_number)),
        full_well_e=float(rng.uniform(*draw.full_well_e)),
        read_noise_e=float(rng.uniform(*draw.read_noise_e)),
        lamp_radius_m=float(rng.uniform(*draw.lamp_radius_m)),
        encoding="linear" if rng.random() < draw.linear_share else "sqrt",
        surfaces=cfg.nuisance.surfaces,
        exposure=exposure,
    )


def _bow(cfg: DatasetCfg, rng: np.random.Generator) -> Camera:
    """A camera at the body's origin that looks along x; its distortion follows from the two fields of view."""
    draw = cfg.camera
    wide_deg = float(rng.uniform(*draw.horizontal_fov_deg))
    pinhole_deg = 2.0 * math.degrees(math.atan(math.tan(math.radians(wide_deg) / 2.0) * draw.height_px / draw.width_px))
    high_deg = pinhole_deg * (1.0 + float(rng.uniform(-draw.distortion, draw.distortion)))
    camera = CameraCfg(draw.width_px, draw.height_px, horizontal_fov_deg=wide_deg, vertical_fov_deg=high_deg)
    return known(make_camera(camera, np.zeros(3), _FORWARD, _UP))


def _belly(rng: np.random.Generator) -> Camera:
    """The calibrated belly camera with another focal length."""
    preset = CalibratedCameraCfg()
    focal_m = preset.focal_length_m * float(rng.uniform(0.9, 1.1))
    camera = make_calibrated_camera(dataclasses.replace(preset, focal_length_m=focal_m), np.zeros(3), -_UP, _FORWARD)
    return known(camera)


def _chosen(weights: list[float] | tuple[float, ...], place: float) -> int:
    """Index by weight of a number in [0, 1)."""
    edges = np.cumsum(weights) / sum(weights)
    return min(int(np.searchsorted(edges, place, side="right")), len(weights) - 1)


def _log_uniform(span: tuple[float, float], rng: np.random.Generator) -> float:
    low, high = math.log(span[0]), math.log(span[1])
    return float(math.exp(rng.uniform(low, high)))
