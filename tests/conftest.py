"""Windows open on SDL's driver without a screen, and no property test has a deadline."""

from __future__ import annotations

import os

from hypothesis import settings

os.environ["SDL_VIDEODRIVER"] = "dummy"

# A test never times: on a busy machine Hypothesis' own 200 ms would fail one at random.
settings.register_profile("motion-cueing", deadline=None)
settings.load_profile("motion-cueing")
