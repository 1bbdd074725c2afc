"""Motion cueing algorithms that need no training."""

from .policy import ForeknowingPolicy, NoMotion, Policy
from .registry import default_policies, describe_policy, make_policy, policy_names
from .washout import ClassicalWashout, WashoutParameters

__all__ = [
    "ClassicalWashout",
    "ForeknowingPolicy",
    "NoMotion",
    "Policy",
    "WashoutParameters",
    "default_policies",
    "describe_policy",
    "make_policy",
    "policy_names",
]
