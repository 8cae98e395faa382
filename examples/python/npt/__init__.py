"""Neural pose transfer for meshes: the pose of one mesh on another, without rig, markers or correspondence.

    import npt
    transfer = npt.PoseTransfer()
    posed = transfer((vertices, faces), (pose_vertices, pose_faces))  # [V, 3] float32: its order, unit and place

    hero = transfer.character((vertices, faces))                      # estimated and bound once
    pose = transfer.pose((pose_vertices, pose_faces))                 # estimated once
    result = transfer.apply(hero, pose)                               # .vertices, .method, .kind, .confidence, .warnings

    npt.transfer_motion("hero.glb", "walk.bvh").save("hero_walk.glb")  # a clip on the character's own joints

People and four-legged animals in any pose are transferred by body estimation, as `npt transfer` does: the results are
its results.
"""

from ._library import Error, Stopped, library_file, version
from ._meshes import Mesh, MeshLike, pmd
from ._motions import (
    JointRole,
    Motion,
    MotionFrames,
    MotionResult,
    MotionWarning,
    make_motion,
    read_motion,
    read_skeleton,
    reads_fbx,
    save_motions,
    transfer_motion,
)
from ._prepared import Character, JointPose, Pose, Skeleton
from ._results import Measures, Result, TransferWarning
from ._transfer import PoseTracker, PoseTransfer, animate, frames_to_try, shipped_weights

__version__ = version()
__all__ = [
    "Character",
    "Error",
    "JointPose",
    "JointRole",
    "Measures",
    "Mesh",
    "MeshLike",
    "Motion",
    "MotionFrames",
    "MotionResult",
    "MotionWarning",
    "Pose",
    "PoseTracker",
    "PoseTransfer",
    "Result",
    "Skeleton",
    "Stopped",
    "TransferWarning",
    "animate",
    "frames_to_try",
    "library_file",
    "make_motion",
    "pmd",
    "read_motion",
    "read_skeleton",
    "reads_fbx",
    "save_motions",
    "shipped_weights",
    "transfer_motion",
    "version",
]
