"""A module that cannot be imported, because it ends the program."""

import sys

sys.exit(1)
