"""Motion cueing algorithms that need no training, the interface of every policy, and the names of all.

Attributes are imported when they are first used: a list of names costs no import of Warp.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .registry import default_policies, describe_policy, make_policy, policy_names, register

if TYPE_CHECKING:
    from .policy import Information, NoMotion, Policy, TaskPolicy, as_policy
    from .washout import ClassicalWashout, WashoutParameters

_LAZY = {
    "ClassicalWashout": ".washout",
    "Information": ".policy",
    "NoMotion": ".policy",
    "Policy": ".policy",
    "TaskPolicy": ".policy",
    "WashoutParameters": ".washout",
    "as_policy": ".policy",
}

__all__ = [
    "ClassicalWashout",
    "Information",
    "NoMotion",
    "Policy",
    "TaskPolicy",
    "WashoutParameters",
    "as_policy",
    "default_policies",
    "describe_policy",
    "make_policy",
    "policy_names",
    "register",
]


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name], __name__), name)
