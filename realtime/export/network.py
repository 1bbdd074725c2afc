"""A policy's network as C: weights as arrays, layer by layer, in single precision as in NumPy."""

from __future__ import annotations

from typing import Final

import numpy as np

from ...train.agents.network import Network, PolicyNetwork
from .source import array_text

_ACTIVATIONS: Final = {
    "tanh": "tanhf(x)",
    "relu": "x > 0.0f ? x : 0.0f",
    "elu": "x > 0.0f ? x : expm1f(x)",
    "silu": "0.5f * x + 0.5f * x * tanhf(0.5f * x)",
}


def network_code(network: PolicyNetwork, prefix: str) -> tuple[list[str], int]:
    """Tables and functions of a network, and how many numbers its memory has.

    The function is ``PREFIX(float *memory, const float *observation, float *action)``; without a memory its
    first argument is left out.

    Args:
        network: With or without layers that remember.
        prefix: Before every name.
    """
    head = network.head
    hidden = len(head.weights) > 1
    parts = [_function(f"{prefix}_activation", head.activation)] if hidden else []
    size, action = network.size, network.action_size
    lines = [f"float x[{size}];", *_normalization(network, prefix, parts), *_clipping(network)]
    memory = sum(2 * layer.units for layer in network.lstm)
    source, width = "x", size
    for k, layer in enumerate(network.lstm):
        parts += _lstm(k, layer.inputs, layer.recurrent, layer.bias, f"{prefix}_lstm_{k + 1}")
        first = sum(2 * one.units for one in network.lstm[:k])
        lines.append(f"{prefix}_lstm_{k + 1}({source}, memory + {first});")
        source, width = f"memory + {first}", layer.units
    if network.lstm:
        lines += [f"const float *features = {source};"]
        source = "features"
    lines += _layers(head, prefix, source, width, parts)
    parameters = f"{'float *memory, ' if memory else ''}const float *observation, float *action"
    largest = f"{float(np.float32(head.bound))!r}f"
    lines.append(f"for (int32_t i = 0; i < {action}; i++) {{")
    if head.squash == "tanh":
        lines.append(f"    action[i] = {largest} * tanhf(action[i]);")
    else:
        lines.append(f"    action[i] = fminf(fmaxf(action[i], -{largest}), {largest});")
    lines.append("}")
    about = f"/* The policy: {size} numbers of an observation to {action} of an action. */"
    body = "\n".join(f"    {line}" for line in lines)
    parts.append(f"{about}\nstatic void {prefix}({parameters}) {{\n{body}\n}}")
    return [part for part in parts if part], memory


def _function(name: str, activation: str) -> str:
    return f"/* {activation} */\nstatic float {name}(float x) {{\n    return {_ACTIVATIONS[activation]};\n}}"


def _normalization(network: PolicyNetwork, prefix: str, parts: list[str]) -> list[str]:
    """(x - mean) / sqrt(variance), the mean in two parts, which is as exact as double precision."""
    n = network.size
    if network.mean is None:
        return [f"for (int32_t i = 0; i < {n}; i++) {{", "    x[i] = observation[i];", "}"]
    for name, values in zip(("mean", "mean_rest", "factor"), network.normalization, strict=True):
        parts.append(array_text(f"{prefix}_{name}", values, "float", True))
    taken = f"(observation[i] - {prefix}_mean[i] - {prefix}_mean_rest[i]) * {prefix}_factor[i]"
    return [f"for (int32_t i = 0; i < {n}; i++) {{", f"    x[i] = {taken};", "}"]


def _clipping(network: PolicyNetwork) -> list[str]:
    if network.mean is None:
        return []
    clip = f"{float(np.float32(network.clip))!r}f"
    return [
        f"for (int32_t i = 0; i < {network.size}; i++) {{",
        f"    x[i] = fminf(fmaxf(x[i], -{clip}), {clip});",
        "}",
    ]


def _layers(head: Network, prefix: str, source: str, width: int, parts: list[str]) -> list[str]:
    """Calls of all layers; the last writes to ``action``."""
    lines, given = [], source
    for k, (weights, bias) in enumerate(zip(head.weights, head.biases, strict=True)):
        outputs, inputs = weights.shape
        last = k == len(head.weights) - 1
        layer = f"{prefix}_layer_{k + 1}"
        parts.append(_dense(layer, weights, bias))
        if last and head.skip and k > 0:
            hidden = inputs - width
            lines += [
                f"float joined[{inputs}];",
                f"for (int32_t i = 0; i < {hidden}; i++) {{",
                f"    joined[i] = {given}[i];",
                "}",
                f"for (int32_t i = 0; i < {width}; i++) {{",
                f"    joined[{hidden} + i] = {source}[i];",
                "}",
            ]
            given = "joined"
        if last:
            lines.append(f"{layer}({given}, action);")
            continue
        target = f"hidden_{k + 1}"
        lines += [
            f"float {target}[{outputs}];",
            f"{layer}({given}, {target});",
            f"for (int32_t i = 0; i < {outputs}; i++) {{",
            f"    {target}[i] = {prefix}_activation({target}[i]);",
            "}",
        ]
        given = target
    return lines


def _dense(name: str, weights: np.ndarray, bias: np.ndarray) -> str:
    """A layer, input by input, which compilers turn into instructions on several outputs at once."""
    outputs, inputs = weights.shape
    return "\n".join(
        [
            "/* Weights by input, then output. */",
            array_text(f"{name}_weights", weights.T, "float", True),
            array_text(f"{name}_biases", bias, "float", True),
            f"\nstatic void {name}(const float *x, float *y) {{",
            f"    for (int32_t j = 0; j < {outputs}; j++) {{",
            f"        y[j] = {name}_biases[j];",
            "    }",
            f"    for (int32_t i = 0; i < {inputs}; i++) {{",
            "        const float given = x[i];",
            f"        for (int32_t j = 0; j < {outputs}; j++) {{",
            f"            y[j] += {name}_weights[i][j] * given;",
            "        }",
            "    }",
            "}",
        ]
    )


def _lstm(k: int, inputs: np.ndarray, recurrent: np.ndarray, bias: np.ndarray, name: str) -> list[str]:
    """A layer with a memory: its output, then its cell (Hochreiter and Schmidhuber 1997)."""
    units = recurrent.shape[1]
    parts = []
    if k == 0:
        parts.append("static float logistic(float x) {\n    return 0.5f + 0.5f * tanhf(0.5f * x);\n}")
    parts += [
        _dense(f"{name}_inputs", inputs, bias),
        _dense(f"{name}_recurrent", recurrent, np.zeros_like(bias)),
        "\n".join(
            [
                "/* Input, forget, candidate and output gate; memory is output, then cell. */",
                f"static void {name}(const float *x, float *memory) {{",
                f"    float gates[{4 * units}];",
                f"    float remembered[{4 * units}];",
                f"    float *cell = memory + {units};",
                f"    {name}_inputs(x, gates);",
                f"    {name}_recurrent(memory, remembered);",
                f"    for (int32_t i = 0; i < {units}; i++) {{",
                "        const float enter = logistic(gates[i] + remembered[i]);",
                f"        const float keep = logistic(gates[{units} + i] + remembered[{units} + i]);",
                f"        const float wish = tanhf(gates[{2 * units} + i] + remembered[{2 * units} + i]);",
                f"        const float show = logistic(gates[{3 * units} + i] + remembered[{3 * units} + i]);",
                "        cell[i] = keep * cell[i] + enter * wish;",
                "        memory[i] = show * tanhf(cell[i]);",
                "    }",
                "}",
            ]
        ),
    ]
    return parts
