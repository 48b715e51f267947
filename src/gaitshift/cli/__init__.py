"""The command `gaitshift`: a thin shell over the package, one file a subcommand."""

from gaitshift.cli.app import main as main
