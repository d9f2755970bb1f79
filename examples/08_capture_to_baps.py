"""Motion capture (BVH) to BAPs, how close the bones come, and the stream that it becomes."""

from pathlib import Path

import fba
from fba.capture import from_skeleton, retarget_report
from fba.formats import read_motion

path = Path(fba.__file__).parent / "samples" / "hello.bvh"  # made by a script in the form of a capture
motion = read_motion(path)
animation = from_skeleton(motion)  # the same as fba.read(path)

report = retarget_report(motion, animation)
worst = max(report.bones, key=lambda bone: bone.worst)
print(f"{len(report.bones)} bones, {report.mean:.3f} degrees from the source's on average")
print(f"worst: {worst.joint} - {worst.aim}, {worst.worst:.2f} degrees in frame {worst.frame}")

Path("out").mkdir(exist_ok=True)
fba.write("out/hello_body.fba", animation.resample(25), bap_steps="visage")
info = fba.probe("out/hello_body.fba", bap_steps="visage")
print(f"{path.stat().st_size} bytes of BVH became {info.size}: {info.bits_per_second / 1000:.2f} kbit/s")
print(f"decoded again: {len(fba.read('out/hello_body.fba', bap_steps='visage'))} frames")
