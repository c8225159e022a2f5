"""The command ``romgen``, one file per subcommand."""
