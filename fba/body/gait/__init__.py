"""Walking: synthesis from four characteristic poses, and detection of these in captured motion.

The source: K. Karpouzis, Adaptive parametric models of human faces and bodies (thesis, National Technical
University of Athens), chapter 5. `walk` makes an `Animation`, `characters` lists the characters, `detect`
finds cycles and poses in any body animation, `reduce` keeps only these poses.
"""

from fba.body.gait._characters import POSES, Character, Pose, characters
from fba.body.gait._detection import Cycle, Gait, Step, detect
from fba.body.gait._measure import Soles, advance, soles
from fba.body.gait._reduction import Errors, Reduced, compare_walks, reduce
from fba.body.gait._synthesis import walk

__all__ = [
    "POSES", "Character", "Cycle", "Errors", "Gait", "Pose", "Reduced", "Soles", "Step", "advance",
    "characters", "compare_walks", "detect", "reduce", "soles", "walk",
]  # fmt: skip
