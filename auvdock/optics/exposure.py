"""Auto-exposure: a law on what the frames before showed, the same in both fidelities.

The level of light changes by 1e4 between 30 m and 2 m, and an array of lamps is useful only while its lights are
separate blobs. So the camera meters highlights: it steers the share of saturated samples, which is what the blobs of
light cover, to a wanted value. The law sees nothing but that share, counted in the image or predicted from the
radiometry.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from auvdock.core.camera import Camera
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.optics.settings import ExposureCfg

__all__ = ["AutoExposure", "frames_of_a_turn"]


_METERED_WITH_MEMORY = 0.5
_GREATEST_FALL = 4.0
_GREATEST_RISE = 2.0


class AutoExposure:
    """Exposure time and gain as a state.

    With s the saturated share and s* the wanted one, sensitivity (time × gain) changes per frame by (s* / s)^½, bounded
    by `max_step`, unless s lies within the dead band. Time is used first, then gain.

    A light that flashes by would be met at the sensitivity of the dark before it. With a memory the camera meters for
    the brightest of the frames in it, each share taken in proportion to sensitivity: it falls at once, by up to 4 a
    frame (ours: a pass takes some ten frames), and rises only as far as the last flash allows, by no more than 2 within
    the memory (a flash that saturates nothing does not tell how much brighter it may be).

    Attributes:
        exposure_s: exposure time of the next frame.
        gain: its analogue gain.
        sensitivity_s: exposure time × gain.
    """

    def __init__(self, cfg: ExposureCfg, memory_frames: int = 0) -> None:
        """Start at the initial exposure.

        Args:
            cfg: the law's settings.
            memory_frames: number of frames that are remembered; 0 meters the last one alone.
        """
        self._cfg = cfg
        self._memory: deque[tuple[float, float]] | None = None
        self.metered = 1.0
        """Share of the saturation level above which samples count: a half with a memory, so that a flash that comes
        somewhat brighter than the last still does not saturate."""
        if memory_frames > 0:
            self._memory = deque(maxlen=memory_frames)
            self.metered = _METERED_WITH_MEMORY
        self._choose(cfg.initial_s)
        self.settled = False

    def reset(self) -> None:
        """Forget the frames before; the next frame is the first."""
        self._choose(self._cfg.initial_s)
        self.settled = False
        if self._memory is not None:
            self._memory.clear()

    def settle(self, share_at: Callable[[float], float]) -> None:
        """Choose the first frame's exposure as if the camera had been looking at the scene for a while.

        Args:
            share_at: saturated share for a sensitivity in seconds; must not fall as that rises.
        """
        self.settled = True
        if not self._cfg.automatic:
            return
        low, high = self._cfg.min_s, self._cfg.max_s * self._cfg.max_gain
        for _ in range(24):
            middle = (low * high) ** 0.5
            if share_at(middle) < self._cfg.saturated_share:
                low = middle
            else:
                high = middle
        self._choose((low * high) ** 0.5)

    def update(self, saturated_share: float) -> None:
        """Take note of a frame; changes the exposure of the next."""
        if not self._cfg.automatic:
            return
        fall = self._cfg.max_step
        if self._memory is not None:
            self._memory.append((saturated_share, self.sensitivity_s))
            if saturated_share <= self._cfg.saturated_share:
                now_s = self.sensitivity_s
                saturated_share = max(share * now_s / then_s for share, then_s in self._memory)
                # What was too bright then has been dealt with then.
                saturated_share = min(saturated_share, self._cfg.saturated_share)
            fall = max(fall, _GREATEST_FALL)
        ratio = self._cfg.saturated_share / max(saturated_share, 1e-9)
        if 1.0 / (1.0 + self._cfg.dead_band) < ratio < 1.0 + self._cfg.dead_band:
            return
        step = min(max(ratio**0.5, 1.0 / fall), self._cfg.max_step)
        high = self._cfg.max_s * self._cfg.max_gain
        if self._memory is not None:
            high = min(high, _GREATEST_RISE * min(then_s for _, then_s in self._memory))
        self._choose(min(max(self.sensitivity_s * step, self._cfg.min_s), high))

    def _choose(self, sensitivity_s: float) -> None:
        """Share sensitivity out between time and gain."""
        cfg, self.sensitivity_s = self._cfg, sensitivity_s
        self.exposure_s = min(max(sensitivity_s, cfg.min_s), cfg.max_s)
        self.gain = min(max(sensitivity_s / cfg.max_s, 1.0), cfg.max_gain)


def frames_of_a_turn(camera: Camera, rotating: RotatingBeaconCfg | None) -> int:
    """Frames that a camera takes in a turn of a rotating beacon and a tenth of one; 0 without a beacon."""
    return 0 if rotating is None else math.ceil(1.1 * camera.rate_hz / rotating.rate_rev_s)
