"""Mutation run: changes one decision of the code at a time and prints the changes that no test notices.

    python tools/mutate.py              all mutants
    python tools/mutate.py codec bvh    those whose file's path holds one of the words

Every mutant is tried in a copy of the checkout, so the checkout itself is never changed. Exits with 1 where a
mutant survives.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FOLDERS = ("fba", "player", "conformance", "tests", "docs")
LIMIT = 300
"""Seconds for the tests of one mutant; a mutant that never ends is found, too."""


class Mutant(NamedTuple):
    """One change: the text `old`, which stands once in the file, becomes `new`; `tests` are to notice it."""

    file: str
    old: str
    new: str
    tests: str


CLOCK = "fba/codec/_stream/clock.py"
TIME_BASE = "fba/codec/_time_base.py"
EMOTION = "fba/emotion"
RULES_TEST = "tests/emotion/test_mixing_rules.py"
EXPRESSIONS_TEST = "tests/emotion/test_named_expressions.py"
READING_TEST = "tests/emotion/test_read_expressions.py"
EXPRESS_TEST = "tests/cli/emotions/test_express.py"
FULL_TURNS = "fba/codec/_plane/full_turns.py"
RANGES = "fba/codec/_ranges.py"
HEADERS = "fba/codec/_headers.py"
RUNS = "fba/codec/_runs.py"
QUANTISER = "fba/codec/_plane/quantiser.py"
ENCODER = "fba/codec/_encoder.py"
SETTINGS = "fba/codec/settings.py"
BVH = "fba/formats/bvh/reader.py"
RATES = "fba/formats/text/frame_rates.py"
RECOGNITION = "fba/recognition.py"
MATCHING = "fba/capture/matching.py"
RETARGET = "fba/capture/retarget.py"
PLANTING = "fba/capture/limbs/foot_planting.py"
WEIGHTS = "fba/body/skin/skin_weights.py"
TRANSPORT = "player/fba_player/playback/transport.py"
TIMELINE = "player/fba_player/playback/timeline.py"
LIVE = "player/fba_player/playback/live.py"
MIXER = "player/fba_player/sound/_mixer.py"
DEVICE_CLOCK = "player/fba_player/sound/_device_clock.py"
GROUND = "fba/body/ground.py"
PLACEMENT = "player/fba_player/scene/point_placement.py"
SESSION = "player/fba_player/session/session.py"
TAKES = "player/fba_player/session/takes.py"
SOLES = "fba/capture/limbs/soles.py"
STANCE = "fba/body/stance.py"
BODY_ROWS = "fba/planning/body_rows.py"
BODY_SEARCH = "fba/planning/body_search.py"
BODY_TOLERANCE = "fba/planning/body_tolerance.py"
TOES = "fba/capture/limbs/toes.py"
RENDER = "player/fba_player/export/render.py"
GLTF_READER = "fba/formats/gltf/reader.py"
GLTF_SKELETONS = "fba/formats/gltf/_skeletons.py"
BODIES, OWN_HEADS = "fba/formats/gltf/bodies.py", "fba/formats/gltf/_own_heads.py"
OWN_HEAD = "fba/body/own_head.py"
FACE_MOTION, HUMANOID = "fba/formats/gltf/face_motion.py", "fba/formats/gltf/humanoid.py"
SHAPE_TABLE = "fba/capture/blendshapes/shape_table.py"
COMBINATION = "fba/capture/blendshapes/combination.py"
LIVELINK = "fba/formats/face_tables/_shape_rows.py"
SMPL, SMPL_TEST = "fba/formats/smpl/reader.py", "tests/formats/smpl/test_smpl_motion.py"
TIME_CODES, TIME_CODES_TEST = "fba/formats/time_codes.py", "tests/formats/test_time_codes.py"
SYNCHRONISATION = "fba/formats/synchronisation.py"
SYNCHRONISATION_TEST = "tests/formats/test_synchronisation.py"
VOICE_TEST = "tests/cli/captures/test_face_body_voice.py"
FACES, OPENFACE = "fba/formats/face_tables/_faces.py", "fba/formats/face_tables/openface.py"
LIVE_ORDER, PEOPLE = "fba/live/order.py", "fba/live/people.py"
RECORDING, LIVE_BONES = "fba/live/recording.py", "fba/live/protocols/unity_bones.py"
LIVE_FACES_TEST, VMC_TEST = "tests/capture/live/test_live_faces.py", "tests/capture/live/test_vmc.py"
STREAM_FILES_TEST = "tests/capture/live/test_stream_files.py -k 'not killed'"
UDP = "fba/formats/face_tables/livelink_udp.py"
ACTION_UNITS_TEST = "tests/formats/face_tables/test_action_units.py"
RECORDS_TEST = "tests/formats/face_tables/test_face_records.py"
INVERSION = "fba/capture/blendshapes/inversion.py"
LIVELINK_CSV = "fba/formats/face_tables/livelink_csv.py"
SHAPES_BACK_TEST = "tests/capture/faces/test_faps_to_shapes.py"
SAMPLING = "fba/capture/sampling.py"
MARKERS = "fba/capture/markers"
MARKERS_TEST = "tests/capture/test_from_markers.py"
POINTS, POINTS_TEST = "fba/capture/points", "tests/capture/test_from_points.py"
POINT_FILES = "fba/formats/face_tables"
POINT_TABLES_TEST = "tests/formats/face_tables/test_point_tables.py"
VIRTUAL = "fba/capture/virtual_markers"
VIRTUAL_TEST = "tests/capture/test_virtual_markers.py"
VIRTUAL_FILES_TEST = "tests/capture/test_virtual_marker_files.py"
MAP_PAGE_TEST = "tests/player/window/test_map_markers.py"
MARKER_FILES_TEST = "tests/formats/test_marker_files.py"
LIVELINK_TEST = "tests/formats/face_tables/test_livelink_csv.py"
SHAPES_TEST = "tests/capture/faces/test_shapes_to_faps.py"
BODIES_TEST = "tests/formats/gltf/test_foreign_bodies.py"
HEADS_TEST = "tests/formats/gltf/test_own_heads.py"
FACES_TEST = "tests/formats/gltf/test_face_motion.py"
DECLARED_TEST = "tests/formats/gltf/test_declared_bones.py"
FIGURE = "fba/capture/comparison/figure.py"
POSE_MEASURES = "fba/capture/comparison/pose_measures.py"
PATH_MEASURES = "fba/capture/comparison/path_measures.py"
NAMED_BONES = "fba/capture/_named_bones.py"
STANDING = "fba/capture/_standing.py"
MEASUREMENT = "fba/capture/comparison/measurement.py"
VERDICT = "fba/capture/comparison/verdict.py"
BOUNDS = "fba/capture/comparison/thresholds.csv"
REPORT = "fba/capture/_report.py"
FOOTING = "fba/body/footing.py"
PREPARATION = "fba/capture/preparation.py"
UP_AXIS = "fba/capture/_up_axis.py"
REST_CHOICE = "fba/capture/_rest_choice.py"
BONES = "fba/capture/bones.py"
SPINE = "fba/capture/_spine.py"
FOUND_REST = "fba/capture/_rest_from_motion.py"
REST_CORRECTION = "fba/capture/_rest_correction.py"
STANDARD = "fba/capture/_standard_skeleton.py"
FAP_JOINTS = "fba/formats/gltf/_fap_joints.py"
HINGES = "fba/capture/limbs/hinges.py"
HINGE_PATH = "fba/capture/limbs/_hinge_path.py"
WRINGING = "fba/capture/comparison/wringing.py"
LEG_IK = "fba/capture/limbs/_leg_ik.py"
READ_AHEAD = "player/fba_player/sound/_read_ahead.py"
PLAUSIBILITY = "fba/body/plausibility.py"
ROUND_ANGLES = "fba/body/_round_angles.py"
SLIDING = "fba/body/_sliding.py"
HEAD_TURNS = "fba/body/_head_turns.py"
MARK = "fba/codec/_stream/mark.py"
STREAM_READER = "fba/codec/_stream_reader.py"
OBJECT_BORDERS = "fba/codec/_stream/object_borders.py"
GAIT_CURVES = "fba/body/gait/_signals.py"
GAIT_DETECTION = "fba/body/gait/_detection.py"
GAIT_MEASURE = "fba/body/gait/_measure.py"
DAMAGE = "fba/codec/_stream/damage.py"
RESTARTS = "fba/codec/_stream/restart_points.py"
PLANE_TIMES = "fba/codec/_stream/plane_times.py"
VALUES = "conformance/fba_conformance/values.py"
JUDGEMENT = "conformance/fba_conformance/suite/judgement.py"
TESTED = "conformance/fba_conformance/suite/programs.py"
PROGRAMS_TEST = "tests/conformance/test_programs.py"

LOSS_TEST = "tests/codec/test_loss.py"
DAMAGE_TEST = "tests/codec/test_damage.py"
TIMES_TEST = "tests/codec/test_codec_rules.py"
CHUNKS_TEST = "tests/codec/test_incremental.py"
FULL_TURNS_TEST = "tests/codec/test_full_turns.py"
COMPARISON_TEST = "tests/capture/test_comparison.py"
RANGES_TEST = "tests/codec/test_codec_rules.py tests/codec/test_limits.py"
BVH_TEST = "tests/formats/bvh/test_bvh_rates.py"
BVH_READING_TEST = "tests/formats/bvh/test_bvh.py"
TEXT_TEST = "tests/formats/text/test_frame_rates.py"
RECOGNITION_TEST = "tests/test_recognition.py"
CAPTURE_TEST = (
    "tests/capture/test_capture_rules.py tests/capture/test_planting.py tests/capture/test_retargeting.py"
)
PLANTING_TEST = "tests/capture/test_planting.py"
PREPARATION_TEST = "tests/capture/test_rest_poses.py"
ZOO_TEST = "tests/capture/zoo"
WEIGHTS_TEST = "tests/body/skin/test_skin_weights.py"
TRANSPORT_TEST = "tests/player/playback/test_transport.py"
NOTICES_TEST = "tests/player/session/test_notices.py"
TAKES_TEST = "tests/player/session/test_puppet.py"
RENDER_TEST = "tests/player/export/test_render_files.py -k rounded"
FRAMING_TEST = "tests/player/scene/test_framing.py"
JOINT_MAPS_TEST = "tests/cli/captures/test_joint_maps.py"
FACE_MOTION_TEST = "tests/formats/gltf/test_face_motion.py"
GLTF_TEST = "tests/formats/gltf/test_gltf_skeletons.py"
OTHER_BODIES_TEST = "tests/capture/test_other_bodies.py"
LIVE_TEST = "tests/player/playback/test_live.py"
MIXER_TEST = "tests/player/sound/test_sound_mixer.py"
DEVICE_CLOCK_TEST = "tests/player/sound/test_sound_clock.py"
CAPTURE_RULES_TEST = "tests/capture/test_capture_rules.py"
AUDIO_TEST = "tests/player/sound/test_audio.py -k in_advance"
PLAUSIBLE_TEST = "tests/body/test_plausibility.py -k 'limits or twenty or carry or underground or slide'"
MOMENT_TEST = "tests/body/test_plausibility.py -k moment"
JUMP_TEST = "tests/body/test_plausibility.py -k jump"
STEP_CHOICE_TEST = "tests/formats/test_step_choice.py -k 'round or coarse'"
SLIDE_TEST = "tests/formats/test_step_choice.py -k 'slide or sways'"
ORIGIN_TEST = "tests/formats/test_step_choice.py -k origin"
TRANSPARENCY_TEST = "tests/player/gl/test_transparency.py"
WRINKLES_TEST = "tests/player/figure/test_wrinkles.py"
REST_TEST = "tests/persona/test_persona_points.py"
EMOTE_TEST = "tests/emotion/test_emotional_modification.py"
PERSONA_RULE, PERSONA_POINTS = "fba/persona/recognition/rule.py", "fba/persona/points/registration.py"
PERSONA_TESTS = "tests/persona/test_persona_points.py tests/persona/test_persona_recognition.py"
PERSONA_USE = "tests/persona/test_persona_learning.py"
STRIP_TEST = "tests/player/session/test_emotion_trace.py"
HEAD_TURN_TEST = "tests/formats/test_step_choice.py -k head"
MEASURED_TEST = "tests/body/gait/test_measured.py"
STRIPS_TEST = "tests/mesh/test_ply.py -k strips"
MARK_TEST = "tests/codec/test_mark.py"
LONG_TEST = "tests/body/test_plausibility.py -k long_motion"
GAIT_TEST = "tests/body/gait/test_gait_rules.py"
FOREIGN_HEADS_TEST = "tests/face/importers/test_foreign_heads.py"
DRAWN_TEST = "tests/face/importers/test_drawn_heads.py"
CLEARANCE_TEST = "tests/face/importers/test_teeth_clearance.py"
JOINING_TEST = "tests/face/importers/test_joining.py"
HEAD_ZOO_TEST = "tests/face/importers/test_head_zoo.py -k 'same or surfaces'"
PACKED_TEST = "tests/gltf/test_gltf_packed.py"
SURFACE_TEST = "tests/face/importers/test_head_surface.py"
PLACEMENT_TEST = "tests/player/scene/test_point_placement.py"
VERDICT_TEST = "tests/cli/test_model.py -k verdicts"

PLANS_TEST = "tests/planning/test_plans.py"
FIT_PLANS_TEST = "tests/planning/test_fit_plans.py"
FIT_TEST = "tests/face/learning/test_learn_fit.py"
FIT_STREAMS_TEST = "tests/planning/test_fit_streams.py"
REGRESSION = "fba/face/learning/_regression.py"
RATE_BUCKET, RATE_ENCODER = "fba/planning/rate/bucket.py", "fba/planning/rate/encoder.py"
LIVE_ENCODER, LIVE_TEST = "fba/planning/live_encoder.py", "tests/planning/test_live_encoder.py"
PRICING, RATE_TEST = "fba/codec/_plane/pricing.py", "tests/planning/test_rate_control.py"
PATHS, PATHS_TEST = "fba/planning/paths.py", "tests/planning/test_paths.py"
FACE_SEARCH, MESH_ERROR = "fba/planning/face_search.py", "fba/planning/mesh_error.py"
FACE_TOLERANCE_TEST = "tests/planning/test_face_tolerance.py"
BODY_TOLERANCE_TEST = "tests/planning/test_body_tolerance.py"
DISPLACEMENT_TEST = "tests/body/test_displacement.py"

MUTANTS = (
    Mutant(PERSONA_RULE, "LEAST = 0.1", "LEAST = 0.08", PERSONA_TESTS),
    Mutant(PERSONA_RULE, "SECOND = 0.6", "SECOND = 0.58", PERSONA_TESTS),
    Mutant(PERSONA_POINTS, "np.radians(30.0)", "np.radians(32.0)", PERSONA_TESTS),
    Mutant(PERSONA_POINTS, "cosine * laid[..., 0] - sine * deep", "laid[..., 0]", PERSONA_TESTS),
    Mutant(PERSONA_POINTS, "MISFIT = 0.25", "MISFIT = 1.25", PERSONA_TESTS),
    Mutant("fba/persona/performance.py", "EASE = 2", "EASE = 3", PERSONA_USE),
    Mutant("fba/persona/learning.py", ".min()) >= least", ".min()) >= 0", PERSONA_USE),
    Mutant("fba/persona/learning.py", "REST = 1.5", "REST = 0.0", PERSONA_USE),
    Mutant(REGRESSION, "RIDGE = 1e-3", "RIDGE = 1e-1", FIT_TEST),
    Mutant(REGRESSION, "if most - len(chosen) <= len(lacking):", "if False:", FIT_TEST),
    Mutant(REGRESSION, "= 1.0", "= 0.999", FIT_TEST),
    Mutant(REGRESSION, ".astype(np.float32)", "", FIT_TEST),
    Mutant("fba/face/learning/learn.py", "if i not in fold)", "if True)", FIT_TEST),
    Mutant("fba/face/learning/learn.py", "if poses <= count:", "if poses < count:", FIT_TEST),
    Mutant("fba/face/learning/reduction.py", "[moves[columns] for columns in donors()]", "[moves]", FIT_TEST),
    Mutant(
        "fba/face/learning/reduction.py",
        "mask[:, _copies(values, mask, linked)] = False",
        "pass",
        FIT_STREAMS_TEST,
    ),
    Mutant("fba/planning/fit_streams.py", "(linked, ~linked):", "(linked | ~linked,):", FIT_STREAMS_TEST),
    Mutant("fba/planning/fit_streams.py", 'keep_masks=("face",)', "keep_masks=()", FIT_STREAMS_TEST),
    Mutant(LIVE_ENCODER, "WIDER = 2", "WIDER = 1", LIVE_TEST),
    Mutant(LIVE_ENCODER, "(self._seen > self.limits)", "(self._seen > self.limits + 60)", LIVE_TEST),
    Mutant(LIVE_ENCODER, "used[related] = used[related].any()", "pass", LIVE_TEST),
    Mutant(LIVE_ENCODER, "if own[list(few)].all()", "if True", LIVE_TEST),
    Mutant(LIVE_ENCODER, "> FAR).any()", "> 9).any()", LIVE_TEST),
    Mutant(LIVE_ENCODER, "mask = self._sent & ~interpolated", "mask = face.mask", LIVE_TEST),
    Mutant(RATE_BUCKET, "max(0.0, self.level - ", "(self.level - ", RATE_TEST),
    Mutant(RATE_BUCKET, "self.peak = max(self.peak, self.level)", "self.peak = self.level", RATE_TEST),
    Mutant(RATE_ENCODER, "if bits <= room or price == HOLD:", "if True:", RATE_TEST),
    Mutant(RATE_ENCODER, "        if over > 0:\n", "        if over > 1e9:\n", RATE_TEST),
    Mutant(
        RATE_ENCODER,
        "        if bits + self._spare > self.bucket.room:\n            return None\n",
        "",
        RATE_TEST,
    ),
    Mutant(
        RATE_ENCODER,
        "            late, self._late = self._late, None\n",
        "            return b''\n",
        RATE_TEST,
    ),
    Mutant(
        "fba/planning/rate/search.py", "if distance < least:", "if distance > least or not best:", RATE_TEST
    ),
    Mutant("fba/planning/rate/expectations.py", "FAST_FAPS] = FAST", "FAST_FAPS] = SLOW", RATE_TEST),
    Mutant(
        PRICING,
        "math.isinf(price):\n        return 0",
        "math.isinf(price):\n        return nearest",
        RATE_TEST,
    ),
    Mutant("fba/planning/plan.py", "    if not any(used):", "    if True:", PLANS_TEST),
    Mutant(PATHS, "total = sums[i] + cost[change + low]", "total = sums[i]", PATHS_TEST),
    Mutant(PATHS, "highest = min(highest, (upper", "highest = max(highest, (upper", PATHS_TEST),
    Mutant(PATHS, "JERK_BITS = 12.0", "JERK_BITS = 0.0", PATHS_TEST),
    Mutant(PATHS, "np.rint((lower + upper) / 2)", "np.rint(lower)", PATHS_TEST),
    Mutant(FACE_SEARCH, "self.limit[beyond] *=", "self.limit[beyond] +=", FACE_TOLERANCE_TEST),
    Mutant(MESH_ERROR, "tolerance.head if head else tolerance.gaze", "tolerance.head", FACE_TOLERANCE_TEST),
    Mutant(MESH_ERROR, "np.maximum(lowest, self._lowest[near[0]])", "lowest", FACE_TOLERANCE_TEST),
    Mutant(
        "fba/planning/near_lossless.py",
        "moving[list(related)] = moving[list(related)].any()",
        "pass",
        FACE_TOLERANCE_TEST,
    ),
    Mutant(
        "fba/planning/near_lossless.py",
        "    if track.mask[:, :2].any():",
        "    if False:",
        FACE_TOLERANCE_TEST,
    ),
    Mutant(
        "fba/face/deform/_displacement_loops.py",
        "                scratch.pose[:, 3] = 0",
        "                pass",
        FACE_TOLERANCE_TEST,
    ),
    Mutant("fba/planning/plan.py", "moves[list(related)].any()", "moves[list(related)]", PLANS_TEST),
    Mutant("fba/planning/plan.py", "bits + intra_bits, cuts)\n    face", "bits, cuts)\n    face", PLANS_TEST),
    Mutant("fba/planning/segments.py", "            earliest = last", "            pass", PLANS_TEST),
    Mutant(
        BODY_SEARCH, "np.maximum(target.longest(base, rows), effort.gap_share)", "5.0", BODY_TOLERANCE_TEST
    ),
    Mutant(BODY_ROWS, "tolerances[block, 1:][stands.T] = ", "tolerances[:0, :1] = ", BODY_TOLERANCE_TEST),
    Mutant(BODY_ROWS, "        if low > high:", "        if False:", BODY_TOLERANCE_TEST),
    Mutant(
        "fba/planning/joint_reduction.py",
        "if off[joint] <= share",
        "if off[joint] <= 9 * share",
        BODY_TOLERANCE_TEST,
    ),
    Mutant(
        BODY_TOLERANCE, "if quant == 1 or (within and kept):", "if quant == 1 or within:", BODY_TOLERANCE_TEST
    ),
    Mutant(
        BODY_TOLERANCE,
        "            if errors.is_within(tolerance):",
        "            if True:",
        BODY_TOLERANCE_TEST,
    ),
    Mutant("fba/body/displacement.py", "REACH = 0.03", "REACH = 0.02", DISPLACEMENT_TEST),
    Mutant("fba/body/displacement.py", "np.where(stands.T, soles, 0.0)", "soles", DISPLACEMENT_TEST),
    Mutant(
        "fba/planning/derived_faps.py", "better = shown & (own < least)", "better = own < least", PLANS_TEST
    ),
    Mutant(
        "fba/codec/code_length.py",
        "2 * RANGE_CODE_MAX * RANGE_UNIT + 1",
        "RANGE_CODE_MAX",
        "tests/codec/test_code_lengths.py",
    ),
    Mutant("fba/codec/_encoder.py", "codes[:2] = own.codes[:2]", "codes[:0] = own.codes[:0]", PLANS_TEST),
    Mutant("fba/codec/quantisation.py", "divisor % scale == 0 and", "", PLANS_TEST),
    Mutant("fba/planning/fit_faps.py", "self.given | self.needed", "self.given", FIT_PLANS_TEST),
    Mutant("fba/planning/fit_faps.py", "(values % step != 0) | ", "", FIT_PLANS_TEST),
    Mutant(
        "fba/codec/quantisation.py", "np.where(intra[1:, None], 0, values[:-1])", "values[:-1]", PLANS_TEST
    ),
    Mutant("fba/codec/code_length.py", "IMPOSSIBLE_BITS = 1e9", "IMPOSSIBLE_BITS = 0.0", PLANS_TEST),
    Mutant(
        "fba/cli/coding/coded_streams.py",
        '"compact" if inputs.has_captured_face else "exact"',
        '"exact"',
        "tests/cli/test_presets.py",
    ),
    Mutant("fba/face/importers/assembly/landmarks.py", "UNLIKE = 1.3", "UNLIKE = 1.4", SURFACE_TEST),
    Mutant(
        "fba/face/importers/assembly/landmarks.py",
        "< size_left + size_right",
        "< size_left",
        SURFACE_TEST,
    ),
    Mutant("fba/gltf/nodes.py", "ROUNDED = 1e-6", "ROUNDED = 1e-4", "tests/gltf/test_gltf_reading.py"),
    Mutant(PLACEMENT, "FEWEST_FOR_GUESS = 4", "FEWEST_FOR_GUESS = 3", PLACEMENT_TEST),
    Mutant(PLACEMENT, "facing >= facing.max() - 0.2", "facing <= 9.0", PLACEMENT_TEST),
    Mutant(PLACEMENT, "else 100 if point.faps else 101", "else 100", PLACEMENT_TEST),
    Mutant("player/fba_player/view/geometry.py", "(away > 0)", "(away < 9e9)", PLACEMENT_TEST),
    Mutant("fba/cli/model_text.py", "if errors <= FAIR:", "if errors < FAIR:", VERDICT_TEST),
    Mutant("fba/gltf/_meshopt_loops.py", "return 0 if position == tail else -1", "return 0", PACKED_TEST),
    Mutant("fba/gltf/surfaces.py", "MOST_ABOVE = 8", "MOST_ABOVE = 2", FOREIGN_HEADS_TEST),
    Mutant("fba/face/importers/assembly/symmetry.py", "TOUCHING = 0.1", "TOUCHING = 0.0", HEAD_ZOO_TEST),
    Mutant(
        "fba/face/authoring/shapes/_mixing.py",
        "if mate is None or",
        "if mate or mate is None or",
        HEAD_ZOO_TEST,
    ),
    Mutant("fba/face/eyeball.py", "FLAT = 0.3", "FLAT = 0.7", DRAWN_TEST),
    Mutant("fba/face/importers/assembly/_teeth_clearance.py", "GAP = 0.0008", "GAP = -0.003", CLEARANCE_TEST),
    Mutant(
        "fba/face/importers/assembly/_teeth_clearance.py", "BRIDGINGS = 3", "BRIDGINGS = 0", CLEARANCE_TEST
    ),
    Mutant(
        "fba/face/importers/assembly/pieces.py", "SIDES_OF_EYE = 3", "SIDES_OF_EYE = 0", FOREIGN_HEADS_TEST
    ),
    Mutant("fba/face/importers/assembly/_atlas.py", "REPEATS = 4.0", "REPEATS = 400.0", JOINING_TEST),
    Mutant("fba/face/importers/assembly/_mouth_loop.py", "NEAR = 0.08", "NEAR = 0.8", DRAWN_TEST),
    Mutant("fba/face/importers/assembly/definitions.py", "LEAST = 0.004", "LEAST = -1.0", DRAWN_TEST),
    Mutant(
        "fba/face/importers/assembly/definitions.py",
        "target = _even(sides)[numbers_known - 1]",
        "pass",
        DRAWN_TEST,
    ),
    Mutant("fba/face/importers/_both_sides.py", "sum(ends) / 2", "0.0", DRAWN_TEST),
    Mutant(
        "fba/face/importers/assembly/_winding.py",
        "triangles[near], centre",
        "triangles, centre",
        FOREIGN_HEADS_TEST,
    ),
    Mutant("fba/face/importers/assembly/_profile.py", "CHIN = 0.3", "CHIN = 0.15", HEAD_ZOO_TEST),
    Mutant(
        "fba/face/importers/assembly/pieces.py", "middle = _middle(guessed)", "middle = 0.0", HEAD_ZOO_TEST
    ),
    Mutant("fba/face/importers/assembly/landmarks.py", "0.7, 0.02, 0.2", "0.7, 0.02, 0.9", HEAD_ZOO_TEST),
    Mutant("fba/face/importers/assembly/symmetry.py", "BETTER = 0.5", "BETTER = 1e-9", FOREIGN_HEADS_TEST),
    Mutant(
        "fba/face/importers/assembly/pieces.py",
        "SAME_HEIGHT = 0.25, 0.6",
        "SAME_HEIGHT = 0.25, 9.0",
        FOREIGN_HEADS_TEST,
    ),
    Mutant(
        "fba/face/authoring/regions/lids.py",
        "LEAST_SCULPTED = 0.08",
        "LEAST_SCULPTED = 8.0",
        FOREIGN_HEADS_TEST,
    ),
    Mutant(CLOCK, "DEFAULT_RATE = Fraction(25)", "DEFAULT_RATE = Fraction(30)", TIMES_TEST),
    Mutant(CLOCK, "math.ceil(now * rate)", "math.floor(now * rate)", TIMES_TEST),
    Mutant(CLOCK, "total_seconds < now", "total_seconds <= now", TIMES_TEST),
    Mutant(CLOCK, "* rate + Fraction(1, 2))", "* rate)", TIMES_TEST),
    Mutant(CLOCK, "max(nearest, self.index)", "nearest", TIMES_TEST),
    Mutant(CLOCK, "if not time_code.marker:", "if time_code.marker < 0:", TIMES_TEST),
    Mutant(CLOCK, "np.cumsum(skips + 1)", "np.cumsum(skips)", TIMES_TEST),
    Mutant(TIME_BASE, "or max(self._rates)", "or min(self._rates)", TIMES_TEST),
    Mutant(TIME_BASE, "COMMON_RATE_MAX = 1_000_000", "COMMON_RATE_MAX = 1_000", TIMES_TEST),
    Mutant(TIME_BASE, "math.lcm(self._exact.numerator", "math.gcd(self._exact.numerator", TIMES_TEST),
    Mutant(TIME_BASE, "offset += Fraction(1, 2)", "offset += Fraction(0)", TIMES_TEST),
    Mutant(SETTINGS, "sixteenths < 256 * 16", "sixteenths < 255 * 16", TIMES_TEST),
    Mutant(SETTINGS, "for offset in (0, 1):", "for offset in (1, 0):", TIMES_TEST),
    Mutant(SETTINGS, "RANGE_UNIT = 60", "RANGE_UNIT = 59", RANGES_TEST),
    Mutant(HEADERS, "_HOURS = 32", "_HOURS = 24", TIMES_TEST),
    Mutant(HEADERS, "index / rate + Fraction(1, 2))", "index / rate)", TIMES_TEST),
    Mutant(CLOCK, "seconds * rate + Fraction(1, 2))", "seconds * rate)", TIMES_TEST),
    Mutant(RUNS, "if all(sent):", "if any(sent):", RANGES_TEST),
    Mutant(RUNS, "slots.FACE_BIT else MASK_KEEP", "slots.FACE_BIT else MASK_INTERPOLATE", RANGES_TEST),
    Mutant(RUNS, "any(sent) else MASK_NONE", "any(sent) else MASK_KEEP", RANGES_TEST),
    Mutant(QUANTISER, "limit * step + (step - 1) // 2", "limit * step", RANGES_TEST),
    Mutant(RANGES, "RANGE_CODE_MAX, 0) + 1", "RANGE_CODE_MAX, 0)", RANGES_TEST),
    Mutant(QUANTISER, "(step - 1) // 2", "step // 2", RANGES_TEST),
    Mutant(RANGES, "<= RANGE_CODE_MAX", "< RANGE_CODE_MAX", RANGES_TEST),
    Mutant(
        ENCODER,
        "amounts > quantiser.ROUNDED_AMOUNT_MAX",
        "amounts >= quantiser.ROUNDED_AMOUNT_MAX",
        RANGES_TEST,
    ),
    Mutant(RANGES, "np.maximum(held, wanted)", "wanted", RANGES_TEST),
    Mutant(FIGURE, "unit(head - feet)[straight],", "unit(head - feet)[:0],", PREPARATION_TEST),
    Mutant(POSE_MEASURES, "between @ mean_rotation(between).T", "between", COMPARISON_TEST),
    Mutant(
        PATH_MEASURES, "np.maximum(ours - most, 0.0)", "np.maximum(ours - 9 * most, 0.0) * 0", COMPARISON_TEST
    ),
    Mutant(PATH_MEASURES, "np.median(own)) if level is None else level", "np.median(own))", COMPARISON_TEST),
    Mutant(PATH_MEASURES, "lowest = above if level is None else highest", "lowest = above", COMPARISON_TEST),
    Mutant(PATH_MEASURES, "(leaps > TEAR) & (leaps", "(leaps > 99 * TEAR) & (leaps", COMPARISON_TEST),
    Mutant(PATH_MEASURES, "SLIGHT_BEND = 0.12", "SLIGHT_BEND = 0.012", COMPARISON_TEST),
    Mutant(POSE_MEASURES, "- MOST_WRUNG, 0.0", "- 2 * MOST_WRUNG, 0.0", COMPARISON_TEST),
    Mutant(POSE_MEASURES, "frames @ level, result", "frames @ -level, result", COMPARISON_TEST),
    Mutant(MEASUREMENT, "turned[number] > MOVES", "turned[number] > 9 * MOVES", COMPARISON_TEST),
    Mutant(MEASUREMENT, "bounds()[row.name].hold * rate", "0 * rate", COMPARISON_TEST),
    Mutant(VERDICT, ">= limit.poor", "> 2 * limit.poor", COMPARISON_TEST),
    Mutant(VERDICT, ">= apart and one.part", ">= 0 and one.part", COMPARISON_TEST),
    Mutant(BOUNDS, "clavicle,degrees,0.2,20,25", "clavicle,degrees,0.2,20,35", COMPARISON_TEST),
    Mutant(FULL_TURNS, "np.cumsum(-np.rint", "np.cumsum(0 * np.rint", FULL_TURNS_TEST),
    Mutant(
        FULL_TURNS, "angles = misfits & angle_slots()", "angles = misfits & ~angle_slots()", FULL_TURNS_TEST
    ),
    Mutant(ENCODER, "nearest) <= lacking", "nearest) > lacking", FULL_TURNS_TEST),
    Mutant(ENCODER, "        if not self.options.clamp:\n            return row\n", "", FULL_TURNS_TEST),
    Mutant(RANGES, "if one_turn and abs", "if not one_turn and abs", FULL_TURNS_TEST),
    Mutant(
        "fba/animation.py", "> _HALF_TURN) & angles", "> 9 * _HALF_TURN) & angles", "tests/test_animation.py"
    ),
    Mutant(ENCODER, "> SKIP_MAX", ">= SKIP_MAX", RANGES_TEST),
    Mutant(BVH, "r.denominator > 1", "r.denominator < 1", BVH_TEST),
    Mutant(BVH, "> tolerance / 5", "> tolerance", BVH_TEST),
    Mutant(BVH, "if value > 1:", "if value > 9999:", BVH_TEST),
    Mutant(RATES, '("23.976", "23.98",', '("23.976",', TEXT_TEST),
    Mutant(RATES, "if rate <= 0:", "if rate < 0:", TEXT_TEST),
    Mutant(RECOGNITION, "CSV_LINES = 3", "CSV_LINES = 2", RECOGNITION_TEST),
    Mutant(RECOGNITION, "MASK_BITS, BODY_BITS = 60", "MASK_BITS, BODY_BITS = 70", RECOGNITION_TEST),
    Mutant(RECOGNITION, "60, 100", "60, 300", RECOGNITION_TEST),
    Mutant(RECOGNITION, "max(len(lines) // 2, 2)", "max(len(lines), 2)", RECOGNITION_TEST),
    Mutant(RECOGNITION, "head[4] >> 6 == 1", "head[4] >> 6 == 3", RECOGNITION_TEST),
    Mutant(RECOGNITION, "head[4] >> 4 == 2", "head[4] >> 4 == 15", RECOGNITION_TEST),
    Mutant(RECOGNITION, "range(2, 8)", "range(3, 8)", RECOGNITION_TEST),
    Mutant(MATCHING, "FEWEST = 5", "FEWEST = 6", CAPTURE_TEST),
    Mutant(MATCHING, "FEWEST = 5", "FEWEST = 4", CAPTURE_TEST),
    Mutant(MATCHING, "2 * count >= len(names) > 1", "2 * count > len(names) > 1", CAPTURE_TEST),
    Mutant(MATCHING, "mapped.setdefault(joint, number)", "mapped[joint] = number", CAPTURE_TEST),
    Mutant(PLANTING, "STEPS = 4", "STEPS = 3", CAPTURE_TEST),
    Mutant(PLANTING, "ROUNDS = 3", "ROUNDS = 0", CAPTURE_TEST),
    Mutant(RETARGET, "FOREARM_SHARE = 0.5", "FOREARM_SHARE = 0.0", CAPTURE_TEST),
    Mutant(RETARGET, "FOREARM_SPEED = 10.0", "FOREARM_SPEED = 20.0", CAPTURE_RULES_TEST),
    Mutant(RETARGET, "CLAVICLE_SHARE = 0.5", "CLAVICLE_SHARE = 0.1", CAPTURE_TEST),
    Mutant(WEIGHTS, "LEAST = 0.012", "LEAST = 0.0", WEIGHTS_TEST),
    Mutant(WEIGHTS, "LEAST = 0.012", "LEAST = 0.02", WEIGHTS_TEST),
    Mutant(WEIGHTS, "WEIGHT_TOLERANCE = 1e-3", "WEIGHT_TOLERANCE = 1e-2", WEIGHTS_TEST),
    Mutant(TRANSPORT, "AT_ONCE = 0.1", "AT_ONCE = 0.0", TRANSPORT_TEST),
    Mutant(TRANSPORT, "AT_ONCE = 0.1", "AT_ONCE = 1.0", TRANSPORT_TEST),
    Mutant(TRANSPORT, "BUFFER = 0.25", "BUFFER = 0.05", "tests/player/playback"),
    Mutant(TIMELINE, "FRAME_ROUNDING = 1e-6", "FRAME_ROUNDING = 0.0", "tests/player/playback"),
    Mutant(LIVE, "PATIENCE = 0.5", "PATIENCE = 0.0", LIVE_TEST),
    Mutant(LIVE, "PATIENCE = 0.5", "PATIENCE = 5.0", LIVE_TEST),
    Mutant(LIVE, "CHECK_BAP_STEPS_AFTER = 4", "CHECK_BAP_STEPS_AFTER = 1", LIVE_TEST),
    Mutant(LIVE, "CHECK_BAP_STEPS_AFTER = 4", "CHECK_BAP_STEPS_AFTER = 40", LIVE_TEST),
    Mutant(MIXER, "FADE = 0.004", "FADE = 0.001", MIXER_TEST),
    Mutant(MIXER, "FADE = 0.004", "FADE = 0.04", MIXER_TEST),
    Mutant(MIXER, "ROUNDING = 1e-7", "ROUNDING = 0.0", MIXER_TEST),
    Mutant(MIXER, "ROUNDING = 1e-7", "ROUNDING = 1e-2", MIXER_TEST),
    Mutant(MIXER, "SLIP = 0.002", "SLIP = 0.001", MIXER_TEST),
    Mutant(MIXER, "SLIP = 0.002", "SLIP = 0.004", MIXER_TEST),
    Mutant(DEVICE_CLOCK, "GAIN = 0.05", "GAIN = 0.0", DEVICE_CLOCK_TEST),
    Mutant(DEVICE_CLOCK, "GAIN = 0.05", "GAIN = 0.5", DEVICE_CLOCK_TEST),
    Mutant(DEVICE_CLOCK, "WINDOW = 10", "WINDOW = 1", DEVICE_CLOCK_TEST),
    Mutant(DEVICE_CLOCK, "JUMP = 0.05", "JUMP = 9.0", DEVICE_CLOCK_TEST),
    Mutant(DEVICE_CLOCK, "JUMP = 0.05", "JUMP = 0.001", DEVICE_CLOCK_TEST),
    Mutant(GLTF_READER, "STRETCH = 0.01", "STRETCH = 1.0", GLTF_TEST),
    Mutant(GLTF_READER, "STRETCH = 0.01", "STRETCH = 0.001", GLTF_TEST),
    Mutant(GLTF_READER, "> 0.95:", "> 0.85:", GLTF_TEST),
    Mutant(GLTF_READER, "> 0.95:", "> 0.99:", GLTF_TEST),
    Mutant(GLTF_READER, "DEFAULT_RATE = Fraction(30)", "DEFAULT_RATE = Fraction(25)", GLTF_TEST),
    Mutant(REPORT, "CLOSE = 0.01", "CLOSE = 0.02", OTHER_BODIES_TEST),
    Mutant(REPORT, "CLOSE = 0.01", "CLOSE = 0.005", OTHER_BODIES_TEST),
    Mutant(STANDARD, "EXACT = 1e-4", "EXACT = 1.0", OTHER_BODIES_TEST),
    Mutant(STANDARD, "np.radians(1.0)", "np.radians(30.0)", OTHER_BODIES_TEST),
    Mutant(MATCHING, "PREFIX_NAMES = 8", "PREFIX_NAMES = 7", CAPTURE_TEST),
    Mutant(MATCHING, "PREFIX_NAMES = 8", "PREFIX_NAMES = 9", CAPTURE_TEST),
    Mutant(GROUND, "LOWEST = 20", "LOWEST = 15", CAPTURE_TEST),
    Mutant(GROUND, "FAR = 0.15", "FAR = 0.13", CAPTURE_TEST),
    Mutant(GROUND, "FAR = 0.15", "FAR = 0.17", CAPTURE_TEST),
    Mutant(GROUND, "STEEPEST = 0.08", "STEEPEST = 0.06", CAPTURE_TEST),
    Mutant(GROUND, "STEEPEST = 0.08", "STEEPEST = 0.1", CAPTURE_TEST),
    Mutant(GROUND, "LONG = 1.0", "LONG = 0.7", CAPTURE_TEST),
    Mutant(GROUND, "LONG = 1.0", "LONG = 1.2", CAPTURE_TEST),
    Mutant(GROUND, "SLIGHT = 0.015", "SLIGHT = 0.008", CAPTURE_TEST),
    Mutant(GROUND, "SLIGHT = 0.015", "SLIGHT = 0.02", CAPTURE_TEST),
    Mutant(FOOTING, "0.008, 0.0745", "0.008, 0.06", CAPTURE_TEST),
    Mutant(GROUND, "Ground(level if level <= FAR", "Ground(level if abs(level) <= FAR", CAPTURE_TEST),
    Mutant(SPINE, 'TOP = "vt1"', 'TOP = "vt9"', PREPARATION_TEST),
    Mutant(PREPARATION, "LEAST = 0.5", "LEAST = 0.0", PREPARATION_TEST),
    Mutant(REST_CHOICE, "if turn > most:", "if turn > 9 * most:", ZOO_TEST),
    Mutant(BONES, "BACKWARDS = -0.5", "BACKWARDS = -2.0", ZOO_TEST),
    Mutant(UP_AXIS, "CLEAR_UP = 0.75", "CLEAR_UP = 1.1", PREPARATION_TEST),
    Mutant(UP_AXIS, "if stands and clear >= CLEAR_UP", "if clear >= CLEAR_UP", PREPARATION_TEST),
    Mutant(UP_AXIS, "not stands and axis[0] != 0", "False", PREPARATION_TEST),
    Mutant(
        STANDING, '"clavicles": 75.0,\n}\n"""Largest', '"clavicles": 180.0,\n}\n"""Largest', PREPARATION_TEST
    ),
    Mutant(NAMED_BONES, 'f != "middle"', "True", PREPARATION_TEST),
    Mutant(NAMED_BONES, "len(others) < len(legs)", "True", PREPARATION_TEST),
    Mutant(POSE_MEASURES, 'rest.tips.get(f"{side}_wrist", 2', 'rest.tips.get("", 2', COMPARISON_TEST),
    Mutant("player/fba_player/scene/_framing.py", "height + headroom - (", "height - (", FRAMING_TEST),
    Mutant(MEASUREMENT, "UNKNOWN_UNIT = 0.01", "UNKNOWN_UNIT = 1.0", JOINT_MAPS_TEST),
    Mutant(
        NAMED_BONES,
        "return {} if last else _numbered_limb",
        "return {} if True else _numbered_limb",
        ZOO_TEST,
    ),
    Mutant(NAMED_BONES, "if len(chains) != 1", "if not chains", PREPARATION_TEST),
    Mutant(GLTF_READER, "MANY = 10", "MANY = 11", FACE_MOTION_TEST),
    Mutant(GLTF_READER, "MANY = 10", "MANY = 9", FACE_MOTION_TEST),
    Mutant(GLTF_READER, "if person or joints is not None", "if joints is not None", FACE_MOTION_TEST),
    Mutant("fba/capture/comparison/standing.py", "RAISED = 0.3", "RAISED = 0.6", COMPARISON_TEST),
    Mutant(
        "player/fba_player/gl/_textures.py",
        "if not (self._solid or",
        "if False and not (self._solid or",
        TRANSPARENCY_TEST,
    ),
    Mutant(FIGURE, "STRAIGHT = 0.9", "STRAIGHT = 0.5", PREPARATION_TEST),
    Mutant(BVH, "CARRIED = 5.0", "CARRIED = 1.0", BVH_READING_TEST),
    Mutant(BVH, "CARRIED = 5.0", "CARRIED = 500.0", BVH_READING_TEST),
    Mutant(BVH, "return from_offset < away", "return False", BVH_READING_TEST),
    Mutant(GLTF_SKELETONS, "wanted = skinned | (moved & inside)", "wanted = skinned", GLTF_TEST),
    Mutant(FOUND_REST, "LOW_ARM = 0.6", "LOW_ARM = 2.0", PREPARATION_TEST),
    Mutant(REST_CORRECTION, "OWN_CLAVICLE = 5.0", "OWN_CLAVICLE = 90.0", PREPARATION_TEST),
    Mutant(BVH, "MOST_OF_BODY = 0.75", "MOST_OF_BODY = 2.0", ZOO_TEST),
    Mutant(STANCE, "HEEL = 0.045", "HEEL = 0.05", CAPTURE_TEST),
    Mutant(SOLES, "WITHIN = 0.012", "WITHIN = 0.01", CAPTURE_TEST),
    Mutant(SOLES, "TOLERATED, SUNK = 0.004, 0.003", "TOLERATED, SUNK = 0.005, 0.003", CAPTURE_TEST),
    Mutant(SOLES, "TOLERATED, SUNK = 0.004, 0.003", "TOLERATED, SUNK = 0.004, 0.004", CAPTURE_TEST),
    Mutant(
        STANCE, "PLACED, PLACED_SECONDS = 0.025, 0.5", "PLACED, PLACED_SECONDS = 0.024, 0.5", PLANTING_TEST
    ),
    Mutant(
        STANCE, "PLACED, PLACED_SECONDS = 0.025, 0.5", "PLACED, PLACED_SECONDS = 0.027, 0.5", PLANTING_TEST
    ),
    Mutant(
        STANCE, "PLACED, PLACED_SECONDS = 0.025, 0.5", "PLACED, PLACED_SECONDS = 0.025, 0.1", PLANTING_TEST
    ),
    Mutant(STANCE, "LEVEL = 0.15", "LEVEL = 0.05", PLANTING_TEST),
    Mutant(STANCE, "LEVEL = 0.15", "LEVEL = 0.17", PLANTING_TEST),
    Mutant(STANCE, "SUPPORT = 0.08", "SUPPORT = 0.082", PLANTING_TEST),
    Mutant(STANCE, "& ~near[::-1]", "", PLANTING_TEST),
    Mutant(SOLES, "FARTHEST = 0.03", "FARTHEST = 0.04", CAPTURE_TEST),
    Mutant(SOLES, "FARTHEST_UP = 0.025", "FARTHEST_UP = 0.035", CAPTURE_TEST),
    Mutant(SOLES, "np.maximum(depth - UNDER, 0.0)", "0.0 * depth", PLANTING_TEST),
    Mutant(TOES, "np.where(enough, bend, high)", "bend", PLANTING_TEST),
    Mutant(SESSION, "LEAVING = 6.0", "LEAVING = 5.0", NOTICES_TEST),
    Mutant(SESSION, "LEAVING = 6.0", "LEAVING = 7.0", NOTICES_TEST),
    Mutant(SESSION, "NOTICE_SECONDS = 4.0", "NOTICE_SECONDS = 3.0", NOTICES_TEST),
    Mutant(SESSION, "NOTICE_SECONDS = 4.0", "NOTICE_SECONDS = 5.0", NOTICES_TEST),
    Mutant(SESSION, "NOTICE_FADES = 0.5", "NOTICE_FADES = 0.1", NOTICES_TEST),
    Mutant(TAKES, "RATE = Fraction(25)", "RATE = Fraction(30)", TAKES_TEST),
    Mutant(TAKES, "RATES = (5, 120)", "RATES = (4, 120)", TAKES_TEST),
    Mutant(TAKES, "RATES = (5, 120)", "RATES = (5, 119)", TAKES_TEST),
    Mutant(TAKES, "LONGEST = 3600.0", "LONGEST = 3700.0", TAKES_TEST),
    Mutant(TAKES, "STILL = 0.2", "STILL = 0.1", TAKES_TEST),
    Mutant(TAKES, "STILL = 0.2", "STILL = 0.3", TAKES_TEST),
    Mutant(RENDER, "SLACK = 0.001", "SLACK = 0.0", RENDER_TEST),
    Mutant(RENDER, "SLACK = 0.001", "SLACK = 0.1", RENDER_TEST),
    Mutant(BODIES, "shift[1] = -size * sole", "shift[1] = 0.0", BODIES_TEST),
    Mutant(BODIES, '    result[ROOT] = "sacroiliac"\n', "", BODIES_TEST),
    Mutant(BODIES, '] = f"{side}_midtarsal"', '] = f"{side}_ankle"', BODIES_TEST),
    Mutant(OWN_HEAD, "-FEW / SMALL", "0.0", HEADS_TEST),
    Mutant(OWN_HEAD, "over = result > 1", "over = result > 9", HEADS_TEST),
    Mutant(OWN_HEADS, " or name == shape", "", HEADS_TEST),
    Mutant(OWN_HEADS, "_target(bind, 100.0)", "_target(bind, 1.0)", HEADS_TEST),
    Mutant(COMBINATION, "amounts[:, but] = 0.0", "pass", FACES_TEST),
    Mutant(COMBINATION, "np.minimum(columns[closed], ", "np.maximum(columns[closed], ", SHAPES_TEST),
    Mutant(COMBINATION, "LID_GAP - values[:, upper]", "LID_GAP", SHAPES_TEST),
    Mutant(
        "fba/capture/blendshapes/inversion.py",
        "rows[CLOSED] = rows[CLOSED] + rows[JAW]",
        "rows[CLOSED] = rows[CLOSED] + 0 * rows[JAW]",
        "tests/capture/faces/test_faps_to_shapes.py",
    ),
    Mutant(f"{MARKERS}/gaps.py", "length <= SHORT", "length <= 5 * SHORT", MARKERS_TEST),
    Mutant(f"{VIRTUAL}/_walk_loops.py", "abs(front) <= depth", "abs(front) <= radius", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/_walk_loops.py", "beside < radius * radius", "beside < radius", VIRTUAL_TEST),
    Mutant(
        f"{VIRTUAL}/influence.py",
        "1.0 - self.distances / self.radius, 0.0",
        "1.0 - self.distances / self.radius, -1.0",
        VIRTUAL_TEST,
    ),
    Mutant(
        f"{VIRTUAL}/influence.py",
        "np.lexsort((owner, distances, vertices))",
        "np.lexsort((distances, owner, vertices))",
        VIRTUAL_TEST,
    ),
    Mutant(f"{VIRTUAL}/influence.py", "total > MOST_SHARES", "size > MOST_SHARES", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/weights.py", 'mapping.overlap == "match"', 'mapping.overlap == "add"', VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/weights.py", 'mapping.assignment == "exclusive"', "False", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/performance.py", "FEWEST_FIXED = 3", "FEWEST_FIXED = 2", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/performance.py", "TOGETHER = 1e-3", "TOGETHER = 0.0", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/performance.py", "ODD_SCALE = 1.5", "ODD_SCALE = 15.0", VIRTUAL_TEST),
    Mutant(
        f"{VIRTUAL}/performance.py",
        "if not marker.fixed and source in columns",
        "if source in columns",
        VIRTUAL_TEST,
    ),
    Mutant(f"{VIRTUAL}/alignment.py", "MIRRORED = 0.5", "MIRRORED = 0.0", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/mapping.py", "own.connectivity != head.connectivity", "False", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/mapping.py", "own.shape != head.shape", "False", VIRTUAL_TEST),
    Mutant(
        f"{VIRTUAL}/mapping.py",
        "marker.vertex >= len(head.vertices)",
        "marker.vertex > len(head.vertices)",
        VIRTUAL_TEST,
    ),
    Mutant(
        f"{VIRTUAL}/mapping_files.py",
        'entry.get("depth", radius)',
        'entry.get("depth", 1.0)',
        VIRTUAL_FILES_TEST,
    ),
    Mutant(f"{VIRTUAL}/proposal.py", "LID_REACH = 0.8", "LID_REACH = 1.1", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/companions.py", "LIP_DEPTH = 0.012, 0.004", "LIP_DEPTH = 0.03, 0.03", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/performance.py", "marker.follows or name", "name", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/proposal.py", "NEAR = 0.015", "NEAR = 0.15", MAP_PAGE_TEST),
    Mutant(f"{VIRTUAL}/proposal.py", "REACH = 3, 1.2", "REACH = 3, 3.0", VIRTUAL_TEST),
    Mutant(f"{VIRTUAL}/followers.py", '"teeth", "tongue"', '"tongue",', VIRTUAL_TEST),
    Mutant("player/fba_player/scene/markers_scene.py", "GRAB = 10.0", "GRAB = 100.0", MAP_PAGE_TEST),
    Mutant("player/fba_player/scene/marker_editing.py", 'if what != "size" or', "if True or", MAP_PAGE_TEST),
    Mutant(f"{MARKERS}/gaps.py", "off[0] * (1 - share) + off[1] * share", "off[0]", MARKERS_TEST),
    Mutant(
        f"{MARKERS}/stabilisation.py",
        "weights = np.where(seen, 1 / ",
        "weights = np.where(seen, 1 + 0 / ",
        MARKERS_TEST,
    ),
    Mutant(f"{MARKERS}/solving.py", "curve[:, chin] = shifts", "curve[:, chin] += 0 * shifts", MARKERS_TEST),
    Mutant(f"{MARKERS}/solving.py", "if JAW in solved:", "if not solved:", MARKERS_TEST),
    Mutant(f"{MARKERS}/blinks.py", "UPPER_SHARE = 0.95", "UPPER_SHARE = 0.7", MARKERS_TEST),
    Mutant(f"{MARKERS}/blinks.py", "DEEP = 0.5", "DEEP = 0.1", MARKERS_TEST),
    Mutant(f"{MARKERS}/blinks.py", "LONGEST = 0.5", "LONGEST = 5.0", MARKERS_TEST),
    Mutant(f"{MARKERS}/solving.py", 'faps()[c].direction == "U"', 'faps()[c].direction == "X"', MARKERS_TEST),
    Mutant(f"{MARKERS}/registration.py", "MIRROR = 0.5", "MIRROR = 0.0", MARKERS_TEST),
    Mutant(f"{MARKERS}/registration.py", "ASTRAY = 0.03", "ASTRAY = 3.0", MARKERS_TEST),
    Mutant(f"{MARKERS}/registration.py", "[rows[lower], 1] + IRIS) / 2", "[rows[lower], 1])", MARKERS_TEST),
    Mutant(f"{MARKERS}/exchanges.py", "EXCHANGED = 0.4", "EXCHANGED = 0.0", MARKERS_TEST),
    Mutant(f"{MARKERS}/neutral.py", "SLOW = 0.6", "SLOW = 6.0", MARKERS_TEST),
    Mutant(f"{MARKERS}/proposal.py", "NEAR = 0.014", "NEAR = 0.004", MARKERS_TEST),
    Mutant(f"{MARKERS}/proposal.py", "PLACED = 0.4", "PLACED = 0.0", MARKERS_TEST),
    Mutant("fba/formats/c3d/reader.py", "quads[..., 3] >= 0", "quads[..., 3] >= -2", MARKER_FILES_TEST),
    Mutant("fba/formats/c3d/_parameters.py", "/ np.float32(4)", "/ np.float32(2)", MARKER_FILES_TEST),
    Mutant(
        "fba/formats/markers/qualisys.py",
        "(positions == 0).all(axis=2)",
        "(positions == 9).all(axis=2)",
        MARKER_FILES_TEST,
    ),
    Mutant(LIVELINK, "correlation < 0", "correlation > 0", LIVELINK_TEST),
    Mutant(LIVELINK, "wrong = expected if", "wrong = False if", LIVELINK_TEST),
    Mutant(TIME_CODES, "np.diff(seconds, prepend=seconds[0]) < -NOON", "seconds < 0", LIVELINK_TEST),
    Mutant(TIME_CODES, "30: 2, 60: 4", "30: 3, 60: 4", TIME_CODES_TEST),
    Mutant(TIME_CODES, "minutes - minutes // 10", "minutes", TIME_CODES_TEST),
    Mutant(TIME_CODES, "+ NOON) % DAY - NOON", ") % DAY", TIME_CODES_TEST),
    Mutant(TIME_CODES, "hours % 12 +", "hours +", TIME_CODES_TEST),
    Mutant(SYNCHRONISATION, "(-later, 0.0) if", "(0.0, later) if", SYNCHRONISATION_TEST),
    Mutant(SYNCHRONISATION, "STRAIGHT = 0.02", "STRAIGHT = 0.5", SYNCHRONISATION_TEST),
    Mutant(SYNCHRONISATION, "max(first.animation.rate", "min(first.animation.rate", SYNCHRONISATION_TEST),
    Mutant(SYNCHRONISATION, 'if without or sync == "offset"', "if without", SYNCHRONISATION_TEST),
    Mutant(
        "player/fba_player/sound/sound_clip.py", "int(reference) and stream.rate", "stream.rate", VOICE_TEST
    ),
    Mutant(INVERSION, "+ SHARED**2 * np.eye(len(shapes))", "", SHAPES_BACK_TEST),
    Mutant(LIVELINK_CSV, "* rate > SPARSE", "* rate < 0", SHAPES_BACK_TEST),
    Mutant(FACES, "times = times - times[0]", "pass", ACTION_UNITS_TEST),
    Mutant(FACES, ">= CONFIDENT", ">= 0", ACTION_UNITS_TEST),
    Mutant(
        "fba/formats/gltf/face_motion.py",
        "if humanoid is not None and not LIMBS",
        "if False and not LIMBS",
        "tests/formats/gltf/test_vrma_writing.py",
    ),
    Mutant(SMPL, "[-np.pi / 2, 0.0, 0.0]", "[np.pi / 2, 0.0, 0.0]", SMPL_TEST),
    Mutant(SMPL, "heads[1] < -UPRIGHT", "heads[1] < -9", SMPL_TEST),
    Mutant(SMPL, "[66, 69, 75]", "[66, 72, 75]", SMPL_TEST),
    Mutant("fba/formats/gltf/reader.py", "moments, head=True", "moments", FACES_TEST),
    Mutant(OPENFACE, "set(columns) == set(VERSION_3)", "False", ACTION_UNITS_TEST),
    Mutant(LIVE_ORDER, "JUMP = 1.0", "JUMP = 1e9", LIVE_FACES_TEST),
    Mutant(LIVE_ORDER, "MOST_HELD = 2", "MOST_HELD = 1", LIVE_FACES_TEST),
    Mutant(LIVE_ORDER, "MOST_HELD = 2", "MOST_HELD = 3", LIVE_FACES_TEST),
    Mutant(LIVE_ORDER, "TOLERANCE = 5.0", "TOLERANCE = 500.0", LIVE_FACES_TEST),
    Mutant(LIVE_ORDER, "LONGEST_GAP = 600.0", "LONGEST_GAP = 60.0", LIVE_FACES_TEST),
    Mutant(LIVE_ORDER, "WHOLE_STEP = 1.5", "WHOLE_STEP = 15", LIVE_FACES_TEST),
    Mutant("fba/live/protocols/ifacialmocap.py", "LOST_TOUCH = 0.25", "LOST_TOUCH = 1e9", LIVE_FACES_TEST),
    Mutant("fba/live/faces.py", "np.maximum(weights, 0.0)", "weights", LIVE_FACES_TEST),
    Mutant("fba/capture/live/blendshapes.py", "while last / frames > time", "while False", LIVE_FACES_TEST),
    Mutant(RECORDING, "self._file.seek(self._size)", "self._file.seek(0, 2)", STREAM_FILES_TEST),
    Mutant(RECORDING, "self.encoder.expect(widest_faces())", "pass", STREAM_FILES_TEST),
    Mutant(RECORDING, "data + ending)", "data)", STREAM_FILES_TEST),
    Mutant(
        ENCODER,
        "return self._writer.ending() + self._mark()",
        "return self._writer.ending()",
        STREAM_FILES_TEST,
    ),
    Mutant(LIVE_BONES, "[w, x, -y, -z]", "[w, x, y, z]", VMC_TEST),
    Mutant(LIVE_BONES, "[-1.0, 1.0, 1.0]", "[1.0, 1.0, 1.0]", VMC_TEST),
    Mutant(PEOPLE, "FEWEST_SHAPES = 5", "FEWEST_SHAPES = 50", VMC_TEST),
    Mutant(PEOPLE, '"a": "aa"', '"a": "oh"', VMC_TEST),
    Mutant("fba/live/protocols/_osc.py", "DEEPEST = 8", "DEEPEST = 80", VMC_TEST),
    Mutant(UDP, "times = np.where(times < NOON, times + DAY, times)", "pass", RECORDS_TEST),
    Mutant(TIME_CODES, "if largest < rate", "if largest <= rate", LIVELINK_TEST),
    Mutant(SAMPLING, "np.where(length > BRIDGED, RETURN, length)", "length", LIVELINK_TEST),
    Mutant(SHAPE_TABLE, "            result[fap.number - 1] = True", "            pass", FACES_TEST),
    Mutant(HUMANOID, '"ThumbProximal": "ThumbMetacarpal"', '"ThumbProximal": "ThumbProximal"', DECLARED_TEST),
    Mutant(GLTF_READER, "HALF_TURN = (-1, 1, -1)", "HALF_TURN = (1, 1, 1)", DECLARED_TEST),
    Mutant(FAP_JOINTS, "SQUARE = 1e-6", "SQUARE = 1.0", "tests/formats/gltf/test_gltf_faces.py"),
    Mutant(HINGES, "ABRUPT = 0.4", "ABRUPT = 0.1", CAPTURE_RULES_TEST),
    Mutant(HINGES, "CLEAR_BEND = 0.3", "CLEAR_BEND = 0.0", CAPTURE_RULES_TEST),
    Mutant(HINGES, "CLEAR_BEND = 0.3", "CLEAR_BEND = 0.4", CAPTURE_RULES_TEST),
    Mutant(HINGE_PATH, "WRONG = 0.6", "WRONG = 0.15", CAPTURE_RULES_TEST),
    Mutant(HINGE_PATH, "WRONG = 0.6", "WRONG = 2.0", CAPTURE_RULES_TEST),
    Mutant(HINGE_PATH, "LOYAL = 5.0", "LOYAL = 50.0", CAPTURE_RULES_TEST),
    Mutant(WRINGING, '"{}_hip", "{}_knee"', '"sacroiliac", "{}_knee"', "tests/capture/test_comparison.py"),
    Mutant(LEG_IK, "ROUNDS = 3", "ROUNDS = 1", CAPTURE_RULES_TEST),
    Mutant(LEG_IK, "ROUNDS = 3", "ROUNDS = 2", CAPTURE_RULES_TEST),
    Mutant(GROUND, "NEAR = 0.03", "NEAR = 0.003", CAPTURE_RULES_TEST),
    Mutant(GROUND, "NEAR = 0.03", "NEAR = 0.1", CAPTURE_RULES_TEST),
    Mutant(PLANTING, "stiff = 1.0 - np.array", "stiff = 0.1 * np.array", CAPTURE_TEST),
    Mutant(SESSION, "IDLE_MOUSE = 3.0", "IDLE_MOUSE = 2.0", NOTICES_TEST),
    Mutant(SESSION, "IDLE_MOUSE = 3.0", "IDLE_MOUSE = 4.0", NOTICES_TEST),
    Mutant(READ_AHEAD, "AHEAD = 2.5", "AHEAD = 2.0", AUDIO_TEST),
    Mutant(READ_AHEAD, "AHEAD = 2.5", "AHEAD = 3.0", AUDIO_TEST),
    Mutant(PLAUSIBILITY, "MARGIN = 20.0", "MARGIN = 18.0", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "MARGIN = 20.0", "MARGIN = 22.0", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "BEYOND = 0.3", "BEYOND = 0.27", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "BEYOND = 0.3", "BEYOND = 0.33", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SWAY = 0.08", "SWAY = 0.07", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SWAY = 0.08", "SWAY = 0.09", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SLACK = 2.0", "SLACK = 1.9", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SLACK = 2.0", "SLACK = 2.1", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "FASTEST = 8.0", "FASTEST = 7.5", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "FASTEST = 8.0", "FASTEST = 8.5", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "STRIDING = 0.2", "STRIDING = 0.18", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "STRIDING = 0.2", "STRIDING = 0.22", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "STANDS = 0.15", "STANDS = 0.13", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "STANDS = 0.15", "STANDS = 0.17", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SUNK = -2.0", "SUNK = -1.8", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SUNK = -2.0", "SUNK = -2.2", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "SLIDES = 0.06", "SLIDES = 0.07", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "other.travel < SWAY", "other.travel < 9", PLAUSIBLE_TEST),
    Mutant(PLAUSIBILITY, "AWAY, NEAR = 25.0", "AWAY, NEAR = 23.0", ORIGIN_TEST),
    Mutant(PLAUSIBILITY, "AWAY, NEAR = 25.0", "AWAY, NEAR = 27.0", ORIGIN_TEST),
    Mutant(SLIDING, "STILL = 0.02", "STILL = 0.1", SLIDE_TEST),
    Mutant(SLIDING, "np.minimum(ahead, back)", "np.maximum(ahead, back)", SLIDE_TEST),
    Mutant(SLIDING, "_to_and_fro(root[run]) - quantum", "_to_and_fro(root[run])", SLIDE_TEST),
    Mutant(PLAUSIBILITY, "JUMP = 1.0", "JUMP = 0.9", JUMP_TEST),
    Mutant(PLAUSIBILITY, "JUMP = 1.0", "JUMP = 1.1", JUMP_TEST),
    Mutant(
        "fba/emotion/modification.py", "0.0) * (1 - spoken)\n    parted", "0.0) * 0.0\n    parted", EMOTE_TEST
    ),
    Mutant("fba/persona/rest.py", "NO_REST = 4.0", "NO_REST = 4000.0", REST_TEST),
    Mutant("fba/persona/rest.py", "(angles[:, 1] / TURNED) ** 2", "0.0", REST_TEST),
    Mutant("fba/persona/rest.py", "(gap / MILLIMETRES) ** 2", "0.0", REST_TEST),
    Mutant("fba/emotion/modification.py", "offsets[:, JAW] *= spoken", "pass", EMOTE_TEST),
    Mutant("fba/emotion/modification.py", "LIDS_APART = 1024.0", "LIDS_APART = 1100.0", EMOTE_TEST),
    Mutant("fba/emotion/modification.py", "reach: float = 1.2", "reach: float = 3.0", EMOTE_TEST),
    Mutant("fba/emotion/modification.py", "np.where(same, shown * room, shown)", "shown", EMOTE_TEST),
    Mutant("fba/emotion/moods.py", "end - begin > one.ease + other.ease", "False", EMOTE_TEST),
    Mutant(
        "player/fba_player/session/emotion_trace.py", "begin + start, begin + end", "start, end", STRIP_TEST
    ),
    Mutant("player/fba_player/figure/wrinkles.py", "BEGINNING = 0.5", "BEGINNING = 0.4", WRINKLES_TEST),
    Mutant("player/fba_player/figure/wrinkles.py", "BEGINNING = 0.5", "BEGINNING = 0.7", WRINKLES_TEST),
    Mutant("player/fba_player/figure/wrinkles.py", "DEEPEST = 0.75", "DEEPEST = 1.5", WRINKLES_TEST),
    Mutant("player/fba_player/figure/wrinkles.py", "STIFFNESS = 1e-4", "STIFFNESS = 1.0", WRINKLES_TEST),
    Mutant("player/fba_player/gl/_mesh_renderer.py", "CORE = 0.9", "CORE = 1.0", TRANSPARENCY_TEST),
    Mutant("player/fba_player/gl/_mesh_renderer.py", "CORE = 0.9", "CORE = 0.1", TRANSPARENCY_TEST),
    Mutant(ROUND_ANGLES, "ROUND_RADIANS = 5.0, 0.1", "ROUND_RADIANS = 6.0, 0.1", STEP_CHOICE_TEST),
    Mutant(ROUND_ANGLES, "ROUND_RADIANS = 5.0, 0.1", "ROUND_RADIANS = 5.0, 0.5", STEP_CHOICE_TEST),
    Mutant(ROUND_ANGLES, "ROUND_MORE = 6.0, 2.0", "ROUND_MORE = 1.0, 2.0", STEP_CHOICE_TEST),
    Mutant(ROUND_ANGLES, "EVERY_LEAST = 1.3", "EVERY_LEAST = 6.0", STEP_CHOICE_TEST),
    Mutant(HEAD_TURNS, "np.radians(2.0), ", "np.radians(1.0), ", HEAD_TURN_TEST),
    Mutant(HEAD_TURNS, "np.radians(45.0)", "np.radians(70.0)", HEAD_TURN_TEST),
    Mutant(HEAD_TURNS, "TOO_FAR = -1.8", "TOO_FAR = -2.0", HEAD_TURN_TEST),
    Mutant(HEAD_TURNS, "TOO_FAR = -1.8", "TOO_FAR = -1.6", HEAD_TURN_TEST),
    Mutant(HEAD_TURNS, "TOO_FAR <= then[1] <= ENOUGH", "then[1] <= ENOUGH", HEAD_TURN_TEST),
    Mutant(ROUND_ANGLES, "(np.gcd.reduce(levels[:, columns], axis=None))", "(1)", STEP_CHOICE_TEST),
    Mutant(MARK, "position = start\n", "position = start + 99\n", MARK_TEST),
    Mutant(OBJECT_BORDERS, "mark.begin <= byte < mark.end", "byte < mark.end", MARK_TEST),
    Mutant(
        OBJECT_BORDERS,
        "        self.checks = None\n        self._in_headers",
        "        self._in_headers",
        "tests/codec/test_checksums.py",
    ),
    Mutant(STREAM_READER, "del self._buffer, self._reader ", "pass", f"{CHUNKS_TEST} -k no_bytes"),
    Mutant(
        STREAM_READER,
        "        _forget_frames(error)\n        self",
        "        self",
        f"{CHUNKS_TEST} -k no_bytes",
    ),
    Mutant(
        OBJECT_BORDERS,
        "code != USER_DATA or not (directly or self._in_headers)",
        "code != USER_DATA",
        MARK_TEST,
    ),
    Mutant("fba/body/gait/_plan.py", "_SOFT = 0.85", "_SOFT = 0.7", MEASURED_TEST),
    Mutant("fba/body/gait/_plan.py", 'self._correction("knee", swing)', "0.0", MEASURED_TEST),
    Mutant("fba/body/gait/_plan.py", 'self._correction("thigh", swing)', "0.0", MEASURED_TEST),
    Mutant("fba/body/gait/_plan.py", 'self._correction("foot", phase)', "0.0", MEASURED_TEST),
    Mutant(
        "fba/mesh/polygons.py", "turned = (third - begin[third]) % 2 == 1", "turned = third < 0", STRIPS_TEST
    ),
    Mutant(PLAUSIBILITY, "LEAST = 1.0", "LEAST = 0.9", MOMENT_TEST),
    Mutant(PLAUSIBILITY, "LEAST = 1.0", "LEAST = 1.1", MOMENT_TEST),
    Mutant(PLAUSIBILITY, "SAMPLES = 32", "SAMPLES = 31", LONG_TEST),
    Mutant(PLAUSIBILITY, "RUN = 64", "RUN = 65", LONG_TEST),
    Mutant(GAIT_CURVES, "STEP_SECONDS = (0.2, 1.8)", "STEP_SECONDS = (0.15, 1.8)", GAIT_TEST),
    Mutant(GAIT_CURVES, "STEP_SECONDS = (0.2, 1.8)", "STEP_SECONDS = (0.22, 1.8)", GAIT_TEST),
    Mutant(GAIT_CURVES, "STEP_SECONDS = (0.2, 1.8)", "STEP_SECONDS = (0.2, 1.7)", GAIT_TEST),
    Mutant(GAIT_CURVES, "STEP_SECONDS = (0.2, 1.8)", "STEP_SECONDS = (0.2, 1.9)", GAIT_TEST),
    Mutant(GAIT_CURVES, "SHORTEST_SWING = 0.12", "SHORTEST_SWING = 0.1", GAIT_TEST),
    Mutant(GAIT_CURVES, "SHORTEST_SWING = 0.12", "SHORTEST_SWING = 0.14", GAIT_TEST),
    Mutant(GAIT_CURVES, "SHORTEST_STEP = 0.08", "SHORTEST_STEP = 0.06", GAIT_TEST),
    Mutant(GAIT_CURVES, "SHORTEST_STEP = 0.08", "SHORTEST_STEP = 0.1", GAIT_TEST),
    Mutant(GAIT_CURVES, "LEAVING = 0.06, 0.08", "LEAVING = 0.05, 0.08", GAIT_TEST),
    Mutant(GAIT_CURVES, "LEAVING = 0.06, 0.08", "LEAVING = 0.08, 0.08", GAIT_TEST),
    Mutant(GAIT_CURVES, "LEAVING = 0.06, 0.08", "LEAVING = 0.06, 0.05", GAIT_TEST),
    Mutant(GAIT_CURVES, "LEAVING = 0.06, 0.08", "LEAVING = 0.06, 0.12", GAIT_TEST),
    Mutant(GAIT_CURVES, "TOUCH = 0.008", "TOUCH = 0.006", GAIT_TEST),
    Mutant(GAIT_CURVES, "TOUCH = 0.008", "TOUCH = 0.01", GAIT_TEST),
    Mutant(GAIT_DETECTION, "UNEVEN = 2.2", "UNEVEN = 1.9", GAIT_TEST),
    Mutant(GAIT_DETECTION, "UNEVEN = 2.2", "UNEVEN = 3.1", GAIT_TEST),
    Mutant(GAIT_MEASURE, "ON_GROUND = 0.002", "ON_GROUND = 0.0018", GAIT_TEST),
    Mutant(GAIT_MEASURE, "ON_GROUND = 0.002", "ON_GROUND = 0.0022", GAIT_TEST),
    Mutant(VALUES, "TIME_TOLERANCE = Fraction(1, 1000)", "TIME_TOLERANCE = Fraction(1, 50)", PROGRAMS_TEST),
    Mutant(VALUES, "if found.time is None:", "if False:", PROGRAMS_TEST),
    Mutant(JUDGEMENT, "if not failed:", "if False:", PROGRAMS_TEST),
    Mutant(JUDGEMENT, "given = given[:-1]", "pass", PROGRAMS_TEST),
    Mutant(
        JUDGEMENT, "if not found.ended:\n            return", "if False:\n            return", PROGRAMS_TEST
    ),
    Mutant(TESTED, "if run.crash or (run.failure and", "if (run.failure and", PROGRAMS_TEST),
    Mutant(DAMAGE, "DOUBTFUL = 8", "DOUBTFUL = 0", DAMAGE_TEST),
    Mutant("fba/codec/_plane/syntax.py", "LAYER_CODES = (0xB0, 0xB5)", "LAYER_CODES = (0xB0,)", DAMAGE_TEST),
    Mutant(
        STREAM_READER,
        "                if self.objects.count or not self._salvage:\n",
        "                if not self._salvage:\n",
        DAMAGE_TEST,
    ),
    Mutant(
        STREAM_READER,
        "_DAMAGE_BYTES = 1000",
        "_DAMAGE_BYTES = 1",
        "tests/codec/test_hostile.py -k list_of",
    ),
    Mutant("fba/mesh/ply.py", "if count != given:", "if False:", "tests/mesh/test_ply.py"),
    Mutant("fba/mesh/ply.py", "(values == np.rint(values))", "True", "tests/mesh/test_ply.py"),
    Mutant(CLOCK, "_BELIEVED_JUMP = 60", "_BELIEVED_JUMP = 10**6", LOSS_TEST),
    Mutant(CLOCK, "or index > self._coded_index", "or index < 0", LOSS_TEST),
    Mutant(CLOCK, "and nearest == self.index:", "and False:", LOSS_TEST),
    Mutant(CLOCK, "_REPEATED_RATES = 2", "_REPEATED_RATES = 10**6", LOSS_TEST),
    Mutant(CLOCK, "return offset == before and", "return False and", LOSS_TEST),
    Mutant(CLOCK, "undone = self._last_jump > 0 and", "undone = False and", LOSS_TEST),
    Mutant(CLOCK, "far = self.agreements > 0 and", "far =", LOSS_TEST),
    Mutant(CLOCK, " and index >= self._object_index", "", LOSS_TEST),
    Mutant(CLOCK, "return rate not in (self.rate, before) and", "return rate != self.rate and", LOSS_TEST),
    Mutant(CLOCK, "if time_code.total_seconds >= now:", "if True:", LOSS_TEST),
    Mutant(PLANE_TIMES, "max(lost[0] - lost[1], 0) if clock.agreements else lost[0]", "lost[0]", LOSS_TEST),
    Mutant(PLANE_TIMES, "= not self.may_step_back", "= False", LOSS_TEST),
    Mutant(PLANE_TIMES, "if expected is not None and expected >= clock.index:", "if False:", LOSS_TEST),
    Mutant(PLANE_TIMES, "self._restarts.forget()", "pass", LOSS_TEST),
    Mutant(PLANE_TIMES, "elif jump < 0 or (agreed and jump):", "elif False:", LOSS_TEST),
    Mutant(RESTARTS, "_CYCLE = 2", "_CYCLE = 1", LOSS_TEST),
    Mutant(DAMAGE, "self._frames / self._bits", "0 / self._bits", LOSS_TEST),
    Mutant(f"{POINTS}/picture.py", "axis = 0 if down[1] < 0 else 1", "axis = 0", POINTS_TEST),
    Mutant(f"{POINTS}/picture.py", "if tip < 0:", "if False:", POINTS_TEST),
    Mutant(
        f"{POINTS}/picture.py",
        "points * np.array([ratio, 1.0, ratio])",
        "points * np.array([ratio, 1.0, 1.0])",
        POINTS_TEST,
    ),
    Mutant(
        f"{POINTS}/lifting.py",
        "deep[part] = shape[:, 2] + moved",
        "deep[part] = known.template[:, 2] + 0 * moved",
        POINTS_TEST,
    ),
    Mutant(
        f"{POINTS}/neutral.py", "frames = _best(sum(told, turned), length)", "frames = whole", POINTS_TEST
    ),
    Mutant(
        f"{EMOTION}/rules.py", "free = added_moved * (1 - leader.moved)", "free = added_moved", RULES_TEST
    ),
    Mutant(
        f"{EMOTION}/rules.py",
        "near = np.abs(own.faps - centre) <=",
        "near = np.abs(own.faps - centre) >",
        RULES_TEST,
    ),
    Mutant(f"{EMOTION}/rules.py", "largest - one) / (largest + one)", "largest - one) * 0", RULES_TEST),
    Mutant(f"{EMOTION}/profiles.py", "amount = one.sign * (", "amount = (", EXPRESSIONS_TEST),
    Mutant(
        f"{EMOTION}/performance.py",
        "copies = fill(blend.faps, moving)[1]",
        "copies = moving.copy()",
        EXPRESS_TEST,
    ),
    Mutant(f"{EMOTION}/recogniser.py", "BLINK = 0.5", "BLINK = 0.0", READING_TEST),
    Mutant(f"{EMOTION}/recogniser.py", "LASTING = 1.5", "LASTING = 0.001", READING_TEST),
    Mutant(f"{EMOTION}/likelihood.py", "SPEECH = 1.0", "SPEECH = 0.1", READING_TEST),
    Mutant(f"{EMOTION}/likelihood.py", "VISIBLE = 0.2", "VISIBLE = 0.0", READING_TEST),
    Mutant(f"{EMOTION}/likelihood.py", "7: 0.06, 10: 0.08", "7: 0.001, 10: 0.001", READING_TEST),
    Mutant(f"{EMOTION}/features.py", "np.minimum(gaze, 0), np.maximum(gaze, 0)", "gaze, gaze", READING_TEST),
    Mutant(f"{EMOTION}/reading.py", "SILENT = 1.0", "SILENT = 0.0", READING_TEST),
    Mutant(
        f"{EMOTION}/likelihood.py", "CAPTURED = 0.2, 0.2, 0.35", "CAPTURED = 0.2, 0.2, 1e-9", READING_TEST
    ),
    Mutant(f"{MARKERS}/pupils.py", "opening > SHUT * neutral", "opening > 0 * neutral", POINTS_TEST),
    Mutant(f"{POINT_FILES}/_points.py", "and not _is_deep(positions)", "and False", POINT_TABLES_TEST),
    Mutant(
        f"{POINT_FILES}/points_csv.py",
        ".reshape(len(rows), -1, width)",
        ".reshape(len(rows), width, -1).swapaxes(1, 2)",
        POINT_TABLES_TEST,
    ),
    Mutant(ENCODER, "- self._origin, rate)\n        plane", ", rate)\n        plane", LOSS_TEST),
)


def main(words: list[str]) -> int:
    """Runs the mutants whose files hold one of the words; 1 where any survives, else 0."""
    chosen = [one for one in MUTANTS if not words or any(word in one.file for word in words)]
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in FOLDERS:
            shutil.copytree(ROOT / name, copy / name)
        shutil.copy(ROOT / "pyproject.toml", copy)
        for tests in sorted({mutant.tests for mutant in chosen}):
            if fails(tests, copy):
                print(f"fails without any change, so it says nothing: {tests}")
                return 1
        for number, mutant in enumerate(chosen, 1):
            outcome = tried(mutant, copy)
            survivors += outcome != "dies"
            change = f"{mutant.file}: {mutant.old} -> {mutant.new}"
            print(f"{number}/{len(chosen)} {outcome}: {change}", flush=True)
    print(f"{len(chosen) - survivors} of {len(chosen)} mutants die")
    return int(survivors > 0)


def tried(mutant: Mutant, copy: Path) -> str:
    """Whether a test notices a mutant: "dies", "SURVIVES", or "is out of date" where its text is gone."""
    path = copy / mutant.file
    text = path.read_text(encoding="utf-8")
    if mutant.old not in text:
        return "is out of date"
    path.write_text(text.replace(mutant.old, mutant.new, 1), encoding="utf-8")
    try:
        return "dies" if fails(mutant.tests, copy) else "SURVIVES"
    finally:
        path.write_text(text, encoding="utf-8")


def fails(tests: str, copy: Path) -> bool:
    """Whether these tests fail on the copy, or do not end."""
    roots = (copy, copy / "player", copy / "conformance")
    try:
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "pytest",
                "-n",
                "0",
                "-q",
                "-x",
                "-p",
                "no:cacheprovider",
                *shlex.split(tests),
            ],
            cwd=copy,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, roots))},
            capture_output=True,
            timeout=LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return True
    return done.returncode == 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
