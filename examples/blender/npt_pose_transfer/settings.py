"""What the panel shows and the operators read: scene.npt"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import npt


def is_mesh(_, thing):
    return thing.type == "MESH"


def is_armature(_, thing):
    return thing.type == "ARMATURE"


def is_identity(_, thing):
    return thing.type in ("MESH", "ARMATURE")


SOURCES = [
    ("OBJECT", "Object", "The pose of one mesh object"),
    ("COLLECTION", "Collection", "The mesh objects of a collection, in the order of their names: one shape key each"),
    ("FRAMES", "Frames", "An animated mesh object, frame by frame: one shape key each"),
    ("ACTION", "Action", "The action of an armature, onto the identity's own armature as a new action"),
]
METHODS = [
    ("automatic", "Automatic", "By body estimation, which refuses what it doesn't recognise"),
    ("body", "Body estimation", "By body estimation, whatever the meshes are"),
    ("network", "Network", "By the pose transfer network: upright meshes that face the front view"),
]


QUALITIES = [
    ("fast", "Fast", "Half of the views: about two thirds of the time"),
    ("balanced", "Balanced", "The default"),
    ("best", "Best", "All views of every mesh"),
]


def weights_items(_self, _context):
    if not weights_items.kept:  # Blender keeps no reference to the strings
        weights_items.kept = [("DEFAULT", "People and animals", "People's weights, and four-legged animals' when needed")]
        weights_items.kept += [(name, name, f"Weights that npt ships: {name}") for name in npt.shipped_weights()]
        weights_items.kept.append(("FILE", "A file", "Weights of your own (.safetensors)"))
    return weights_items.kept


weights_items.kept = []


class NPT_Settings(bpy.types.PropertyGroup):
    identity: PointerProperty(
        name="Identity",
        type=bpy.types.Object,
        poll=is_identity,
        description="Who: the mesh object that takes the pose. It stays as it is; the result is a new object. For an "
        "action also its armature, which gets a new action",
    )
    source: EnumProperty(name="Pose from", items=SOURCES, description="Where the pose comes from")
    pose: PointerProperty(
        name="Pose", type=bpy.types.Object, poll=is_mesh, description="The mesh object whose pose is taken"
    )
    collection: PointerProperty(
        name="Poses", type=bpy.types.Collection, description="The poses, in the order of their names"
    )
    armature: PointerProperty(
        name="Armature", type=bpy.types.Object, poll=is_armature, description="The armature whose action is taken"
    )
    action: PointerProperty(
        name="Action", type=bpy.types.Action, description="Of the armature; none: the one that it has now"
    )
    use_action_range: BoolProperty(name="Action's range", default=True, description="The frames of the action")
    foot_lock: BoolProperty(name="Hold feet", default=True, description="Feet that stand are held in their place")
    in_place: BoolProperty(name="In place", description="Leave out the way over the ground")
    clearance: FloatProperty(
        name="Clearance",
        default=1,
        min=0,
        max=1,
        description="How far arms and thighs are kept out of the body, where its mesh is known",
    )
    use_scene_range: BoolProperty(name="Scene's range", default=True, description="The frames that the scene plays")
    frame_start: IntProperty(name="First", default=1, description="The first frame")
    frame_end: IntProperty(name="Last", default=24, description="The last frame")
    frame_step: IntProperty(name="Step", default=1, min=1, description="Every so many frames")
    rig: BoolProperty(
        name="Rig",
        description="Give the result an armature that takes the poses (40 bones of a person, 35 of a four-legged "
        "animal), with names and weights for further animation, instead of moved vertices",
    )
    weights: EnumProperty(name="Weights", items=weights_items, description="The network's weights")
    weights_file: StringProperty(name="File", subtype="FILE_PATH", description="Weights of your own (.safetensors)")
    method: EnumProperty(name="Method", items=METHODS, description="How poses are transferred")
    quality: EnumProperty(
        name="Quality", items=QUALITIES, default="balanced", description="Body estimation: how much time it may take"
    )
    figure: IntProperty(
        name="Figure",
        min=0,
        description="Of several figures in one mesh this one, 1 the one with the most vertices. 0: the one that is "
        "recognised",
    )
    pairings: IntProperty(
        name="Pairings",
        default=1,
        min=1,
        max=64,
        description="Network: the mean over so many random pairings of vertices",
    )
    mirror: BoolProperty(
        name="Mirror", description="Network: also transfer the mirror images, and average; for symmetric subjects"
    )
    refine: BoolProperty(name="Refine", description="Give results the identity's surface detail")
    refine_radius: FloatProperty(
        name="Radius",
        default=0.04,
        min=0.001,
        max=10,
        precision=3,
        description="Detail below this fraction of the root of the mesh's area comes from the identity",
    )
    seed: IntProperty(name="Seed", min=0, description="Of every random choice")
    threads: IntProperty(name="Threads", min=0, max=4096, description="0: all processors")

    def options(self):
        """What npt.PoseTransfer is opened with."""
        return {
            "method": self.method,
            "quality": self.quality,
            "figure": self.figure,
            "pairings": self.pairings,
            "mirror": self.mirror,
            "refine": self.refine,
            "refine_radius": self.refine_radius if self.refine else None,
            "seed": self.seed,
            "threads": self.threads,
        }

    def motion_options(self):
        """What npt.transfer_motion is called with. A key for each frame: none is left out."""
        return {
            "foot_lock": self.foot_lock,
            "in_place": self.in_place,
            "clearance": self.clearance,
            "key_tolerance": 0,
        }

    def weights_named(self):
        """None: what npt.PoseTransfer opens by default."""
        if self.weights == "DEFAULT":
            return None
        return bpy.path.abspath(self.weights_file) if self.weights == "FILE" else self.weights


classes = [NPT_Settings]
