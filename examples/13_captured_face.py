"""Markers on a face (C3D) to FAPs: who was captured, what markers tell, and the stream that it becomes."""

from pathlib import Path

import fba
from fba.capture import from_markers
from fba.capture.markers import find_face
from fba.formats import read_face

path = Path(fba.__file__).parent / "samples" / "talk.c3d"  # made by a script in the form of a capture
motion = read_face(path)
face = find_face(motion)
eyes, opening = (1024e3 * unit for unit in (face.fapu.ES, face.fapu.IRISD))
print(f"{len(motion.names)} markers, found by {face.found_by}; {len(face.sent)} FAPs can be told")
print(f"the actor's eyes are {eyes:.0f} mm apart and {opening:.1f} mm open")

animation = from_markers(motion, rate=25)  # the same as fba.read(path, rate=25)
Path("out").mkdir(exist_ok=True)
fba.write("out/talk.fba", animation, bap_steps="visage")
info = fba.probe("out/talk.fba", bap_steps="visage")
print(f"{path.stat().st_size} bytes of C3D became {info.size}: {info.bits_per_second / 1000:.2f} kbit/s")
