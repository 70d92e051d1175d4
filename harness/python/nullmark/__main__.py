"""python3 -m nullmark serve FILE [NAME]"""

import sys

from .serving import serve

if len(sys.argv) not in (3, 4) or sys.argv[1] != "serve":
    print("usage: python3 -m nullmark serve FILE [NAME]", file=sys.stderr)
    sys.exit(2)
serve(*sys.argv[2:])
