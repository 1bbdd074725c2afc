"""What tyro says about arguments in plain words: what is wrong with them, and its help."""

from __future__ import annotations

import dataclasses
import io
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final

from ..envs.errors import ConfigurationError, MotionCueingError, look_up

_ONE: Final = {"FLOAT": "a number", "INT": "a whole number"}
_MANY: Final = {"FLOAT": "numbers", "INT": "whole numbers"}


def plain_complaint(panel: str) -> str:
    """The sentences of a panel of tyro's, without its frame, the help of the option and internal types.

    Args:
        panel: What tyro wrote; the frame's first line is its title.
    """
    plain = re.sub(r"\x1b\[[0-9;]*m", "", panel)
    rows = [row.strip("│╭╮╰╯─| ") for row in plain.splitlines()[1:]]
    # Terminals without box characters get rules of ASCII; a `-` within words belongs to an option.
    text = " ".join(row for row in rows if row.strip("+-")).split("For full helptext")[0]
    told, _, suggested = text.partition("Perhaps you meant:")
    near = dict.fromkeys(re.findall(r"(?<!\S)--[a-z][a-z-]*", suggested))
    hint = f" Did you mean {' or '.join(near)}?" if near else ""
    return f"{_reworded(told.strip()).rstrip('.')}.{hint}"


def plain_help(text: str) -> str:
    """Tyro's help without what stands for an option that is not given; its own text says what then happens.

    Everything keeps its place, so that frames stay whole.

    Args:
        text: What tyro wrote for ``--help``.
    """

    def blank(found: re.Match[str]) -> str:
        return re.sub(r"[^\s│|]", " ", found[0])

    def bare(found: re.Match[str]) -> str:
        return found[1].strip("{}").ljust(len(found[0]))

    # The width of the terminal may break a line within the brackets.
    text = re.sub(r"\(default:[\s│|]*(?:None)?\)", blank, text)
    return re.sub(r"\{None\}\|(\{[^}]*\}|[A-Z]+)", bare, text)


def _reworded(told: str) -> str:
    for pattern, sentence in _SENTENCES.items():
        found = re.match(pattern, told)
        if found:
            return sentence(found)
    return told


def _wrong_type(found: re.Match[str]) -> str:
    """Of an option with several types or values, such as ``{None}|{INT INT}``."""
    kinds = found["kinds"].replace("{None}|", "").strip("{}").split()
    return f"{found['option']} takes {_expected(kinds)}, found {found['value'].replace(',', '')}"


def _expected(kinds: list[str]) -> str:
    if len(kinds) == 1:
        return _ONE.get(kinds[0], kinds[0])
    alike = len(set(kinds)) == 1 and kinds[0] in _MANY
    return f"{len(kinds)} {_MANY[kinds[0]]}" if alike else " ".join(kinds)


def _missing(found: re.Match[str]) -> str:
    """Each missing option is told by its name, its values, its help and `(required)`."""
    names = [part.split()[0] for part in found["options"].split("(required)") if part.strip()]
    rest = found["rest"].strip()
    return f"{', '.join(names)} must be given" + (f". {rest}" if rest else "")


_SENTENCES: Final[dict[str, Callable[[re.Match[str]], str]]] = {
    r"Error parsing (--\S+): could not convert string to float: ('.*?')": lambda found: (
        f"{found[1]} takes a number, found {found[2]}"
    ),
    r"Error parsing (--\S+): invalid literal for int\(\) with base 10: ('.*?')": lambda found: (
        f"{found[1]} takes a whole number, found {found[2]}"
    ),
    r"Error parsing (?P<option>--\S+): no type matching (?P<kinds>.*?) could be instantiated from "
    r"\[(?P<value>.*?)\]": _wrong_type,
    # What a configuration says of its fields; its class is of no interest here.
    r"Error parsing [^-]\S*: \w+: (.*)": lambda found: found[1],
    r"Missing value for argument '(.*?)'\. Expected (\d+) values": lambda found: (
        f"{found[1]} needs {'a value' if found[2] == '1' else found[2] + ' values'} after it"
    ),
    r"Missing from [^:]*: (?P<options>.*\(required\))(?P<rest>.*)": _missing,
}

# The command ``motion-cueing``: a subcommand is a dataclass of arguments and a ``run`` in its own module.


PROGRAM: Final = "motion-cueing"
SUCCESS: Final = 0
FAILURE: Final = 1
BAD_ARGUMENTS: Final = 2
INTERRUPTED: Final = 130
"""128 + SIGINT, as shells report it."""


@dataclass(frozen=True)
class Command:
    """A subcommand; its module is imported only when it is called.

    Args:
        module: Relative to this package.
        arguments: Name of the dataclass in it that tyro turns into options.
        summary: One line for the overview.
        goes_on: Whether the same command goes on where it was stopped.
    """

    module: str
    arguments: str
    summary: str
    goes_on: bool = False


COMMANDS: Final[Mapping[str, Command]] = {
    "evaluate": Command(
        ".evaluate_command", "EvaluateCommand", "drive maneuvers with policies and compare them"
    ),
    "list": Command(
        ".list_command", "ListCommand", "show the names of policies, maneuvers, motion bases and cars"
    ),
    "import": Command(".import_command", "ImportCommand", "turn a log of a drive into cues"),
    "render": Command(".render_command", "RenderCommand", "draw a drive as a film or a picture"),
    "export": Command(".export_command", "ExportCommand", "write an agent as an ONNX file"),
    "train": Command("..cli.train", "TrainCommand", "train an agent on random drives"),
    "curves": Command(".curves_command", "CurvesCommand", "draw what trainings came to over their steps"),
    "frequency-response": Command(
        ".frequency_command", "FrequencyResponseCommand", "measure modulus and phase of what is felt"
    ),
    "compare": Command(
        ".compare_command",
        "CompareCommand",
        "drive on several machines: how much does a controller need?",
        goes_on=True,
    ),
    "robustness": Command(
        ".robustness_command",
        "RobustnessCommand",
        "drive with lag, delay, noise, another car, more fiercely",
        goes_on=True,
    ),
    "endure": Command(
        ".endure_command",
        "EndureCommand",
        "drive for hours, other cars, slower actuators: is a limit exceeded?",
        goes_on=True,
    ),
    "tune": Command(".tune_command", "TuneCommand", "search for an algorithm's best parameters"),
    "serve": Command(".serve_command", "ServeCommand", "run a policy as a controller in real time, over UDP"),
    "drive": Command(".drive_command", "DriveCommand", "send a maneuver's cues to such a controller"),
    "demonstrate": Command(
        ".demonstrate_command",
        "DemonstrateCommand",
        "record drives of a controller to learn from",
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
    return f"interrupted; drives that are done are kept, and the same command{fresh} goes on"


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


def _complain(program: str, message: str, status: int) -> int:
    print(f"{program}: {' '.join(message.split())}", file=sys.stderr)
    return status


def _dispatch(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        return SUCCESS if arguments else BAD_ARGUMENTS
    if arguments[0] == "--version":
        from ..envs.provenance import package_version

        print(f"{PROGRAM} {package_version()}")
        return SUCCESS
    name, rest = arguments[0], arguments[1:]
    command = look_up("command", name, COMMANDS)
    module = import_module(command.module, __package__)
    parsed = _parse(name, getattr(module, command.arguments), rest)
    return parsed if isinstance(parsed, int) else int(module.run(parsed))


def overview() -> str:
    """The help of the command without a subcommand."""
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
            f"`{PROGRAM} COMMAND --help` shows the options of a command, `{PROGRAM} --version` the version.",
        ]
    )


def _parse(name: str, arguments: type[Any], rest: list[str]) -> Any:
    """The dataclass filled from the arguments, or the exit status after ``--help``."""
    import tyro

    _refuse_repeated(arguments, rest)
    _refuse_nothing(arguments, rest)
    complaint, shown = io.StringIO(), io.StringIO()
    try:
        with redirect_stderr(complaint), redirect_stdout(shown):
            return tyro.cli(arguments, prog=f"{PROGRAM} {name}", args=rest)
    except SystemExit as stop:
        if not stop.code:
            print(plain_help(shown.getvalue()), end="")
            return SUCCESS
        told = plain_complaint(complaint.getvalue())
        raise ConfigurationError(f"{told} See `{PROGRAM} {name} --help`") from None


def _refuse_repeated(arguments: type[Any], rest: list[str]) -> None:
    """Tyro keeps only the last of repeated lists: say so instead of dropping names."""
    for option in dataclasses.fields(arguments):
        flag = "--" + option.name.replace("_", "-")
        times = sum(word == flag or word.startswith(flag + "=") for word in rest)
        if times > 1 and "Append" not in str(option.type):
            raise ConfigurationError(
                f"{flag} is given {times} times; give it once, with all its values after it"
            )


def _refuse_nothing(arguments: type[Any], rest: list[str]) -> None:
    """Tyro takes an option without its names for an empty list, which may be the default."""
    if "--help" in rest:
        return
    for option in dataclasses.fields(arguments):
        flag = "--" + option.name.replace("_", "-")
        if not isinstance(option.default, tuple) or flag not in rest:
            continue
        after = rest[rest.index(flag) + 1 :]
        if not after or after[0].startswith("--"):
            raise ConfigurationError(f"{flag} needs at least one name or file after it")
