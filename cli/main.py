"""The command line ``motion-cueing``: its commands, their help, exit status, and one line for what is wrong.

A command is a dataclass of its arguments and a function, which returns the exit status and raises a
``MotionCueingError`` where an argument or a file is wrong, before anything is driven or written. Modules of
commands import libraries within functions, so that help and complaints come at once.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import MISSING, dataclass, fields
from importlib import import_module
from inspect import cleandoc
from typing import TYPE_CHECKING, Annotated, Any, Final

from ..envs.errors import ConfigurationError, MotionCueingError, look_up
from ..envs.storage import release_folders

if TYPE_CHECKING:
    from cyclopts import App

PROGRAM: Final = "motion-cueing"
SUCCESS: Final = 0
FAILURE: Final = 1
BAD_ARGUMENTS: Final = 2
INTERRUPTED: Final = 130
"""128 + SIGINT, as shells report it."""
SHELLS: Final = ("bash", "zsh", "fish")


@dataclass(frozen=True)
class Command:
    """A command; its module is imported only when it is called.

    Args:
        module: Relative to this package.
        arguments: Name of the dataclass in it that becomes its options.
        summary: One line for the overview.
        example: Arguments that show what it is for.
        afterwards: What to do next.
        goes_on: Whether the same command goes on where it was stopped.
        announces: Whether the compilation of kernels is announced while it runs.
        run: Name of the function in the module that does the work.
    """

    module: str
    arguments: str
    summary: str
    example: str
    afterwards: str
    goes_on: bool = False
    announces: bool = True
    run: str = "run"


COMMANDS: Final[Mapping[str, Command]] = {
    "evaluate": Command(
        ".evaluate",
        "EvaluateCommand",
        "drive maneuvers with policies and compare them",
        "--policies classical learned --maneuvers hill slalom --out results",
        "open report.html in --out; `motion-cueing render` shows a drive",
    ),
    "benchmark": Command(
        ".benchmark",
        "BenchmarkCommand",
        "compare policies over fixed drives, with intervals",
        "--policies classical-tuned learned --workers 2 --out benchmark",
        "read benchmark.md in --out; --compare sets two results side by side",
        goes_on=True,
    ),
    "paper": Command(
        ".evaluate",
        "PaperCommand",
        "reproduce the paper's six cases, with a pass or a fail for each number",
        "--out paper",
        "open paper.html in --out",
        run="run_paper",
    ),
    "list": Command(
        ".list",
        "ListCommand",
        "show the names of policies, maneuvers, motion bases, cars and algorithms",
        "",
        "`motion-cueing evaluate --policies NAME ...` drives with them",
    ),
    "import": Command(
        ".import_log",
        "ImportCommand",
        "turn a log of a drive into cues",
        "log.csv --columns time=t:ms force_x=ax:g force_y=ay:g force_z=az:g rate_x=p rate_y=q rate_z=r "
        "--out cues.csv",
        "`motion-cueing evaluate --maneuvers cues.csv` drives it",
    ),
    "identify": Command(
        ".identify",
        "IdentifyCommand",
        "find a motion base's lag and dead time in a log of its motion",
        "motion.csv --platform paper --out my-platform.yaml",
        "`motion-cueing evaluate --platform my-platform.yaml --compensate` drives it",
        announces=False,
    ),
    "render": Command(
        ".render",
        "RenderCommand",
        "draw a drive as a film or a picture",
        "--maneuver slalom --policy learned --out slalom.gif",
        "`motion-cueing evaluate` says how good the drive is",
    ),
    "view": Command(
        ".view",
        "ViewCommand",
        "show a drive in three dimensions, in a browser",
        "classical-tuned learned --maneuver slalom --out slalom.html",
        "open the page; `motion-cueing evaluate --view` writes one beside its report",
    ),
    "export": Command(
        ".export",
        "ExportCommand",
        "write an agent as an ONNX file, or a policy as C99 or an FMU",
        "classical --set-points --c washout",
        "docs/guides/export-an-agent.md says how to run the files",
    ),
    "convert": Command(
        ".convert",
        "ConvertCommand",
        "turn a model of Stable-Baselines3 into an agent",
        "model.zip --environment motion_cueing/CueingPreview-v0 --out mine.safetensors",
        "`motion-cueing evaluate --policies mine.safetensors classical` compares it",
    ),
    "train": Command(
        ".train",
        "TrainCommand",
        "train an agent on random drives",
        "--algorithm ppo --steps 1e6 --out runs/mine",
        "`motion-cueing evaluate --policies runs/mine/best.safetensors` compares the agent",
        goes_on=True,
    ),
    "search": Command(
        ".train",
        "SearchCommand",
        "search for an algorithm's best hyperparameters",
        "--config search.yaml --trials 50 --steps 1e5 --out runs/search",
        "`motion-cueing train --config runs/search/best.yaml` trains with the best",
        goes_on=True,
        run="run_search",
    ),
    "population": Command(
        ".train",
        "PopulationCommand",
        "train a population whose worst go on from its best",
        "--config population.yaml --members 8 --out runs/population",
        "`motion-cueing evaluate --policies runs/population/best.safetensors` compares the best agent",
        goes_on=True,
        run="run_population",
    ),
    "curves": Command(
        ".curves",
        "CurvesCommand",
        "draw what trainings came to over their steps",
        "runs/mine runs/other --out curves.png",
        "`motion-cueing evaluate` compares the agents on the maneuvers",
    ),
    "frequency-response": Command(
        ".frequency_response",
        "FrequencyResponseCommand",
        "measure modulus and phase of the simulator's cues",
        "--policies classical mpc --axes f_x w_y --out frequency-response",
        "look at bode.png in --out",
    ),
    "compare": Command(
        ".studies",
        "CompareCommand",
        "drive on several machines: how much does a controller need?",
        "--platforms paper 24-inch --policies classical mpc --out comparison",
        "look at study.png and study.md in --out",
        goes_on=True,
        run="run_compare",
    ),
    "robustness": Command(
        ".studies",
        "RobustnessCommand",
        "drive with lag, delay, noise, another car, and faster",
        "--policies classical learned --maneuvers slalom --out robustness",
        "look at study.png and study.md in --out",
        goes_on=True,
        run="run_robustness",
    ),
    "predict": Command(
        ".predict",
        "PredictCommand",
        "measure a predictor of the cues ahead by lead time",
        "--drives 20 --out prediction",
        "`motion-cueing evaluate --preview predicted` drives policies with it",
    ),
    "map-faults": Command(
        ".studies",
        "MapFaultsCommand",
        "drive with wrong maps, gaps, and events that nobody announced",
        "--policies learned learned-road --maneuvers slalom --out map-faults",
        "look at study.png and study.md in --out",
        goes_on=True,
        run="run_map_faults",
    ),
    "endure": Command(
        ".endure",
        "EndureCommand",
        "drive for hours, other cars, slower actuators: is a limit exceeded?",
        "--policies learned-preview --hours 10 --out endurance",
        "read endurance.md in --out; --seeds drives the worst drives again",
        goes_on=True,
    ),
    "tune": Command(
        ".tune",
        "TuneCommand",
        "search for a washout's best parameters",
        "--algorithm classical --hours 100 --workers 2 --out mine.yaml",
        "`motion-cueing evaluate --policies mine.yaml classical` compares it",
        goes_on=True,
    ),
    "serve": Command(
        ".serve",
        "ServeCommand",
        "run a policy as a controller in real time, over UDP",
        "--policy classical-tuned --rate 1000",
        "`motion-cueing drive` in another terminal sends it cues",
        announces=False,
    ),
    "bridge": Command(
        ".bridge",
        "BridgeCommand",
        "send a simulator's or game's telemetry to such a controller",
        "--from forza --listen 5300 --to 127.0.0.1:47100",
        "docs/guides/bridge.md has the settings of each game",
        announces=False,
    ),
    "drive": Command(
        ".serve",
        "DriveCommand",
        "send a maneuver's cues to such a controller",
        "--maneuver slalom --to 127.0.0.1:47100",
        "`motion-cueing evaluate --replays FILE.npz` scores what `serve --log FILE.npz` wrote",
        announces=False,
        run="run_drive",
    ),
    "demonstrate": Command(
        ".demonstrate",
        "DemonstrateCommand",
        "record drives of a controller to learn from",
        "--policy optimum --drives 32 --out demonstrations",
        "docs/guides/record-demonstrations.md says how to read the files",
        goes_on=True,
    ),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: Arguments without the program's name; those of the process if not given.

    Returns:
        0 success, 1 a failure while working, 2 bad arguments, 130 interrupted.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    name = next((argument for argument in arguments[:1] if not argument.startswith("-")), "")
    program = f"{PROGRAM} {name}".strip()
    return _guarded(program, lambda: _dispatch(arguments), _interrupted(name, arguments))


def _interrupted(name: str, arguments: Sequence[str]) -> str:
    """What is said after Ctrl-C."""
    if name not in COMMANDS or not COMMANDS[name].goes_on:
        return "interrupted"
    fresh = " without --fresh" if "--fresh" in arguments else ""
    return f"interrupted; what is done is kept, and the same command{fresh} goes on"


def _guarded(program: str, work: Callable[[], int], interrupted: str) -> int:
    """Turn what can go wrong into one line and an exit status."""
    try:
        return work()
    except MotionCueingError as error:
        return _complain(program, str(error), BAD_ARGUMENTS)
    except KeyboardInterrupt:
        return _complain(program, interrupted, INTERRUPTED)
    except BrokenPipeError:
        # The reader (`head`) has gone; keep Python from complaining again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILURE
    except OSError as error:
        return _complain(program, f"{error.filename or 'output'}: {error.strerror or error}", FAILURE)
    finally:
        release_folders()


def _complain(program: str, message: str, status: int) -> int:
    print(f"{program}: {' '.join(message.split())}", file=sys.stderr)
    return status


def _dispatch(arguments: list[str]) -> int:
    if arguments[:1] in (["-h"], ["--help"], ["help"]) and len(arguments) > 1:
        # `motion-cueing help evaluate` is `motion-cueing evaluate --help`.
        arguments = [arguments[1], "--help"]
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(overview())
        return SUCCESS if arguments else BAD_ARGUMENTS
    name, rest = arguments[0], arguments[1:]
    if name == "--version":
        from importlib.metadata import version

        print(f"{PROGRAM} {version('motion-cueing-gym')}")
        return SUCCESS
    if name == "--print-completion":
        shell = look_up("shell", rest[0] if rest else "", {shell: shell for shell in SHELLS})
        print(_whole().generate_completion(prog_name=PROGRAM, shell=shell))  # type: ignore[arg-type]
        return SUCCESS
    if name == "__complete":
        # The script of --print-completion calls this to complete names.
        _whole()(arguments, result_action="return_none")
        return SUCCESS
    if name.startswith("-"):
        raise ConfigurationError(f"a command comes first, found {name}. See `{PROGRAM} --help`")
    command = look_up("command", name, COMMANDS)
    parsed = parse(name, rest)
    if parsed is None:
        return SUCCESS
    from ..envs.progress import compilation_announced

    with compilation_announced() if command.announces else nullcontext():
        return int(getattr(import_module(command.module, __package__), command.run)(parsed))


def overview() -> str:
    """The help of the program without a command."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {command.summary}" for name, command in COMMANDS.items()]
    return "\n".join(
        [
            f"usage: {PROGRAM} COMMAND [options]",
            "",
            "Motion cueing for driving simulators.",
            "",
            "commands:",
            *lines,
            "",
            "example:",
            f"  {PROGRAM} evaluate --policies classical classical-tuned --maneuvers lane-change",
            "",
            f"`{PROGRAM} COMMAND --help` shows the options of a command and an example.",
            f"`{PROGRAM} --version` shows the version.",
            f"`{PROGRAM} --print-completion {'|'.join(SHELLS)}` writes a script by which a shell",
            f'completes options: eval "$({PROGRAM} --print-completion bash)" in ~/.bashrc.',
        ]
    )


def parse(name: str, arguments: Sequence[str]) -> Any:
    """The arguments of a command.

    Returns:
        Its dataclass; None where its help was requested and has been shown.
    """
    from cyclopts import CycloptsError

    from .errors import complaint

    app = app_of(name)
    if any(word in ("-h", "--help") for word in arguments):
        app.help_print([])
        # Not folded as the rest of the help is, so that it can be copied.
        example = f"{PROGRAM} {name} {COMMANDS[name].example}".rstrip()
        print(f"\nExample:\n  {example}\n\nNext: {COMMANDS[name].afterwards}.")
        return None
    try:
        _, bound, _ = app.parse_args(list(arguments), exit_on_error=False, print_error=False)
    except CycloptsError as error:
        # What a configuration says of its fields is a sentence already.
        cause = error.__cause__
        raise (cause if isinstance(cause, MotionCueingError) else complaint(name, error)) from None
    return bound.arguments["command"] if bound.arguments else _class_of(name)()


def _class_of(name: str) -> type[Any]:
    command = COMMANDS[name]
    return getattr(import_module(command.module, __package__), command.arguments)  # type: ignore[no-any-return]


def app_of(name: str, prefix: str = f"{PROGRAM} ") -> App:
    """The parser of a command.

    Args:
        name: Of the command.
        prefix: Of its name in the help.
    """
    from cyclopts import App, Parameter

    kind = _class_of(name)
    app = App(
        name=f"{prefix}{name}",
        help=cleandoc(kind.__doc__ or ""),
        help_format="markdown",
        version_flags=(),
        default_parameter=Parameter(negative=(), show_default=_shown),
    )
    app["--help"].show = False

    def run(command: Any) -> None:
        """Only its arguments count."""

    run.__annotations__ = {"command": Annotated[kind, Parameter(name="*", show=bool(fields(kind)))]}
    if not any(field.default is MISSING and field.default_factory is MISSING for field in fields(kind)):
        run.__defaults__ = (kind(),)
    app.default(run)
    return app


def _shown(value: Any) -> str | None:
    """A default in the help; None where it says nothing."""
    if value is None or value is False or value in ((), ""):
        return None
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _whole() -> App:
    """All commands in one parser, as completion needs it."""
    from cyclopts import App

    whole = App(name=PROGRAM, version_flags=("--version",))
    for name in COMMANDS:
        whole.command(app_of(name, prefix=""))
    return whole
