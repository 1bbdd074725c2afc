"""The machine in a browser: what a page draws, the page itself, and a server for pages that are live.

three.js 0.187 draws it; ``three.entry.mjs`` says how ``three.iife.min.js`` is made of its package.
"""

from .motion import pack_view
from .page import render_view, save_view
from .scene import scene_of

__all__ = ["pack_view", "render_view", "save_view", "scene_of"]
