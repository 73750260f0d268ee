"""The belly camera above a landing station, and what it is set to."""

from __future__ import annotations

from auvdock.core.arrays import Array
from auvdock.core.calibrated_camera import CalibratedCameraCfg
from auvdock.core.camera import Camera
from auvdock.core.landing_station import LandingStationCfg
from auvdock.optics.faults import FaultCfg
from auvdock.optics.imaging import HasModel, UnderwaterCamera
from auvdock.optics.lamp import LampCfg
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.settings import ExposureCfg, ImagingCfg
from auvdock.optics.water import WaterCfg

__all__ = ["LandingCamera", "landing_imaging"]


def landing_imaging(camera: CalibratedCameraCfg | None = None) -> ImagingCfg:
    """The belly camera as an instrument: the calibration's sensor, and an exposure under which the tag can be read.

    The lights are a thousand times brighter than what they light. At the bow camera's metering the platform would be
    black; here 1 % of the samples may saturate, which the lights' discs fill up near by. That share is ours.
    """
    sensor_m = (camera if camera is not None else CalibratedCameraCfg()).sensor_width_m
    return ImagingCfg(sensor_width_m=sensor_m, exposure=ExposureCfg(saturated_share=0.01, max_s=0.02))


class LandingCamera(UnderwaterCamera):
    """Renders the platform from above: lights and halos, tag, surfaces, the vehicle's lamps and their backscatter."""

    def __init__(
        self,
        camera: Camera,
        water: WaterCfg,
        station: LandingStationCfg,
        nuisance: NuisanceCfg,
        imaging: ImagingCfg,
        lamp: LampCfg | None,
        faults: FaultCfg,
        T_world_station: Array,
        scene: HasModel | None = None,
    ) -> None:
        """Precompute tables; no OpenGL context is made before a frame needs one.

        Args:
            camera: intrinsics, distortion and mounting.
            water: what lies between.
            station: the platform with its lights and its tag.
            nuisance: what makes the scene hard.
            imaging: the camera as an instrument; see `landing_imaging`.
            lamp: the vehicle's own lamps, None for none.
            faults: dead lights and a covered tag.
            T_world_station: (4, 4) pose of the station frame.
            scene: owner of the MuJoCo model whose static geoms are drawn; without it only lights and tag are.
        """
        super().__init__(
            camera,
            water,
            station.layout,
            nuisance,
            imaging,
            T_world_station,
            scene,
            seen_from="above",
            tag=station.tag,
            lamp=lamp,
            faults=faults,
        )
