"""Watching paper B's beacon from one place: what the paper's method and ours make of the same frames."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from auvdock.core.beacons import BeaconCfg
from auvdock.core.camera import Camera, CameraCfg
from auvdock.core.contracts import Detections, Proprioception
from auvdock.core.rotating_beacon import BeaconClockCfg
from auvdock.core.transforms import make_transform
from auvdock.experiments.rotating_rig import DEPTH_M, FLUX_DISC_RAD, NETWORK_PX, PoolRig, network_stand_in
from auvdock.optics.imaging import ImagingCfg
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.sensing import BeaconSensor
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.station_clock import StationClock
from auvdock.optics.water import load_water
from auvdock.perception.rotating.algorithm_2 import ForwardDetection, PaperBCfg, PaperBForwardBeacon
from auvdock.perception.rotating.bound import PassSignal, mean_bound
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.forward_beacon import ForwardBeacon
from auvdock.perception.rotating.paper_b import azimuth_from_time_deg, deviation_angles_rad
from auvdock.perception.rotating.profile import beam_sigma_rad

__all__ = ["FALSE_LAMP", "SCENARIOS", "Place", "Scenario", "Watch", "watch"]

FALSE_LAMP = BeaconCfg("false", "long_range", (0.0, 3.0, 0.5), (1.0, 0.0, 0.0), 450.0, 3.0, 0.35, 120.0)
"""A steady blue lamp beside the beacon: 3 W and 120°, so that at 30 m it is on the image in every frame (ours)."""
ARC_DEG = 66.0
"""Frames with the beam farther than this from the camera are not rendered and hold no detection: the flash is not seen
beyond some 40° from 20 m on (`rotating_rig.flash_visibility`)."""
AREA_WEIGHT = 1.0 / 3.0
"""Weight of the area in algorithm 2, that of the shape being the rest: calibrated on the mean of paper B's table 5,
4.72°; the paper does not give it. With a half it would be 7.6°, with a quarter 3.0°, with roundness alone 2.3°."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Step of the frames' phase from one seed to the next: few videos then fill the time between two frames evenly, which
at the edge of sight decides whether a frame meets the flash. A place's first phase is random."""


@dataclass(frozen=True)
class Place:
    """A position of the paper's grid, by day or night."""

    x_m: float
    y_m: float
    day: bool


@dataclass(frozen=True)
class Scenario:
    """What spoils the sight.

    Attributes:
        name: in words.
        clock_offset_s: error of the vehicle's clock.
        drop_share: share of frames that are lost.
        lamps: steady lamps in the water.
    """

    name: str = "as it is"
    clock_offset_s: float = 0.0
    drop_share: float = 0.0
    lamps: tuple[BeaconCfg, ...] = ()


SCENARIOS = (
    Scenario(),
    Scenario("clock 50 ms late", clock_offset_s=0.05),
    Scenario("one frame in five lost", drop_share=0.2),
    Scenario("second, steady lamp", lamps=(FALSE_LAMP,)),
)


@dataclass(frozen=True)
class Watch:
    """Errors in degrees from one video.

    Attributes:
        place: where.
        seed: of noise and phase.
        ours_deg: azimuth errors of single passes.
        fused_deg: azimuth error of all passes together, None without any.
        paper_deg: azimuth errors of algorithm 2, `min_detections` as in `paper_min`.
        printed: passes for which algorithm 2 answers with the printed minimum of five.
        ours_deviation_deg: errors of the horizontal deviation angle.
        paper_deviation_deg: likewise by equation 6.
        run: detections per pass of algorithm 2.
        bound_deg: Cramér–Rao bound of single passes, None where it was not measured.
        passes: passes that there were to be seen: turns less the two that identify the beacon.
        turns: turns of the beacon.
    """

    place: Place
    seed: int
    ours_deg: tuple[float, ...]
    fused_deg: float | None
    paper_deg: tuple[float, ...]
    printed: int
    ours_deviation_deg: tuple[float, ...]
    paper_deviation_deg: tuple[float, ...]
    run: tuple[int, ...]
    bound_deg: float | None
    passes: int
    turns: int


@dataclass(frozen=True)
class _Look:
    """One frame: vehicle time, detections, and for the bound exposure time and background in electrons per pixel."""

    time_s: float
    detections: Detections
    exposure_s: float | None = None
    background_e: float = 0.0


def watch(
    place: Place,
    seed: int,
    turns: int = 5,
    fidelity: str = "pixels",
    scenario: Scenario | None = None,
    paper_min: int = 1,
) -> Watch:
    """Watch the beacon for some turns from a random phase, camera and beacon at rest.

    Both methods get the same detections, those of `rotating_rig.network_stand_in`, and both take a pass that was seen
    in a single frame: at the edge of sight there are no more. The clocks differ as `BeaconClockCfg` says, by 0.5 ms and
    less. The beacons fidelity has camera, detector and settings of docking at 640 pixels, more sensitive than the
    rig's. Its boxes do not follow the spot's size and form, which is what algorithm 2 goes by: it is left out there.

    Args:
        place: of the paper's grid.
        seed: of phase, clock and noise.
        turns: of the beacon.
        fidelity: "pixels" or "beacons".
        scenario: what spoils it.
        paper_min: least detections of algorithm 2.
    """
    scenario = scenario or Scenario()
    where = [round(10 * place.x_m) + 100, round(place.y_m), int(place.day)]
    streams = np.random.default_rng([seed, *where]).spawn(4)
    phase = (float(np.random.default_rng(where).random()) + seed * _GOLDEN) % 1.0
    rig = PoolRig(place.day, lamps=scenario.lamps)
    times = _times(rig, place, turns, phase, scenario, streams[0])
    looks = _pixels(rig, place, times, scenario, streams)
    camera = rig.camera
    if fidelity == "beacons":
        looks, camera = _beacons(rig, place, times, scenario, streams)
    cfg = ForwardBeaconCfg(min_frames=1) if fidelity == "pixels" else ForwardBeaconCfg()
    forward = ForwardBeacon(cfg, camera, rig.beacon)
    weights = PaperBCfg(area_weight=AREA_WEIGHT, shape_weight=1.0 - AREA_WEIGHT)
    paper, printed = (
        PaperBForwardBeacon(replace(weights, min_detections=n), camera.rate_hz)
        for n in (paper_min, weights.min_detections)
    )
    true_azimuth, true_deviation = rig.azimuth_rad(place.x_m, place.y_m), math.atan2(-place.x_m, place.y_m)
    ours: list[float] = []
    ours_deviation: list[float] = []
    answers: list[ForwardDetection] = []
    as_printed = 0
    bounds: list[float] = []
    brightest: _Look | None = None
    for look in looks:
        fix = forward.update(look.detections, _at_rest(look.time_s, streams[3]))
        if (answer := paper.update(look.detections, look.time_s)) is not None:
            answers.append(answer)
        as_printed += printed.update(look.detections, look.time_s) is not None
        brightest = _brighter(brightest, look)
        if fix is not None:
            ours.append(math.degrees(math.remainder(fix.azimuth_rad - true_azimuth, math.tau)))
            x, _, z = fix.bearing.ray_camera.tolist()
            ours_deviation.append(math.degrees(math.atan2(x, z) - true_deviation))
            if brightest is not None and brightest.exposure_s is not None:
                bounds.append(_bound_deg(rig, forward, brightest))
            brightest = None
    if (answer := paper.finish()) is not None:
        answers.append(answer)
    as_printed += printed.finish() is not None
    if fidelity == "beacons":
        answers, as_printed = [], 0
    by_paper = [_paper_errors(answer, rig, camera, true_azimuth, true_deviation) for answer in answers]
    estimate = forward.estimate
    fused = None if estimate is None else math.remainder(estimate.azimuth_rad - true_azimuth, math.tau)
    return Watch(
        place=place,
        seed=seed,
        ours_deg=tuple(ours),
        fused_deg=None if fused is None else math.degrees(fused),
        paper_deg=tuple(azimuth for azimuth, _ in by_paper),
        printed=as_printed,
        ours_deviation_deg=tuple(ours_deviation),
        paper_deviation_deg=tuple(deviation for _, deviation in by_paper),
        run=tuple(answer.detections for answer in answers),
        bound_deg=math.sqrt(float(np.mean(np.square(bounds)))) if bounds else None,
        passes=turns - 2,
        turns=turns,
    )


def _times(
    rig: PoolRig, place: Place, turns: int, phase: float, scenario: Scenario, rng: np.random.Generator
) -> list[float]:
    """Vehicle times of the frames that arrive: whole turns from a dark moment on, the frames at a phase of 0 to 1."""
    rate = rig.camera_cfg.rate_hz
    count = round(turns * rate / rig.beacon.rate_rev_s)
    start = rig.facing_s(place.x_m, place.y_m) + 0.5 / rig.beacon.rate_rev_s + phase / rate
    kept = rng.random(count) >= scenario.drop_share
    return (start + np.arange(count) / rate)[kept].tolist()


def _clock(scenario: Scenario, rng: np.random.Generator) -> StationClock:
    return StationClock(BeaconClockCfg(offset_s=scenario.clock_offset_s), rng)


def _pixels(
    rig: PoolRig, place: Place, times: list[float], scenario: Scenario, streams: list[np.random.Generator]
) -> Iterator[_Look]:
    detector = network_stand_in(rig.camera_cfg)
    clock, imager, pose = _clock(scenario, streams[1]), rig.imager, rig.pose(place.x_m, place.y_m)
    imager.reset(streams[2])
    facing_s = rig.facing_s(place.x_m, place.y_m)
    imager.take(pose, facing_s, facing_s)
    for time_s in times:
        station_s = clock.station_time_s(time_s)
        beam = math.remainder((station_s - facing_s) * rig.beacon.rate_rev_s * math.tau, math.tau)
        if abs(beam) > math.radians(ARC_DEG) and not scenario.lamps:
            yield _Look(time_s, Detections.empty())
            continue
        frame = imager.take(pose, time_s, station_s).frame
        level = float(np.median(frame.image[::8, ::8, 2]))
        background_e = float(frame.response.electrons(frame.gain)[round(level)])
        yield _Look(time_s, detector.detect(frame), frame.exposure_s, background_e)


def _beacons(
    rig: PoolRig, place: Place, times: list[float], scenario: Scenario, streams: list[np.random.Generator]
) -> tuple[Iterator[_Look], Camera]:
    """Detections without an image, for the network's own image size."""
    height_px = round(NETWORK_PX * rig.camera_cfg.height_px / rig.camera_cfg.width_px)
    small = PoolRig(place.day, camera=CameraCfg(NETWORK_PX, height_px), lamps=scenario.lamps)
    setup = OpticalSetup(
        small.camera,
        load_water("pool"),
        small.layout,
        make_transform(np.eye(3), np.array([0.0, 0.0, -DEPTH_M])),
        ImagingCfg(surfaces=False),
        NuisanceCfg(daylight="mild" if place.day else "none"),
        rig.beacon,
    )
    sensor = BeaconSensor(setup)
    sensor.reset(streams[2])
    clock, pose = _clock(scenario, streams[1]), rig.pose(place.x_m, place.y_m)
    facing_s = rig.facing_s(place.x_m, place.y_m)
    sensor.detect(pose, facing_s, facing_s)
    return (_Look(t, sensor.detect(pose, t, clock.station_time_s(t))) for t in times), small.camera


def _at_rest(time_s: float, rng: np.random.Generator) -> Proprioception:
    """The gantry's sensors: compass 0.2°, inclinometer 0.1°, gyroscopes 0.0005 rad/s, DVL 3 mm/s, as the vehicle's."""
    noise = rng.standard_normal(9) * np.repeat([0.0017, 0.0005, 0.003], 3)
    noise[2] *= 2.0
    euler = noise[:3] + np.array([0.0, 0.0, math.pi])
    return Proprioception(time_s, DEPTH_M, euler, noise[3:6], noise[6:], np.zeros(3))


def _paper_errors(
    answer: ForwardDetection, rig: PoolRig, camera: Camera, true_azimuth: float, true_deviation: float
) -> tuple[float, float]:
    """Errors of equations 5 and 6 in degrees."""
    initial = math.radians(azimuth_from_time_deg(answer.time_s, 0.0, rig.beacon.rate_rev_s))
    azimuth = initial + math.radians(rig.beacon.initial_azimuth_deg)
    deviation, _ = deviation_angles_rad(float(answer.centre_px[0]), float(answer.centre_px[1]), camera)
    return (
        math.degrees(math.remainder(azimuth - true_azimuth, math.tau)),
        math.degrees(deviation - true_deviation),
    )


def _brighter(best: _Look | None, look: _Look) -> _Look | None:
    if look.exposure_s is None or len(look.detections) == 0 or look.detections.flux is None:
        return best
    if best is None or best.detections.flux is None:
        return look
    return look if look.detections.flux.max() > best.detections.flux.max() else best


def _bound_deg(rig: PoolRig, forward: ForwardBeacon, look: _Look) -> float:
    """Bound for the last pass, from its own light and the background of its brightest frame."""
    last, exposure_s = forward.passes[-1], look.exposure_s or 0.0
    focal_px = float(rig.camera.matrix[0, 0])
    shrink = rig.camera_cfg.width_px / NETWORK_PX
    disc_px = math.pi * (FLUX_DISC_RAD * focal_px) ** 2
    read_e = ImagingCfg().read_noise_e
    signal = PassSignal(
        peak_e=last.amplitude * exposure_s * shrink**2,
        background_e=look.background_e * disc_px,
        read_variance_e2=disc_px * read_e**2,
        widening=last.widening,
    )
    beam = beam_sigma_rad(rig.beacon.divergence_deg)
    return math.degrees(mean_bound(signal, beam, rig.beacon.rate_rev_s, rig.camera_cfg.rate_hz).angle_rad)
