"""Virtual markers: captured markers move any mesh, each the vertices around the one that it is paired with.

A deformer beside FaceDefTables, for heads that know nothing of FAPs. May use: faces, captured markers.
"""

from fba.capture.virtual_markers._heads import MarkedHead, head_of_model, read_head
from fba.capture.virtual_markers._mapping_files import read_mapping, write_mapping
from fba.capture.virtual_markers.influence import Influence, find_influence
from fba.capture.virtual_markers.mapping import MarkerMapping, VirtualMarker
from fba.capture.virtual_markers.performance import MarkerPerformance, move_head
from fba.capture.virtual_markers.proposal import propose_mapping

__all__ = [
    "Influence", "MarkedHead", "MarkerMapping", "MarkerPerformance", "VirtualMarker", "find_influence",
    "head_of_model", "move_head", "propose_mapping", "read_head", "read_mapping", "write_mapping",
]  # fmt: skip
