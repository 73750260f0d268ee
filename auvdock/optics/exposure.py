"""Auto-exposure: a law on what the frames before showed, the same in both fidelities.

The level of light changes by 1e4 between 30 m and 2 m, and an array of lamps is useful only while its lights are
separate blobs. So the camera meters highlights: it steers the share of saturated samples, which is what the blobs of
light cover, to a wanted value. The law sees nothing but that share, counted in the image or predicted from the
radiometry.
"""

from __future__ import annotations

from collections.abc import Callable

from auvdock.optics.settings import ExposureCfg

__all__ = ["AutoExposure"]


class AutoExposure:
    """Exposure time and gain as a state.

    With s the saturated share and s* the wanted one, sensitivity (time × gain) changes per frame by (s* / s)^½, bounded
    by `max_step`, unless s lies within the dead band. Time is used first, then gain.
    """

    def __init__(self, cfg: ExposureCfg) -> None:
        """Start at the initial exposure."""
        self._cfg = cfg
        self._sensitivity_s = cfg.initial_s
        self.settled = False

    @property
    def exposure_s(self) -> float:
        """Exposure time of the next frame."""
        return min(max(self._sensitivity_s, self._cfg.min_s), self._cfg.max_s)

    @property
    def gain(self) -> float:
        """Analogue gain of the next frame."""
        return min(max(self._sensitivity_s / self._cfg.max_s, 1.0), self._cfg.max_gain)

    @property
    def sensitivity_s(self) -> float:
        """Exposure time × gain."""
        return self._sensitivity_s

    def reset(self) -> None:
        """Forget the frames before; the next frame is the first."""
        self._sensitivity_s = self._cfg.initial_s
        self.settled = False

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
        self._sensitivity_s = (low * high) ** 0.5

    def update(self, saturated_share: float) -> None:
        """Take note of a frame; changes the exposure of the next."""
        if not self._cfg.automatic:
            return
        ratio = self._cfg.saturated_share / max(saturated_share, 1e-9)
        if 1.0 / (1.0 + self._cfg.dead_band) < ratio < 1.0 + self._cfg.dead_band:
            return
        step = min(max(ratio**0.5, 1.0 / self._cfg.max_step), self._cfg.max_step)
        high = self._cfg.max_s * self._cfg.max_gain
        self._sensitivity_s = min(max(self._sensitivity_s * step, self._cfg.min_s), high)
