"""`python -m warpsph` is the command `warpsph`."""

import sys

from .cli.main import main

sys.exit(main())
