"""The training of one network, step by step; kept in a file, it goes on as if it had never stopped."""

from __future__ import annotations

import copy
import os
import pickle
from pathlib import Path
from typing import Any, cast

import torch
from torch import Tensor, nn

from auvdock.core.errors import ConfigError
from auvdock.networks.config import NetworkCfg
from auvdock.networks.losses import Objects, losses
from auvdock.networks.network import Network
from auvdock.networks.schedule import ScheduleCfg, learning_rate
from auvdock.networks.targets import Batch

__all__ = ["PARTS", "Trainer"]

PARTS = ("box", "score", "distribution", "keypoint")
"""Parts of the loss that `Trainer.step` gives."""
_RAMP = 10.0


class Trainer:
    """Network, running mean of its weights, and AdamW, in fp32.

    On one machine with one thread the same batches give the same bits.
    """

    def __init__(self, network: NetworkCfg, schedule: ScheduleCfg, seed: int, device: str = "cpu") -> None:
        """Begin with weights at random.

        Args:
            network: what is trained.
            schedule: how.
            seed: of the first weights.
            device: "cpu" or "cuda".
        """
        torch.manual_seed(seed)
        self.schedule, self._device = schedule, device
        self.network = Network(network).to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.averaged = copy.deepcopy(self.network).eval().requires_grad_(False)
        """What is used afterwards: the running mean."""
        self.done = 0
        """Steps done."""
        decayed = [values for values in self.network.parameters() if values.ndim > 1]
        others = [values for values in self.network.parameters() if values.ndim <= 1]
        groups = [{"params": decayed, "weight_decay": schedule.weight_decay}, {"params": others, "weight_decay": 0.0}]
        self._optimiser = torch.optim.AdamW(groups, lr=schedule.learning_rate)

    def step(self, batch: Batch) -> list[float]:
        """Learn from one batch; the parts of its loss, in the order of `PARTS`."""
        for group in self._optimiser.param_groups:
            group["lr"] = learning_rate(self.schedule, self.done)
        self.network.train()
        images = torch.from_numpy(batch.images).to(self._device).permute(0, 3, 1, 2).float() / 255.0
        said = self.network.raw(images.contiguous(memory_format=torch.channels_last))
        parts = losses(self.network.head, said, self._objects(batch), self.schedule)
        self._optimiser.zero_grad()
        parts.total(self.schedule).backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.schedule.gradient_norm)
        self._optimiser.step()
        self._average()
        self.done += 1
        return [float(part.detach()) for part in parts]

    def keep(self, path: Path, recipe: str, history: Tensor, scores: Tensor) -> None:
        """Write all that going on needs, in one step.

        Args:
            path: the checkpoint.
            recipe: what is trained on what; `restore` refuses another.
            history: (steps, n) of figures of each step.
            scores: (m, n) of figures now and then.
        """
        state = {
            "recipe": recipe,
            "done": self.done,
            "network": self.network.state_dict(),
            "averaged": self.averaged.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "history": history,
            "scores": scores,
        }
        _write(state, path)

    def keep_averaged(self, path: Path) -> None:
        """Write the running mean's weights alone, as `weights.load_weights` reads them."""
        _write(self.averaged.state_dict(), path)

    def restore(self, path: Path, recipe: str) -> tuple[Tensor, Tensor]:
        """Go on from a checkpoint; nothing that the file could say is run.

        Returns:
            `history` and `scores` as `keep` took them.

        Raises:
            ConfigError: a file that is none, or that of another training.
        """
        try:
            state: Any = torch.load(path, map_location=self._device, weights_only=True)
            if not isinstance(state, dict) or state["recipe"] != recipe:
                remedy = "an empty folder, or that of the same model, data, schedule and seed"
                raise ConfigError("out", str(path), remedy)
            kept = cast(dict[str, Any], state)
            self.network.load_state_dict(kept["network"])
            self.averaged.load_state_dict(kept["averaged"])
            self._optimiser.load_state_dict(kept["optimiser"])
            self.done = int(kept["done"])
            return kept["history"], kept["scores"]
        except (OSError, RuntimeError, ValueError, KeyError, EOFError, pickle.UnpicklingError) as error:
            reason = str(error).partition("\n")[0]
            raise ConfigError("out", str(path), f"a checkpoint of `auvdock train`, or none ({reason})") from error

    def _objects(self, batch: Batch) -> Objects:
        return Objects(
            *(
                torch.from_numpy(values).to(self._device, torch.float32 if values.dtype.kind == "f" else None)
                for values in batch.targets
            )
        )

    @torch.no_grad()
    def _average(self) -> None:
        """M ← d·m + (1 − d)·w with d = min(decay, (1 + t)/(10 + t)): the first, random weights are soon forgotten."""
        decay = min(self.schedule.average_decay, (1.0 + self.done) / (_RAMP + self.done))
        new = self.network.state_dict()
        for name, mean in self.averaged.state_dict().items():
            if mean.dtype.is_floating_point:
                mean.lerp_(new[name], 1.0 - decay)
            else:
                mean.copy_(new[name])


def _write(state: dict[str, Any], path: Path) -> None:
    part = path.with_name(f".{path.name}.part")
    torch.save(state, part)
    os.replace(part, path)
