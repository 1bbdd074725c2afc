"""Policies by name and from files: washouts, predictive control, the optimum, and those of other packages.

``register(name, factory, description)`` adds a controller to every command and function that takes a name::

    from motion_cueing.baselines import register

    register("mine", lambda platform: MyController(platform), "one line for lists")

An installed package does the same by an entry point of the group ``motion_cueing.policies``, whose object
is such a factory. Nothing here imports a controller or Warp before one is made.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import yaml

from ..envs.errors import ConfigurationError, DataError, MotionCueingError, place, suggest, summary
from ..envs.registry import Registry
from ..envs.settings import preset_names

if TYPE_CHECKING:
    from ..envs.platform.machines import Platform
    from .compensation import CompensationOptions
    from .policy import Policy

Factory: TypeAlias = "Callable[[Platform], Any]"
"""Makes a policy, or any object that :func:`~.policy.as_policy` takes, for a machine."""

Reader: TypeAlias = "Callable[[Path, Platform], Any]"
"""Makes a policy from a file, for a machine."""

POLICIES: Final[Registry[Factory]] = Registry(
    "policy", "motion_cueing.policies", {"classical-ceiling": "classical-per-maneuver"}
)
"""Every policy that has a name."""

POLICY_FILES: Final[Registry[Reader]] = Registry("policy file", "motion_cueing.policy_files")
"""What reads a policy's file, by the ending of its name without the dot."""

_DEFAULT: Final = ("no-motion", "classical", "classical-tuned", "optimal-washout-tuned", "est1", "brk")


register = POLICIES.register
"""Give a policy's factory a name, see :meth:`~motion_cueing.envs.registry.Registry.register`."""

policy_names = POLICIES.names
"""Names that :func:`make_policy` knows."""

describe_policy = POLICIES.description
"""One line about a policy."""


def default_policies() -> list[str]:
    """Policies an evaluation compares where none is named."""
    return list(_DEFAULT)


def make_policy(
    name: Any,
    platform: Platform,
    *,
    force: bool = False,
    compensation: CompensationOptions | None = None,
) -> Policy:
    """A policy for a machine, by name or from a file; or a policy itself, fitted to the machine.

    Args:
        name: Of a registered policy; a file, such as the YAML of a washout or a predictive controller, and
            whatever else :data:`POLICY_FILES` reads; a class or function of one's own as ``module:Class`` or
            ``file.py:Class``; or any object that :func:`~.policy.as_policy` takes.
        platform: The machine.
        force: Whether a policy that was made for another machine is put on this one as well as it can be.
        compensation: How the machine's lag and dead time are compensated; None for not at all.

    Raises:
        UnknownNameError: no policy has this name.
        DataError: the file does not exist or cannot be read.
        ConfigurationError: a field of the file is wrong, an object has no ``predict``, or the policy was made
            for another machine.
    """
    from .policy import as_policy

    policy = as_policy(_made(name, platform))
    if compensation is not None:
        from .compensation import Compensated

        policy = Compensated(policy, compensation)
    return policy.on(platform) if force else policy.for_platform(platform)


def _made(name: Any, platform: Platform) -> Any:
    """What a name or file stands for; anything else is returned."""
    if not isinstance(name, str | Path):
        return name
    text, ending = str(name), Path(name).suffix.removeprefix(".")
    if text not in POLICIES:
        if is_reference(text):
            return _referenced(text, platform)
        if ending in POLICY_FILES:
            return POLICY_FILES[ending](Path(name), platform)
        if Path(name).exists():
            known = ", ".join(f".{one}" for one in POLICY_FILES)
            raise DataError(f"{name}: not a policy; the name of a policy's file ends in one of {known}")
    return POLICIES[text](platform)


def is_reference(name: str) -> bool:
    """Whether a name means an object of the user's: ``module:Class`` or ``file.py:Class``."""
    return ":" in name


def name_of_reference(name: str, platform: Platform) -> str:
    """What the policy that ``module:Class`` or ``file.py:make`` stands for calls itself."""
    from .policy import as_policy

    return as_policy(_referenced(name, platform)).name or name.rpartition(":")[2]


def _referenced(name: str, platform: Platform) -> Any:
    """An object of the user's; a class or function is called to make it.

    It is called with the machine if its first argument is called ``platform``, else without arguments.

    Raises:
        ConfigurationError: it cannot be imported or made.
    """
    module, _, attribute = name.rpartition(":")
    try:
        loaded = _import(module)
        if not hasattr(loaded, attribute):
            known = [one for one, value in vars(loaded).items() if callable(value) and one[0] != "_"]
            raise ConfigurationError(f"{module} has no {attribute!r}. {suggest(attribute, known)}")
        target = getattr(loaded, attribute)
        if inspect.isclass(target) or inspect.isroutine(target):
            first = next(iter(inspect.signature(target).parameters), None)
            target = target(platform) if first == "platform" else target()  # type: ignore[call-arg]
    except MotionCueingError as error:
        raise ConfigurationError(f"policy {name}: {error}") from error
    except Exception as error:  # It is a user's code.
        where = place(error)
        raise ConfigurationError(
            f"policy {name}: {summary(error)}" + (f" ({where})" if where else "")
        ) from error
    return target


_LOADED: Final[dict[tuple[Path, int, int], Any]] = {}
"""Modules from files, by path, time of the last change and size: the code of a file runs once."""


def _import(module: str) -> Any:
    """A module by name or file.

    The current folder is put on the path, as by ``python -m``; for a file its own, as by ``python file.py``.

    Raises:
        ConfigurationError: there is none.
    """
    file = Path(module).resolve()
    from_file = module.endswith(".py")
    folder = str(file.parent if from_file else Path.cwd())
    if folder not in sys.path:
        sys.path.insert(0, folder)
    if not from_file:
        try:
            return import_module(module)
        except ModuleNotFoundError as error:
            # A module that the user's own imports and that is missing is another matter.
            if error.name is None or not f"{module}.".startswith(f"{error.name}."):
                raise
            raise ConfigurationError(
                f"no module {error.name!r} in the current folder or among the installed packages"
            ) from None
    if not file.is_file():
        raise ConfigurationError(f"{module}: there is no such file")
    key = file, file.stat().st_mtime_ns, file.stat().st_size
    if key not in _LOADED:
        spec = spec_from_file_location(file.stem, file)
        assert spec is not None
        assert spec.loader is not None
        loaded = module_from_spec(spec)
        # Dataclasses and pickles look for the module of their class.
        sys.modules.setdefault(spec.name, loaded)
        spec.loader.exec_module(loaded)
        _LOADED[key] = loaded
    return _LOADED[key]


def _no_motion(platform: Platform) -> Policy:
    from .policy import NoMotion

    return NoMotion()


def _washout(name: str, platform: Platform) -> Policy:
    from .washout import load_parameters, make_washout

    return make_washout(load_parameters(name, platform.name), platform.cab)


def _mpc(name: str, platform: Platform) -> Policy:
    from .mpc import load_mpc, make_mpc

    return make_mpc(platform, load_mpc(name), name)


def _optimum(objective: Any, platform: Platform) -> Policy:
    from .optimum import Optimum, OptimumOptions

    return Optimum(platform, OptimumOptions(objective=objective), progress=False)


def _description(path: Path) -> str:
    """The description in a preset's file, whose first lines hold it."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return str(yaml.safe_load("\n".join(lines[:3])).get("description", ""))


def register_presets(folder: Path) -> None:
    """Give the parameter sets of a washout family, a YAML file each, the names of their files."""
    for name in preset_names(folder):
        register(name, partial(_washout, name), _description(folder / f"{name}.yaml"))


def _register_own() -> None:
    register("no-motion", _no_motion, "the machine stands still")
    register(
        "classical-per-maneuver",
        f"{__package__}.washout.classical:PerManeuverWashout",
        "an oracle: classical with the best set for each standard maneuver",
    )
    for name, about in {
        "mpc": "predictive control that knows nothing of the drive ahead",
        "mpc-tuned": "mpc with forecast and weights found on random drives",
        "mpc-preview": "predictive control that sees 2 s of the drive ahead",
        "mpc-full": "predictive control that knows the drive over its whole horizon, 8 s",
        "nmpc": "mpc with exact equations, solved until it converges",
        "nmpc-preview": "mpc-preview with exact equations, solved until it converges",
    }.items():
        register(name, partial(_mpc, name), about)
    register(
        "optimum", partial(_optimum, "J"), "the least J there is: the whole drive known, its motion planned"
    )
    register("optimum-perceived", partial(_optimum, "perceived"), "the same for the least perceived J")
    for family in ("classical", "adaptive", "optimal"):
        register_presets(Path(__file__).parent / "washout" / family / "presets")
    for ending in ("yaml", "yml"):
        POLICY_FILES.register(
            ending, f"{__package__}.washout.policy:policy_of_file", "a washout or a predictive controller"
        )


_register_own()
