"""Outlines: motion found again from plain pictures, by the shape of a figure against its background.

    index = build_index([("walk", fba.read("walk.fba"))], Choice(views=24, every=5))
    index.save("walk.outlines")
    hits = index.search(read_mask("picture.png"))           # the nearest first: stream, frame, side

A silhouette becomes a medial axis with radii (Blum 1967; Siddiqi et al. 2002), whose nodes are compared by
the earth mover's distance; of the nearest ones, the outlines themselves are compared. The l1 embedding of
trees that this stands in for, and other baselines, are here, too: `methods` lists them. After: E. Ayan,
Emotional facial animation by motion capture, chapter 4 (thesis, Bilkent University). May use: faces and
bodies, which it draws itself, without OpenGL.
"""

from fba.outlines._figure import Figure
from fba.outlines._index import Choice, Hit, Index, build_index, follow, nearest
from fba.outlines._mask import fit_mask, read_mask
from fba.outlines._methods import Method, earth_movers_distance, lower_bounds, methods, outline_distances
from fba.outlines._raster import View, draw_silhouette
from fba.outlines._sheet import draw_sheet
from fba.outlines._tree import Nodes, Tree, build_tree, embed_l1, embed_l2, find_nodes

__all__ = [
    "Choice", "Figure", "Hit", "Index", "Method", "Nodes", "Tree", "View", "build_index", "build_tree",
    "draw_sheet", "draw_silhouette", "earth_movers_distance", "embed_l1", "embed_l2", "find_nodes",
    "fit_mask", "follow", "lower_bounds", "methods", "nearest", "outline_distances", "read_mask",
]  # fmt: skip
