"""``python -m romgen`` is the command ``romgen``."""

from romgen.cli.app import main

main()
