"""Registries: policies, maneuvers, platforms, cars and algorithms by name, open to other packages.

A name is registered by a call, or by an entry point of an installed package::

    [project.entry-points."motion_cueing.policies"]
    my-controller = "my_package.controller:make"

Items may be given as ``"module:attribute"``. Such a module is imported when its item is asked for, so that a
list of names costs no import.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, Generic, TypeVar

from .errors import ConfigurationError, UnknownNameError

T = TypeVar("T")


@dataclass
class _Entry:
    """One name: its description, and its item or ``"module:attribute"``."""

    item: Any
    description: str


class Registry(Generic[T]):
    """Items of one kind by name.

    Args:
        kind: What is registered, for messages: "policy".
        group: Group of entry points by which installed packages take part: "motion_cueing.policies".
        renamed: Names of earlier versions and what they are called now.
        extra: Extra of this project whose libraries the items need, for messages.
    """

    def __init__(
        self, kind: str, group: str, renamed: Mapping[str, str] | None = None, extra: str = ""
    ) -> None:
        self.kind, self.group, self.extra = kind, group, extra
        self.renamed = dict(renamed or {})
        self._entries: dict[str, _Entry] = {}
        self._discovered = False

    def register(self, name: str, item: T | str, description: str = "", *, replace: bool = False) -> None:
        """Give an item a name, which every command and configuration then knows.

        Args:
            name: Its name.
            item: The item, or ``"module:attribute"`` where to find it.
            description: One line for lists.
            replace: Whether a name that is taken is given to the new item.

        Raises:
            ConfigurationError: the name is empty, looks like a file, or is taken.
        """
        if not isinstance(name, str) or not name or any(mark in name for mark in "/\\. \t\n"):
            raise ConfigurationError(
                f"{self.kind}: the name {name!r} is not one word without dots and slashes, "
                f"such as 'my-{self.kind}'"
            )
        if name in self._entries and not replace:
            raise ConfigurationError(
                f"{self.kind} {name!r} is registered already; choose another name or pass replace=True"
            )
        self._entries[name] = _Entry(item, description)

    def names(self) -> list[str]:
        """All names, in the order of registration."""
        self._discover()
        return list(self._entries)

    def description(self, name: str) -> str:
        """One line about an item."""
        return self._entry(name).description

    def __contains__(self, name: object) -> bool:
        self._discover()
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __getitem__(self, name: str) -> T:
        """The item of a name.

        Raises:
            UnknownNameError: it is not registered; the message has near names, or the new name.
            ConfigurationError: the module of the item cannot be imported.
        """
        entry = self._entry(name)
        if isinstance(entry.item, str):
            module, _, attribute = entry.item.partition(":")
            try:
                entry.item = getattr(import_module(module), attribute)
            except ModuleNotFoundError as error:
                hint = f": pip install 'motion-cueing-gym[{self.extra}]'" if self.extra else ""
                raise ConfigurationError(
                    f"{self.kind} {name!r} needs {error.name}, which is not installed{hint}"
                ) from error
            except (ImportError, AttributeError) as error:
                raise ConfigurationError(
                    f"{self.kind} {name!r}: {entry.item} cannot be loaded ({error})"
                ) from error
        return entry.item  # type: ignore[no-any-return]

    def make(self, name: str) -> Any:
        """The item of a name; where that is a class or a function, what it makes."""
        item: Any = self[name]
        return item() if callable(item) else item

    def _entry(self, name: str) -> _Entry:
        self._discover()
        if name not in self._entries:
            raise UnknownNameError(self.kind, str(name), self._entries, self.renamed)
        return self._entries[name]

    def _discover(self) -> None:
        """Take the entry points of installed packages in, once; names of this project keep their items."""
        if self._discovered:
            return
        self._discovered = True
        for point in entry_points(group=self.group):
            package = point.dist.name if point.dist else "another package"
            if point.name not in self._entries:
                self.register(point.name, point.value, f"from {package}")
