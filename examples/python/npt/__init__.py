"""Neural pose transfer for meshes: the pose of one mesh on another, without rig, markers or correspondence.

    import npt
    transfer = npt.PoseTransfer("human")
    posed = transfer((vertices, faces), (pose_vertices, pose_faces))   # [V, 3] float32, in the identity's order, unit and place

People in any pose are posed by body estimation, the rest by a pose transfer network, as `npt transfer` does: the results are its results.
"""

from ._library import Error, library_file, version
from ._meshes import Mesh, MeshLike, pmd
from ._transfer import Identity, Pose, PoseTransfer, Report, Rig, Sequence, TransferWarning, shipped_weights

__version__ = version()
__all__ = [
    "Error",
    "Identity",
    "Mesh",
    "MeshLike",
    "Pose",
    "PoseTransfer",
    "Report",
    "Rig",
    "Sequence",
    "TransferWarning",
    "library_file",
    "pmd",
    "shipped_weights",
    "version",
]
