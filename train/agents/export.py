"""An agent as an ONNX file: the network with its normalization, checked and timed."""

from __future__ import annotations

import io
import json
import time
import warnings
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.errors import MotionCueingError
from ...envs.settings import to_dict
from ...envs.storage import write_bytes
from ...envs.task.kernels.action import action_scale
from ...envs.task.kernels.observation import abilities
from .agent import Agent
from .network import Array

OPSET: Final = 18
"""Version of ONNX's operators."""
INPUT: Final = "observation"
OUTPUT: Final = "action"
TOLERANCE: Final = 1e-5
"""Largest difference of an action, which lies in [-1, 1], from what PyTorch computes."""

CHECKED: Final = 10_000
"""Observations an export is checked on."""

_WARM_UP: Final = 1_000
_TIMED: Final = 10_000


class ExportError(MotionCueingError, RuntimeError):
    """A package is missing, or the exported network computes something else."""


@dataclass(frozen=True)
class Exported:
    """Accuracy, speed and size of an export.

    Args:
        torch_difference: Largest difference of an action from PyTorch's.
        numpy_difference: Largest difference from :class:`~.network.Network`'s.
        mean: Time of one observation with onnxruntime on one thread, s.
        p99: 99th percentile of it, s.
        longest: The longest, s.
        size: Of the file, bytes.
    """

    torch_difference: float
    numpy_difference: float
    mean: float
    p99: float
    longest: float
    size: int


def export_onnx(agent: Agent, path: str | Path) -> Exported:
    """Write an agent's network as ONNX, once it is known to compute the same.

    Input ``observation`` (n, size) float32 as the environment gives it, output ``action`` (n, k) within
    the bound. Rows, units, and what an action of 1 stands for are in the file's metadata.

    Raises:
        ExportError: a package is missing, the network has a memory, or the exported one computes something
            else.
    """
    network = agent.network.head
    if agent.network.lstm:
        raise ExportError(
            f"agent {agent.name}: its network has a memory (LSTM), which the ONNX file does not hold; "
            "export an agent without one"
        )
    torch, onnx, runtime = (_load(name) for name in ("torch", "onnx", "onnxruntime"))
    from ..networks import TorchNetwork

    module = TorchNetwork(network)
    model = _described(onnx.load_from_string(_exported(torch, module, network.size)), onnx, agent)
    session = _session(runtime, model)
    observations = _observations(agent)
    answers = session.run([OUTPUT], {INPUT: observations})[0]
    with torch.no_grad():
        expected = module(torch.from_numpy(observations)).numpy()
    by_torch = float(np.abs(answers - expected).max())
    by_numpy = float(np.abs(answers - network(observations)).max())
    if not max(by_torch, by_numpy) <= TOLERANCE:
        raise ExportError(
            f"the exported network differs by {by_torch:.2g} from PyTorch and {by_numpy:.2g} from NumPy, "
            f"at most {TOLERANCE:.0e} is allowed; nothing was written"
        )
    seconds = _times(session, observations)
    write_bytes(path, model)
    return Exported(
        torch_difference=by_torch,
        numpy_difference=by_numpy,
        mean=float(seconds.mean()),
        p99=float(np.percentile(seconds, 99.0)),
        longest=float(seconds.max()),
        size=len(model),
    )


def _exported(torch: ModuleType, module: Any, size: int) -> bytes:
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        # The newer exporter is said to be better; it needs a package more and writes two files.
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.onnx.export(
            module,
            (torch.zeros(1, size),),
            buffer,
            input_names=[INPUT],
            output_names=[OUTPUT],
            dynamic_axes={INPUT: {0: "n"}, OUTPUT: {0: "n"}},
            opset_version=OPSET,
            dynamo=False,
        )
    return buffer.getvalue()


def metadata(agent: Agent) -> dict[str, str]:
    """What a user of the file has to know, as JSON where it is more than a word."""
    action = {
        "mode": agent.task.action.mode,
        "range": [-agent.task.action.bound, agent.task.action.bound],
        "axes": list(agent.task.action.axes),
        "scale": action_scale(agent.platform, agent.task.action).tolist(),
        "scale_unit": "m/s^2 and rad/s^2, of an acceleration of 1 on each axis",
        "repeat": agent.task.action.repeat,
    }
    values = {
        "rows": [asdict(row) for row in agent.layout.rows],
        "stack": agent.layout.stack,
        "action": action,
        "machine": abilities_of(agent),
        "task": to_dict(agent.task),
        "record": to_dict(agent.record),
    }
    return {"name": agent.name} | {key: json.dumps(value) for key, value in values.items()}


def abilities_of(agent: Agent) -> dict[str, list[float]]:
    """Description of the machine that the agent observes, in SI units; empty where it observes none."""
    if not agent.task.observation.machine:
        return {}
    return {name: values.tolist() for name, values in abilities(agent.platform).items()}


def _described(proto: Any, onnx: ModuleType, agent: Agent) -> bytes:
    proto.doc_string = agent.description
    onnx.helper.set_model_props(proto, metadata(agent))
    onnx.checker.check_model(proto)
    described: bytes = proto.SerializeToString()
    return described


def _session(runtime: ModuleType, model: bytes) -> Any:
    options = runtime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return runtime.InferenceSession(model, options, providers=["CPUExecutionProvider"])


def _observations(agent: Agent) -> Array:
    """Observations as the agent meets them, and some beyond: spread as in training, or over +-1."""
    network, rng = agent.network, np.random.default_rng(0)
    drawn = rng.standard_normal((CHECKED, network.size))
    if network.mean is not None and network.variance is not None:
        drawn = network.mean + np.sqrt(network.variance) * drawn
    bounds = agent.layout.bounds
    return np.clip(drawn, -bounds, bounds).astype(np.float32)


def _times(session: Any, observations: Array) -> NDArray[np.float64]:
    """Wall-clock seconds of single observations, one after another."""
    seconds = np.zeros(_WARM_UP + _TIMED)
    for k in range(len(seconds)):
        one = {INPUT: observations[k % len(observations)][None]}
        began = time.perf_counter()
        session.run([OUTPUT], one)
        seconds[k] = time.perf_counter() - began
    return seconds[_WARM_UP:]


def _load(module: str) -> ModuleType:
    try:
        return import_module(module)
    except ImportError:
        raise ExportError(f"export needs {module}: pip install 'motion-cueing-gym[export]'") from None
