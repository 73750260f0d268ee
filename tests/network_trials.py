"""What the tests of networks share; needs PyTorch."""

from typing import Any

import numpy as np
import onnxruntime
import torch

torch.set_num_threads(1)  # more of them wait for each other by spinning where other tests run beside


def run_onnx(model: bytes, **inputs: torch.Tensor) -> list[np.ndarray[Any, Any]]:
    """What ONNX Runtime makes of inputs by name."""
    session = onnxruntime.InferenceSession(model)
    return [np.asarray(value) for value in session.run(None, {name: x.numpy() for name, x in inputs.items()})]


@torch.no_grad()
def make_lived_in(network: torch.nn.Module) -> None:
    """Give all normalisations statistics, scales and shifts as training would; new ones do nothing."""
    for part in network.modules():
        if isinstance(part, torch.nn.BatchNorm2d):
            assert isinstance(part.running_mean, torch.Tensor)
            assert isinstance(part.running_var, torch.Tensor)
            part.running_mean.normal_(0.0, 0.2)
            part.running_var.uniform_(0.5, 2.0)
            part.weight.uniform_(0.5, 1.5)
            part.bias.normal_(0.0, 0.2)
