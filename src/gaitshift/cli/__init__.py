"""The command `gaitshift`: a thin layer over the package, with one file per subcommand."""

from gaitshift.cli.app import main as main
