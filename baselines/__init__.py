"""Motion cueing algorithms that need no training."""

from .policy import NoMotion, Policy
from .registry import default_policies, describe_policy, make_policy, policy_names
from .washout import ClassicalWashout, WashoutParameters

__all__ = [
    "ClassicalWashout",
    "NoMotion",
    "Policy",
    "WashoutParameters",
    "default_policies",
    "describe_policy",
    "make_policy",
    "policy_names",
]
