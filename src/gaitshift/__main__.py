"""`python -m gaitshift` is the command `gaitshift`."""

from gaitshift.cli import main

main()
