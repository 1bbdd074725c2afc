"""The command line ``motion-cueing``: a command is a dataclass and a ``run`` in a module of its own."""
