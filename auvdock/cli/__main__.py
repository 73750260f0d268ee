"""`python -m auvdock.cli`."""

import sys

from auvdock.cli.main import main

sys.exit(main())
