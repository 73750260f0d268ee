"""What the belly camera above a landing station is set to."""

from __future__ import annotations

from auvdock.core.calibrated_camera import CalibratedCameraCfg
from auvdock.optics.settings import ExposureCfg, ImagingCfg

__all__ = ["landing_imaging"]


def landing_imaging(camera: CalibratedCameraCfg | None = None) -> ImagingCfg:
    """The belly camera as an instrument: the calibration's sensor, and an exposure under which the tag can be read.

    The lights are a thousand times brighter than what they light. At the bow camera's metering the platform would be
    black; here 1 % of the samples may saturate, which the lights' discs fill up near by. That share is ours.
    """
    sensor_m = (camera if camera is not None else CalibratedCameraCfg()).sensor_width_m
    return ImagingCfg(sensor_width_m=sensor_m, exposure=ExposureCfg(saturated_share=0.01, max_s=0.02))
