"""Whether pictures can be drawn: exits with 3 where there is no OpenGL."""

import sys

from fba.errors import DisplayError
from fba_player.gl._context import offscreen_context

try:
    offscreen_context().release()
except DisplayError as error:
    print(f"no OpenGL, so no pictures: {error}")
    sys.exit(3)
