"""The command line; the only room that prints."""

from auvdock.cli.main import main

__all__ = ["main"]
